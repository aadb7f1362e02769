"""HTML pages of figures and pictures, each a single file; templates/ has their text."""
