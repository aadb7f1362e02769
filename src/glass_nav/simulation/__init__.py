"""A building, a robot and its lidar, as the physics of glass has them; seeded."""
