"""Which pieces of wall a scan is evidence of, and what share of them the map explains, at poses and by chance.

K poses, B beams.
"""

from __future__ import annotations

from typing import Optional

import numpy as np

from glass_nav.hypotheses import new_walls
from glass_nav.hypotheses.scan_explanation import BeamsExplained

_FEW = 8  # likely poses, at most, whose disagreement counts
_CHANCE_RANK = 10  # of the distinct places, by what the map explains: nobody expects so many copies of a place
_APART_M = 0.7  # distinct places


def counted(beams: BeamsExplained, new: np.ndarray, likely: np.ndarray) -> np.ndarray:
    """(B,) pieces of wall that the beams are evidence of, of which they show (B,) for the first time.

    The whole scan is evidence, by the part of the walls explained that is new, at the likely pose ((K,) bool) that explains
    most of them. What is not explained there would be the wrong measure: beams that met a mirror or a person end
    somewhere else each time.
    """
    pieces = new_walls.pieces(beams.ends_m)
    explained = beams.explained[int(np.where(likely, beams.explained @ pieces, -1.0).argmax())]
    return pieces * ((new @ explained) / max(float(pieces @ explained), 1.0))


def disputed(beams: BeamsExplained, likely: np.ndarray) -> np.ndarray:
    """(B, 2) in the robot's frame, where likely poses ((K,) bool) disagree about a beam, if they are few: the map explains it
    from one of them and contradicts it there from another. NaN: they do not disagree.

    What tells copies of a room apart is a piece of furniture beside walls that were seen through the door long before.
    """
    if not 1 < np.count_nonzero(likely) <= _FEW:
        return np.full(beams.ends_m.shape, np.nan)
    nearest = np.fmin.reduce(beams.contradicted_at[likely], axis=0)
    explained = beams.explained[likely].any(axis=0)
    return beams.ends_m * np.where(explained, nearest, np.nan)[:, None]


def explained_share(beams: BeamsExplained, pieces: np.ndarray) -> np.ndarray:
    """(K,) of the pieces of wall (B,) seen that the map explains; 0 where it knows none of them."""
    return (beams.explained @ pieces) / np.maximum(beams.known @ pieces, 1e-9)


def by_chance(poses: np.ndarray, share: np.ndarray) -> Optional[float]:
    """What the map explains where the robot is not: the share of the tenth best of the distinct places (K, 3); None: there
    are fewer.
    """
    order = np.argsort(-share, kind="stable")
    for _ in range(_CHANCE_RANK - 1):
        if not len(order):
            return None
        off_m = poses[order, :2] - poses[order[0], :2]
        order = order[np.hypot(off_m[:, 0], off_m[:, 1]) > _APART_M]
    return float(share[order[0]]) if len(order) else None
