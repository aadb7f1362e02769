"""Converts maps, scans and poses to the types of other packages and back; so far to MRPT's Python bindings."""
