"""The command glass_nav: a file for each subcommand, with its options, one call, and what is printed."""
