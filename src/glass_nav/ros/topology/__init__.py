"""topology_node: parameters, conversions of its messages, markers, and the memory of scans."""
