"""What did each beam of a scan meet: a wall, a pane, a mirror image, a room behind glass?

beam_classifier.py calls the others: samples around the predicted pose -> ranges that the map lets them expect -> a
vote on the case of each beam. From the cases glass_map.py learns which walls are glass.
"""
