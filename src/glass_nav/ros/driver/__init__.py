"""driver_node."""
