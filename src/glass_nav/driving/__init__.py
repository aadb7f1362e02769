"""How does the robot get there? Along the edges of a Voronoi graph without a map, and to goals in the map.

driver.py decides what the node does: one task of tasks.py at a time, a command at each step. edge_tracking follows
edges; route.py and route_follower.py lead to a goal; recovery.py and input_watch.py say when to stop.
"""
