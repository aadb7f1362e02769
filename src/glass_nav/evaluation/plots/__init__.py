"""Figures as pictures, by matplotlib without a display."""
