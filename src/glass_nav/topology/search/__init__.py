"""The search for the robot in an atlas: meetpoint -> search forest -> vote -> turn."""
