"""Runs a recorded log through the filter of the node, scan by scan, and writes what came out. No roscore.

replay_run.py is the loop, replay_files.py writes the files; smoother.py estimates the trajectory from the whole log.
"""
