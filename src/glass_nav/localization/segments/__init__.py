"""Corrects a pose by a scan and the wall segments of a map, with quality measures."""
