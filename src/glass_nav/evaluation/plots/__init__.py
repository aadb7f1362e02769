"""Pictures of maps, runs and searches, by matplotlib without a display."""
