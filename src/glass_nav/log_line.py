"""A log line, passed from the code that decides to the node that writes it."""

from __future__ import annotations

import logging
from dataclasses import dataclass


@dataclass(frozen=True)
class LogLine:
    """A line for the log."""

    text: str
    level: int = logging.INFO
    often: bool = False  # may come at the rate of a topic: at most one in some seconds is worth reading
