"""bag_player: waits until the localization has its map, then becomes `rosbag play` with the same arguments.

Calls: request_nomotion_update (Empty), which the localization rejects until it is ready.
Parameters: ~wait_s (default 60), the longest wait; after it, the bag is played anyway, with a warning.
"""

from __future__ import annotations

import os
import sys
import time

import rospy
from std_srvs.srv import Empty

from glass_nav.ros import command_line, shutdown

ASK_PERIOD_S = 0.2


def main() -> None:
    """Wait, then play; exit code 2 for an invalid ~wait_s."""
    if command_line.answers_help(__doc__):
        return
    rospy.init_node("player", disable_signals=True)
    wait_s = rospy.get_param("~wait_s", 60.0)
    if isinstance(wait_s, bool) or not isinstance(wait_s, (int, float)) or not wait_s >= 0.0:
        shutdown.refuse_to_start(ValueError(f"~wait_s must be a number >= 0 s, got {wait_s!r}"))
    ending = shutdown.event_on_signals()
    end_s = time.monotonic() + wait_s  # by the wall clock: simulated time stands still until the bag plays
    while not _localization_is_ready() and not ending.is_set():
        if time.monotonic() > end_s:
            rospy.logwarn(f"no localization with a map after {wait_s:g} s: playing all the same")
            break
        ending.wait(ASK_PERIOD_S)
    if ending.is_set():
        return
    rospy.signal_shutdown("rosbag play takes this node's name")
    os.execvp("rosrun", ["rosrun", "rosbag", "play", *sys.argv[1:]])


def _localization_is_ready() -> bool:
    try:
        rospy.wait_for_service("request_nomotion_update", timeout=0.1)
        rospy.ServiceProxy("request_nomotion_update", Empty)()
    except (rospy.ROSException, rospy.ServiceException):
        return False
    return True
