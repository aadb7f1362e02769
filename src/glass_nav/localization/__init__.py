"""Where in the map?  SCAN -> CASES -> WEIGHTS -> POSE."""
