"""The pose from bearings to landmarks, with its error."""
