"""What the robot sees, and what a map lets a sensor expect.

scan_placement.py makes every scan, of a node or of a bag: placed on the robot, deskewed, checked. raycast.py and
distance_field.py are what the map predicts for it. The rest are bearings to landmarks and odometry of wheels.
"""
