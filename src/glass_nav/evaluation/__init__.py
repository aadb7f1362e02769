"""How good was it? Figures (metrics), pictures of them (plots), and HTML pages of both (pages)."""
