"""Scores trajectories and cases: errors, tables and pictures."""
