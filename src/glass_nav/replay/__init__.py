"""Runs a recording through the filter, scan by scan, and writes the results. No roscore."""
