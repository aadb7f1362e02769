"""A recording through the filter, scan by scan, and what is written of it. No roscore."""
