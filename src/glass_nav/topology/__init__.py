"""Finds the robot in an atlas: meetpoint -> search forest -> vote -> turn."""
