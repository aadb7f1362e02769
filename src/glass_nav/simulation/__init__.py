"""A simulated building, robot and lidar, with the physics of glass; seeded."""
