"""A roscore that another program starts: wait until it answers."""

from __future__ import annotations

import time
from pathlib import Path

import rosgraph


def wait_until_online(uri: str, limit_s: float, log: Path) -> None:
    """Return once the master at that address answers; SystemExit, which names the log, if it does not within the limit."""
    deadline_s = time.monotonic() + limit_s
    while not rosgraph.is_master_online(uri):
        if time.monotonic() > deadline_s:
            raise SystemExit(f"no master at {uri} within {limit_s:g} s: see {log}")
        time.sleep(0.2)
