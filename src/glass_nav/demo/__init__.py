"""What the wake-up demo shows and measures."""
