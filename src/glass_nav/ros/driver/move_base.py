"""The action of a running move_base, for driving/move_base_task.py."""

from __future__ import annotations

from typing import Callable

import actionlib
import numpy as np
import rospy
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal

from glass_nav.driving.tasks import Ending
from glass_nav.ros import conversions
from glass_nav.vocabulary import Outcome


class MoveBase:
    """Sends goals in the map's frame, and hears whether the action server lives."""

    def __init__(self, frame: str) -> None:
        self.name = rospy.resolve_name("move_base")
        self._frame = frame
        self._client = actionlib.SimpleActionClient("move_base", MoveBaseAction)
        self._was_heard = False
        rospy.Subscriber("move_base/status", GoalStatusArray, self._hear, queue_size=1)

    @property
    def is_there(self) -> bool:
        """Whether the action server is connected."""
        return bool(self._client.wait_for_server(rospy.Duration(1e-3)))

    def was_heard(self) -> bool:
        """Whether its status came since the last call; an action server sends it several times a second."""
        was_heard, self._was_heard = self._was_heard, False
        return was_heard

    def send(self, map_from_goal: np.ndarray, done: Callable[[Ending], None]) -> None:
        """Drive to that pose (3,); done is called by another thread."""
        goal = MoveBaseGoal()
        goal.target_pose.header.frame_id, goal.target_pose.header.stamp = self._frame, rospy.Time.now()
        goal.target_pose.pose = conversions.pose_from_planar(map_from_goal)
        self._client.send_goal(goal, done_cb=lambda status, _: done(self._ending(status)))

    def cancel(self) -> None:
        """The goal that was sent last."""
        self._client.cancel_goal()

    def _hear(self, _msg: GoalStatusArray) -> None:
        self._was_heard = True

    def _ending(self, status: int) -> Ending:
        outcome, words = _ENDINGS.get(status, (Outcome.NO_MOVE_BASE, f"ended the goal with status {status}"))
        text = self._client.get_goal_status_text()
        said = f": {text}" if text else ""
        return Ending(outcome, f"{self.name} {words}{said}")


_ENDINGS = {  # of move_base's action; SimpleActionClient calls back with no other
    GoalStatus.SUCCEEDED: (Outcome.SUCCEEDED, "is at the goal"),
    GoalStatus.ABORTED: (Outcome.NO_WAY, "aborted the goal"),
    GoalStatus.REJECTED: (Outcome.NO_WAY, "rejected the goal"),
    GoalStatus.PREEMPTED: (Outcome.NO_MOVE_BASE, "ended the goal, preempted"),
    GoalStatus.RECALLED: (Outcome.NO_MOVE_BASE, "ended the goal, recalled"),
    GoalStatus.LOST: (Outcome.NO_MOVE_BASE, "ended the goal, lost"),
}
