"""landmarks_node."""
