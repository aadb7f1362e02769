"""Types of other packages and ours."""
