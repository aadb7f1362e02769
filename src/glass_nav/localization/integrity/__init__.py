"""Is the pose right?  The kidnap detector, and the state with its reason."""
