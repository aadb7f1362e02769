"""Limits how often a kind of line is logged: a warning at scan rate would bury the others."""

from __future__ import annotations

import logging
import re
import time
from typing import Dict

import rospy

from glass_nav.log_line import LogLine

_NUMBER = re.compile(r"\d+(\.\d+)?")
_MAX_KINDS = 200
_PERIOD_S = 5.0
_WRITERS = {logging.INFO: rospy.loginfo, logging.WARNING: rospy.logwarn, logging.ERROR: rospy.logerr}


class LogThrottle:
    """Logs a line unless one that differs only in its numbers was logged a moment ago.

    rospy's own throttles go by the place in the code, where two reasons hide each other, or by the
    exact text, which differs each time if it has a stamp. Periods are of the wall clock: ROS time may stand still.
    """

    def __init__(self) -> None:
        self._said_s: Dict[str, float] = {}  # kind of line -> when last logged [s]

    def is_due(self, text: str, period_s: float) -> bool:
        """Whether a line of that kind may be logged; if so, it counts as logged."""
        kind = _NUMBER.sub("#", text)
        now_s = time.monotonic()
        if now_s - self._said_s.get(kind, -period_s) < period_s:
            return False
        if len(self._said_s) >= _MAX_KINDS:
            self._said_s.clear()
        self._said_s[kind] = now_s
        return True

    def write(self, line: LogLine) -> None:
        if not line.often or self.is_due(line.text, _PERIOD_S):
            _WRITERS[line.level](line.text)

    def warn(self, text: str, period_s: float = _PERIOD_S) -> None:
        if self.is_due(text, period_s):
            rospy.logwarn(text)

    def error(self, text: str, period_s: float = _PERIOD_S) -> None:
        if self.is_due(text, period_s):
            rospy.logerr(text)
