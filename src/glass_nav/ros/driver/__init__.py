"""driver_node: parameters, conversions of its messages, markers, and the action of move_base."""
