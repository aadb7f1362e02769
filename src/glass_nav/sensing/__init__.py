"""Scans, ray casts, and what the map lets a sensor expect."""
