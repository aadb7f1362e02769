"""simulator_node: the simulation as topics, in simulated time."""
