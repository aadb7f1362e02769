"""Many replays side by side: contestants, logs and seeds, on several cores or machines."""
