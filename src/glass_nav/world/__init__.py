"""The map: cells and metres, and the files maps come in."""
