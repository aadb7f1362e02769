"""Where may these scans have been taken? Many poses at once, each followed and scored.

Two searches use it. global_search.py is that of the localization, and ends with one place. pose_belief.py keeps all
places with their probabilities, for the search in an atlas. Both follow poses by pose_tracker.py, find new ones by
scan_matcher.py, and slide them to the walls by scan_alignment.py.
"""
