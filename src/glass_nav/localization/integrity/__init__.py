"""Is the reported pose right?

integrity_monitor.py keeps the covariance of the tracked pose and kidnap_detector.py looks for a better place;
pose_state.py makes of both the state, the reason and the confidence of ~status, and protection_level.py the bounds of
the error.
"""
