"""localization_node, also startable as amcl."""
