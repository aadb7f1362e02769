"""The map: cells, metres, and map files."""
