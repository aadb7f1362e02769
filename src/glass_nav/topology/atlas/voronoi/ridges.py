"""The Voronoi ridges between bounds: circumcentres of their Delaunay triangles, joined."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Tuple

import numpy as np
from scipy.spatial import Delaunay

from glass_nav.topology.atlas.voronoi.bounds import Bounds

SEPARATION_CELLS = 3.5  # cells of one wall lie closer; two walls closer than this look like one


@dataclass(frozen=True)
class Ridges:
    """The raw graph: V vertices, L links between them."""

    points: np.ndarray  # (V, 2) circumcentres
    r: np.ndarray  # (V,) their distance from the cells that they are equidistant from
    generator: np.ndarray  # (V, 3) int: these cells, rows of Bounds.points
    links: np.ndarray  # (L, 2) int: vertices that a ridge joins


def of(bounds: Bounds, clearance: float) -> Ridges:
    """The ridges on which a robot of that radius [cells] can drive."""
    if len(bounds.points) < 4:
        return Ridges(np.zeros((0, 2)), np.zeros(0), np.zeros((0, 3), int), np.zeros((0, 2), int))
    mesh = Delaunay(bounds.points)
    centres, r = _circumcircles(bounds.points[mesh.simplices])
    with np.errstate(invalid="ignore"):  # slivers on the hull have none
        inside = (
            (r > clearance)
            & (centres > -1.0).all(axis=1)
            & (centres < np.array(bounds.open.shape[::-1]) - 1.0).all(axis=1)
        )
    reachable = np.flatnonzero(inside)
    column_row = np.floor(centres[reachable] + 1.0).astype(np.int64)
    reachable = reachable[bounds.open[column_row[:, 1], column_row[:, 0]]]
    vertex = np.full(len(mesh.simplices), -1)
    vertex[reachable] = np.arange(len(reachable))
    links = []
    for opposite in range(3):  # the side opposite to corner k is shared with neighbour k
        beyond = mesh.neighbors[reachable, opposite]
        there = (beyond > reachable) & (vertex[beyond] >= 0)
        here, beyond = reachable[there], beyond[there]
        first = bounds.points[mesh.simplices[here, (opposite + 1) % 3]]
        second = bounds.points[mesh.simplices[here, (opposite + 2) % 3]]
        apart = np.hypot(*(first - second).T)
        middle = (first + second) / 2.0
        narrowest = np.sum((centres[here] - middle) * (centres[beyond] - middle), axis=1) < 0.0
        kept = (apart > SEPARATION_CELLS) & ~(narrowest & (apart <= 2.0 * clearance))
        links.append(np.column_stack([vertex[here[kept]], vertex[beyond[kept]]]))
    return Ridges(centres[reachable], r[reachable], mesh.simplices[reachable], np.concatenate(links))


def _circumcircles(corners: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Centres (T, 2) and radii (T,) of triangles (T, 3, 2); not finite where the corners are in a line."""
    first = corners[:, 0]
    b, c = corners[:, 1] - first, corners[:, 2] - first
    twice_area = b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0]
    bb, cc = np.sum(b * b, axis=1), np.sum(c * c, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        offset = np.column_stack([c[:, 1] * bb - b[:, 1] * cc, b[:, 0] * cc - c[:, 0] * bb]) / (
            2.0 * twice_area[:, None]
        )
    return first + offset, np.hypot(offset[:, 0], offset[:, 1])
