"""Finds faults of a robot's scans, frames, odometry and map. Without ROS, as all packages but `ros`."""
