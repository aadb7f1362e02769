"""Runs several sets of parameters over several logs and seeds, on many cores or machines, and compares them.

compare_runs.py is one run, engine.py distributes them, evaluation/metrics/comparison.py has the statistics.
"""
