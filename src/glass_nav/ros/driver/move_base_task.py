"""A goal in the map that a running move_base drives to, by its action."""

from __future__ import annotations

import math
import time
from typing import Callable, Optional

import actionlib
import numpy as np
import rospy
from actionlib_msgs.msg import GoalStatus
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal

from glass_nav.driving.tasks import Ending, Moment
from glass_nav.ros import conversions
from glass_nav.vocabulary import DriverPhase, Outcome


class MoveBase:
    """The action of move_base."""

    def __init__(self) -> None:
        self.name = rospy.resolve_name("move_base")
        self._client = actionlib.SimpleActionClient("move_base", MoveBaseAction)

    @property
    def is_there(self) -> bool:
        """Its action server is connected."""
        return bool(self._client.wait_for_server(rospy.Duration(1e-3)))

    def send(self, map_from_base: np.ndarray, frame: str, done: Callable[[int, str], None]) -> None:
        """Drive to that pose (3,); done is called with status and text, by another thread."""
        goal = MoveBaseGoal()
        goal.target_pose.header.frame_id, goal.target_pose.header.stamp = frame, rospy.Time.now()
        goal.target_pose.pose = conversions.pose_from_planar(map_from_base)
        self._client.send_goal(goal, done_cb=lambda status, _: done(status, self._client.get_goal_status_text()))

    def cancel(self) -> None:
        self._client.cancel_goal()


class MoveBaseTask:
    """Sends one goal once move_base is there, and reports how that ends."""

    needs_pose, steers = True, False

    def __init__(self, move_base: MoveBase, map_from_goal: np.ndarray, frame: str, wait_s: float) -> None:
        """
        Args:
            move_base: that drives.
            map_from_goal: (3,).
            frame: of the map.
            wait_s: for the action server, by the wall clock.
        """
        self._move_base, self._goal, self._frame = move_base, map_from_goal, frame
        self._wait_s, self._began_s = wait_s, time.monotonic()
        self._sent = False
        self._ended: Optional[Ending] = None  # written by the thread of the client
        self.remaining_m = math.nan
        self.ending: Optional[Ending] = None

    @property
    def phase(self) -> DriverPhase:
        return DriverPhase.GOING

    @property
    def reason(self) -> str:
        return f"{self._move_base.name} drives" if self._sent else f"waiting for {self._move_base.name}"

    def step(self, now: Moment) -> np.ndarray:
        """Zero: it does not steer."""
        if now.map_from_base is not None:
            self.remaining_m = float(np.hypot(*(self._goal[:2] - now.map_from_base[:2])))
        if not self._sent and self._move_base.is_there:
            self._sent = True
            self._move_base.send(self._goal, self._frame, self._done)
        elif not self._sent and time.monotonic() - self._began_s > self._wait_s:
            self.ending = Ending(
                Outcome.NO_MOVE_BASE,
                f"no action server {self._move_base.name} within {self._wait_s:g} s: "
                "start move_base, or set ~backend to internal",
            )
        if self._ended is not None:
            self.ending = self._ended
        return np.zeros(3)

    def cancel(self) -> None:
        if self._sent and self._ended is None:
            self._move_base.cancel()

    def _done(self, status: int, text: str) -> None:
        outcome, words = _ENDINGS.get(status, (Outcome.NO_MOVE_BASE, f"ended the goal with status {status}"))
        said = f": {text}" if text else ""
        self._ended = Ending(outcome, f"{self._move_base.name} {words}{said}")


_ENDINGS = {  # of move_base's action; SimpleActionClient calls back with no other
    GoalStatus.SUCCEEDED: (Outcome.SUCCEEDED, "is at the goal"),
    GoalStatus.ABORTED: (Outcome.NO_WAY, "aborted the goal"),
    GoalStatus.REJECTED: (Outcome.NO_WAY, "rejected the goal"),
    GoalStatus.PREEMPTED: (Outcome.NO_MOVE_BASE, "ended the goal, preempted"),
    GoalStatus.RECALLED: (Outcome.NO_MOVE_BASE, "ended the goal, recalled"),
    GoalStatus.LOST: (Outcome.NO_MOVE_BASE, "ended the goal, lost"),
}
