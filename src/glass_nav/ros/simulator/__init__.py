"""simulator_node."""
