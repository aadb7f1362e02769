"""Trajectories, cases and runs -> figures."""
