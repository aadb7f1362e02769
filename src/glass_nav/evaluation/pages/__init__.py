"""Figures and pictures -> one HTML file."""
