"""Figures of trajectories, cases and runs."""
