"""Where may the scan have been taken?  SCANS -> POSES -> BELIEF: many poses at once, each followed and scored."""
