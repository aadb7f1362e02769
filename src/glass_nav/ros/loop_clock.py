"""ROS time for the run loop of a node, with detection of jumps back: a bag or a simulation starts over."""

from __future__ import annotations

from typing import Optional

import rospy

TIME_JUMP_S = 0.5  # smaller jumps back are noise between machines


class LoopClock:
    """Read once in each pass of the loop."""

    def __init__(self) -> None:
        self.now_s = rospy.get_time()
        self.has_begun = False  # in this pass: before it, there was no /clock

    def tick(self) -> Optional[str]:
        """Read the time; returns in words by how much it jumped back, or None."""
        before_s, self.now_s = self.now_s, rospy.get_time()
        self.has_begun = before_s == 0.0
        back_s = before_s - self.now_s
        return f"time jumped back by {back_s:.3f} s" if back_s > TIME_JUMP_S else None
