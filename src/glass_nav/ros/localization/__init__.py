"""localization_node, also startable as amcl: parameters, inputs, publishers, dynamic_reconfigure."""
