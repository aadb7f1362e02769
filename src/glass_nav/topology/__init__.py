"""Where in an atlas, the Voronoi graph of a building, did the robot wake up?

search_session.py decides what the node does. The robot drives from meetpoint to meetpoint; at each one the package
search compares what was seen with the graph and answers with the next turn. The package atlas builds, reads and
writes the graph.
"""
