"""Reads recorded robots: bags and rawlogs to our own types. No roscore, no rospy."""
