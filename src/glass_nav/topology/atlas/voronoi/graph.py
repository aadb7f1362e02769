"""Converts meetpoints and lines from cells to metres in the frame of the map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import List, Tuple

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from glass_nav.geometry import polyline, se2
from glass_nav.topology.atlas import components
from glass_nav.topology.atlas.voronoi.bounds import Bounds
from glass_nav.topology.atlas.voronoi.meetpoints import Meetpoints
from glass_nav.topology.atlas.voronoi.ridges import Ridges
from glass_nav.world.grid_map import GridMap

TRACE_CELLS = 3.0  # a line is smoothed over so many cells (1 sigma): the steps of rasterized walls
POINT_CELLS = 1.0  # distance of the points of a line


@dataclass(frozen=True)
class VoronoiGraph:
    """Nodes and edges in the frame of the map. Nodes have degree 1, 3 or more, except one on each plain ring."""

    position_m: np.ndarray  # (N, 2)
    r_m: np.ndarray  # (N,) mean distance of the obstacles that it is equidistant from
    spread_m: np.ndarray  # (N,) spread of the meetpoints that were merged; 0 for most
    doubt_m: np.ndarray  # (N,) distance of the most doubtful of these obstacles from a wall, at most r
    obstacles_m: List[np.ndarray]  # (N) arrays (k, 2): the obstacles' nearest cells
    edge_node: np.ndarray  # (E, 2) int: nodes that each edge joins
    lines_m: List[np.ndarray]  # (E) arrays (n, 2) from the one to the other, n >= 2
    line_clearance_m: List[np.ndarray]  # (E) arrays (n,) distance of the nearest obstacle, posts and specks too
    left_out: int  # parts of the free space that were too small for smallest_component_m

    @property
    def degree(self) -> np.ndarray:
        """(N,) number of ends of edges."""
        return np.bincount(self.edge_node.ravel(), minlength=len(self.r_m))

    def components(self) -> Tuple[int, np.ndarray]:
        """How many parts do not touch, and (N,) in which of them each node lies."""
        return components.connected(len(self.r_m), self.edge_node[:, 0], self.edge_node[:, 1])


def in_map(grid_map: GridMap, bounds: Bounds, ridges: Ridges, meetpoints: Meetpoints, left_out: int) -> VoronoiGraph:
    """The graph in metres, in an order that does not depend on how it was made."""
    resolution_m = grid_map.resolution_m

    def metres(points: np.ndarray) -> np.ndarray:
        return se2.transform_points(grid_map.map_from_grid, points * resolution_m)

    nodes = sorted(meetpoints.members, key=lambda node: _order(meetpoints.position[node]))
    number = {node: index for index, node in enumerate(nodes)}
    members = [meetpoints.members[node] for node in nodes]
    cells = [np.unique(ridges.generator[its]) for its in members]
    edges = sorted(
        (_edge([number[end] for end in meetpoints.ends[edge]], meetpoints.lines[edge]) for edge in meetpoints.edges),
        key=lambda edge: (edge[0], _order(edge[1][len(edge[1]) // 3])),
    )
    lines = [_smooth(line) for _, line in edges]
    obstacles = cKDTree(np.concatenate([bounds.points, bounds.posts])) if edges else None
    position = np.array([meetpoints.position[node] for node in nodes]).reshape(-1, 2)
    r_m = np.array([ridges.r[its].mean() for its in members]) * resolution_m
    return VoronoiGraph(
        position_m=metres(position),
        r_m=r_m,
        spread_m=np.array(
            [
                np.sqrt(((ridges.points[its] - ridges.points[its].mean(axis=0)) ** 2).sum(axis=1).mean())
                for its in members
            ]
        )
        * resolution_m,
        doubt_m=np.minimum(np.array([bounds.doubt[its].max() for its in cells]) * resolution_m, r_m),
        obstacles_m=[metres(bounds.points[its]) for its in cells],
        edge_node=np.array([ends for ends, _ in edges], int).reshape(-1, 2),
        lines_m=[metres(line) for line in lines],
        line_clearance_m=[obstacles.query(line)[0] * resolution_m for line in lines] if obstacles is not None else [],
        left_out=left_out,
    )


def _edge(ends: List[int], line: np.ndarray) -> Tuple[List[int], np.ndarray]:
    """An edge from its lower node to its higher one; a loop in the direction that comes first in order."""
    third = len(line) // 3
    if ends[0] > ends[1] or ends[0] == ends[1] and _order(line[third]) > _order(line[-1 - third]):
        return ends[::-1], line[::-1]
    return ends, line


def _order(point: np.ndarray) -> Tuple[float, float]:
    """Sorts by x, then y, to a hundredth of a cell: versions of the mesh library round differently."""
    return round(float(point[0]), 2), round(float(point[1]), 2)


def _smooth(line: np.ndarray) -> np.ndarray:
    """A line (n, 2) without the steps of the cells: equidistant points, moved by a cell at most; the ends stay."""
    along = polyline.distances_along(line)
    count = max(int(np.ceil(along[-1] / POINT_CELLS)), 1)
    at = np.linspace(0.0, along[-1], count + 1)
    even = np.column_stack([np.interp(at, along, line[:, axis]) for axis in (0, 1)])
    reach = min(int(4.0 * TRACE_CELLS / POINT_CELLS), count)
    before, after = 2.0 * even[0] - even[reach:0:-1], 2.0 * even[-1] - even[-2 : -2 - reach : -1]  # ends stay in place
    padded = np.concatenate([before, even, after])
    smooth = ndimage.gaussian_filter1d(padded, TRACE_CELLS / POINT_CELLS, axis=0, mode="nearest")
    move = smooth[reach : reach + count + 1] - even
    return even + move / np.maximum(np.hypot(*move.T), 1.0)[:, None]
