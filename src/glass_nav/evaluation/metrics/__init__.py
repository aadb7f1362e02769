"""Figures of a run against a reference: errors, beam cases, integrity, nodes passed, and comparisons of runs."""
