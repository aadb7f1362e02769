"""Classifies the beams of a scan by what they met, and learns from the cases which walls are glass."""
