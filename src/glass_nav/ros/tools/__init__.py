"""Programs beside the nodes: map server, bag player, live doctor, demo, rviz fitted to the map, reader of launch files."""
