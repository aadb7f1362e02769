"""Areas of the plane, given by their corners."""

from __future__ import annotations

import numpy as np


def inside(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(M,) bool: which points (M, 2) lie in a polygon (N, 2) of at least 3 corners in either order.

    A ray to the right crosses its edges an odd number of times; so an edge that runs over another one cuts out.
    """
    x, y = np.asarray(points, float).T[:, :, None]
    x0, y0 = np.asarray(corners, float).T
    x1, y1 = np.roll(x0, -1), np.roll(y0, -1)
    spans = (y0 > y) != (y1 > y)  # (M, N), half open: a corner counts once
    with np.errstate(divide="ignore", invalid="ignore"):
        right = x < x0 + (y - y0) / (y1 - y0) * (x1 - x0)
    return np.count_nonzero(spans & right, axis=1) % 2 == 1
