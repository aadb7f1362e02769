"""bag_player: waits until the localization has its map, then runs `rosbag play` with the same arguments.

Logs when it starts, how far it is every few seconds, and when it is over. Subscribes: /clock, which the player sends.
Calls: request_nomotion_update (Empty), which the localization rejects until it is ready.
Parameters: ~wait_s (default 60), the longest wait; after it, the bag is played anyway, with a warning.
"""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import List, Optional

import rosbag
import rospy
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Empty

from glass_nav.recording import play_progress
from glass_nav.recording.play_progress import PlayedPart
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
            rospy.logwarn(f"no localization with a map after {wait_s:g} s: playing anyway")
            break
        ending.wait(ASK_PERIOD_S)
    if ending.is_set():
        return
    sys.exit(_play([word for word in sys.argv[1:] if not word.startswith("__")], ending))


def _play(arguments: List[str], ending: threading.Event) -> int:
    """Play with progress; returns the exit code of rosbag play."""
    clock_s: List[float] = []
    rospy.Subscriber("/clock", Clock, lambda msg: clock_s.__setitem__(slice(None), [msg.clock.to_sec()]), queue_size=1)
    part = _part(arguments)
    if part is not None:
        rospy.loginfo(part.started([Path(path).name for path in play_progress.bags_of(arguments)]))
    player = subprocess.Popen(["rosrun", "rosbag", "play", *arguments])
    next_line_s = time.monotonic() + play_progress.PERIOD_S
    while player.poll() is None:
        if ending.wait(ASK_PERIOD_S):
            player.send_signal(signal.SIGINT)
            return player.wait()
        if part is not None and clock_s and time.monotonic() >= next_line_s:
            next_line_s += play_progress.PERIOD_S
            rospy.loginfo(part.progress(clock_s[0]))
    rospy.loginfo("the bag is over" if player.returncode == 0 else f"rosbag play ended with {player.returncode}")
    return player.returncode


def _part(arguments: List[str]) -> Optional[PlayedPart]:
    """The part to be played; None if a bag cannot be read (rosbag play reports why)."""
    spans_s = []
    try:
        for path in play_progress.bags_of(arguments):
            with rosbag.Bag(path) as bag:
                spans_s.append((bag.get_start_time(), bag.get_end_time()))
    except (OSError, rosbag.ROSBagException):
        return None
    return play_progress.played_part(arguments, spans_s) if spans_s else None


def _localization_is_ready() -> bool:
    try:
        rospy.wait_for_service("request_nomotion_update", timeout=0.1)
        rospy.ServiceProxy("request_nomotion_update", Empty)()
    except (rospy.ROSException, rospy.ServiceException):
        return False
    return True
