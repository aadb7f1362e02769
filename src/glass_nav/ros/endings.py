"""How a node is told to end, and how it says that it cannot begin."""

from __future__ import annotations

import signal
import sys
import threading
from typing import NoReturn

import rospy


def event_on_signals() -> threading.Event:
    """Set by SIGINT and SIGTERM; for nodes that call rospy.init_node(..., disable_signals=True).

    rospy's own handler shuts down from within whatever the main thread is doing; within a call of the parameter server
    it waits for itself. Ours only asks the loop to end.
    """
    ending = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ending.set())
    return ending


def refuse_to_start(err: Exception, exit_code: int = 2) -> NoReturn:
    """One line in the log, with the node's name in front, and the end of the process."""
    name, text = rospy.get_name(), " ".join(str(err).split())
    rospy.logfatal(text if text.startswith(name) else f"{name}: {text}")
    rospy.signal_shutdown("cannot start")
    sys.exit(exit_code)
