"""Which glass does the map lack? Scans at trusted poses -> panes."""
