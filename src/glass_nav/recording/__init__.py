"""Recorded robots as our own types, without ROS: bags of ROS 1 and ROS 2, MRPT rawlogs, trajectories, and bags of results.

log_file.py opens any of them as a Recording (recording.py).
"""
