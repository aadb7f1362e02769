"""The command glass_nav: a file per subcommand."""
