"""What did each beam meet?  SCAN -> EXPECTED RANGES -> CASES, and what the cases say about the walls."""
