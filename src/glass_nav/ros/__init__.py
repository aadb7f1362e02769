"""The only room that knows rospy, tf2 and messages: nodes are wiring."""
