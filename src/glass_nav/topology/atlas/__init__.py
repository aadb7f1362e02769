"""The hierarchical atlas: its arrays, its files, and how it is built from a map."""
