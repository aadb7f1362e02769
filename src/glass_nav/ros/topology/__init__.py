"""topology_node."""
