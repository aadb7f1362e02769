"""Keeps an action server's status published when time jumps back."""

from __future__ import annotations

from typing import Any

import rospy

PERIOD_S = 0.2  # actionlib's own


def start(server: Any) -> None:
    """Start a SimpleActionServer; actionlib's status timer ends with an exception when time jumps back."""
    server.start()
    timer = getattr(server.action_server, "status_timer", None)  # None if its rate was set to 0
    if timer is None:
        return
    timer.shutdown()
    server.action_server.status_timer = rospy.Timer(
        rospy.Duration(PERIOD_S), server.action_server.publish_status_async, reset=True
    )
