"""The progress of a playing bag as log lines: at the start, every few seconds, and at the end."""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass
from typing import List, Optional, Sequence, Tuple

PERIOD_S = 10.0  # between two lines, by the wall clock


@dataclass(frozen=True)
class PlayedPart:
    """The part of its bags that `rosbag play` plays, in bag time [s]."""

    begin_s: float
    duration_s: float
    rate: float  # seconds of the bag in a second

    def started(self, names: Sequence[str]) -> str:
        """The line about the start."""
        speed = "" if self.rate == 1.0 else f", {self.rate:g} times as fast"
        return f"playing {', '.join(names)}: {self.duration_s:.0f} s{speed}"

    def progress(self, now_s: float) -> str:
        """The line at a time of the bag [s]."""
        done_s = min(max(now_s - self.begin_s, 0.0), self.duration_s)
        share = done_s / self.duration_s if self.duration_s > 0.0 else 1.0
        left_s = (self.duration_s - done_s) / self.rate
        return f"played {done_s:.0f} of {self.duration_s:.0f} s ({100.0 * share:.0f} %), {left_s:.0f} s left"


def played_part(arguments: Sequence[str], spans_s: Sequence[Tuple[float, float]]) -> PlayedPart:
    """The part that these arguments of `rosbag play` play, of bags from and to these times [s].

    An option that cannot be read counts as not given: rosbag play says what is wrong with it.
    """
    begin_s, end_s = min(begin for begin, _ in spans_s), max(end for _, end in spans_s)
    given = _known(arguments)
    start_s = min(_number(given.start, 0.0), end_s - begin_s)
    duration_s = min(_number(given.duration, math.inf), end_s - begin_s - start_s)
    rate = _number(given.rate, 1.0)
    return PlayedPart(begin_s + start_s, duration_s, rate if rate > 0.0 else 1.0)


def bags_of(arguments: Sequence[str]) -> List[str]:
    """The bags among arguments of `rosbag play`."""
    return [word for word in arguments if word.endswith(".bag") and not word.startswith("-")]


def _known(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    for short, long in (("-s", "--start"), ("-u", "--duration"), ("-r", "--rate")):
        parser.add_argument(short, long, nargs="?")
    return parser.parse_known_args(list(arguments))[0]


def _number(text: Optional[str], default: float) -> float:
    try:
        value = float(text or default)
    except ValueError:
        return default
    return value if value >= 0.0 else default
