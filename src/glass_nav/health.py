"""The entries of /diagnostics, without ROS."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, Mapping


class Level(IntEnum):
    """How much an entry matters; the numbers are those of diagnostic_msgs/DiagnosticStatus.msg."""

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass(frozen=True)
class Health:
    """One entry: a level, one sentence, and named figures."""

    level: Level
    message: str
    values: Mapping[str, Any] = field(default_factory=dict)
