"""landmarks_node and scanner_node: bearings to tags as messages, the fix as a pose."""
