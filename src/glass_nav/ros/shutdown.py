"""How a node starts, runs and ends, and how it reports that it cannot start."""

from __future__ import annotations

import logging
import signal
import sys
import threading
from typing import Any, Callable, Dict, NoReturn, Tuple, Type

import rospy


def event_on_signals() -> threading.Event:
    """Set by SIGINT and SIGTERM; for nodes that call rospy.init_node(..., disable_signals=True).

    rospy's own handler interrupts the main thread to shut down; during a call to the parameter server it deadlocks.
    Ours only asks the loop to end.
    """
    ending = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ending.set())
    return ending


def refuse_to_start(err: Exception, exit_code: int = 2) -> NoReturn:
    """Log one line, with the node's name in front, and end the process."""
    name, text = rospy.get_name(), " ".join(str(err).split())
    rospy.logfatal(text if text.startswith(name) else f"{name}: {text}")
    rospy.signal_shutdown("cannot start")
    sys.exit(exit_code)


def core_logs_to_rosout() -> None:
    """Send the log lines of the core where rospy's lines go."""
    core_log = logging.getLogger("glass_nav")
    core_log.handlers = logging.getLogger("rosout").handlers
    core_log.setLevel(logging.INFO)
    core_log.propagate = False


def run_node(name: str, make: Callable[[Dict[str, Any]], Any], bad_input: Tuple[Type[Exception], ...] = ()) -> None:
    """Start a node and run it until it is asked to end.

    Args:
        name: of the node, unless it is renamed.
        make: makes the node from its private parameters; ValueError ends it with exit code 2.
        bad_input: exceptions of make() and of its run() that end it with exit code 3.
    """
    rospy.init_node(name, disable_signals=True)
    ending = event_on_signals()
    core_logs_to_rosout()
    try:
        node = make(rospy.get_param("~", {}))
    except (ValueError, *bad_input) as err:
        refuse_to_start(err, 3 if isinstance(err, bad_input) else 2)
    try:
        node.run(ending)
    except bad_input as err:
        refuse_to_start(err, 3)
    finally:
        rospy.signal_shutdown("ended")
