"""How a node is told to end."""

from __future__ import annotations

import signal
import threading


def event_on_signals() -> threading.Event:
    """Set by SIGINT and SIGTERM; for nodes that call rospy.init_node(..., disable_signals=True).

    rospy's own handler shuts down from within whatever the main thread is doing; within a call of the parameter server
    it waits for itself. Ours only asks the loop to end.
    """
    ending = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ending.set())
    return ending
