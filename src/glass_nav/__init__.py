"""Where is a ROS 1 robot with a 2D lidar, in a building full of glass?"""
