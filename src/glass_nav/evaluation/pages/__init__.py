"""HTML pages of figures and pictures, each one file."""
