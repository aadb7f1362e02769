"""Finds glass that the map lacks, from scans at trusted poses."""
