"""What is wrong with a robot's scans, frames, odometry and map: knows no ROS, as the other rooms."""
