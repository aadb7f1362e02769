"""One search in an atlas: meetpoint -> search forest -> belief -> verdict -> turn.

atlas_localizer.py calls the others. search_forest.py and matching.py keep the places that the graph allows,
joint_belief.py weighs them together with the scans, joint_verdict.py decides (graph_verdict.py without scans),
vote.py chooses the turn.
"""
