"""Finds moving objects in the scans of a robot that stands still: people are no obstacles of an atlas.

A person who walks at 0.1 m/s looks like a wall to an occupancy grid, whose cells are each covered for seconds. To a
robot that stands still, the person moves by centimetres along several adjacent beams. No wall does that, nor a pane:
it returns a beam or lets it pass to something farther away.
"""

from __future__ import annotations

from typing import Sequence

import numpy as np

from glass_nav.sensing.scan import Scan

_SHIFT_M = 0.05, 0.5  # of what moves: noise is less, more is another thing
_BEAMS = 3  # side by side that shift the same way
_AT_ONCE = 3  # scans whose median is compared


def moved_m(scans: Sequence[Scan]) -> np.ndarray:
    """(K, 2) where the things are now, in the robot's frame, that moved between the first of some scans and the last.

    Args:
        scans: one after another, all from the same pose.
    """
    count = min(_AT_ONCE, len(scans) // 2)
    if not count or any(len(scan) != len(scans[0]) for scan in scans):
        return np.zeros((0, 2))
    before, now = _middle_m(scans[:count]), _middle_m(scans[-count:])
    both = np.isfinite(before) & np.isfinite(now)
    shift = np.where(both, now, 0.0) - np.where(both, before, 0.0)
    moved = np.zeros(len(shift), bool)
    for sign in (-1.0, 1.0):
        moved |= _in_runs((sign * shift > _SHIFT_M[0]) & (sign * shift < _SHIFT_M[1]))
    return scans[-1].points_in_base()[moved & scans[-1].answered]


def _middle_m(scans: Sequence[Scan]) -> np.ndarray:
    """(B,) median range of each beam; inf where most of its ranges are."""
    return np.median([np.where(scan.answered, scan.ranges_m, np.inf) for scan in scans], axis=0)


def _in_runs(flag: np.ndarray) -> np.ndarray:
    """(B,) bool: beams of which so many side by side have the flag (B,)."""
    if len(flag) < _BEAMS:
        return np.zeros(len(flag), bool)
    whole = np.lib.stride_tricks.as_strided(flag, (len(flag) - _BEAMS + 1, _BEAMS), flag.strides * 2).all(axis=1)
    kept = np.zeros(len(flag), bool)
    for offset in range(_BEAMS):
        kept[offset : offset + len(whole)] |= whole
    return kept
