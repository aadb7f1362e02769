"""Where in the atlas?  MEETPOINT -> FOREST -> VOTE -> TURN."""
