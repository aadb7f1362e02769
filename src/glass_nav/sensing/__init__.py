"""What the robot senses, and what the map lets it expect: scans and ray casts."""
