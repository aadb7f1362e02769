"""Small programs around the nodes: map server, bag player, live doctor, demo, launch file reader."""
