"""Where is the robot in a known map?

localizer.py is the filter: for each scan it calls beam_classification, particle_filter and integrity, in this order.
session.py decides what the node does: when a filter starts, where, and what is missing. segments and bearings compute
one pose without the filter.
"""
