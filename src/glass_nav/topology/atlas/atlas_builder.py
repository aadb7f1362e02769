"""Builds an atlas from a map: its generalized Voronoi graph, measured as a robot would.

Seed document: global_localization_procedure.txt, "Uniqueness in the Hierarchical Atlas". The standard deviations say
how far the building may differ from its map: a node may be off by about a cell, by the spread of the meetpoints that
were merged into it, and by the doubt about its obstacles.
"""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass
from typing import Callable, ContextManager, Iterator, List, Tuple

import numpy as np

from glass_nav.geometry import polyline, segments
from glass_nav.topology.atlas import voronoi_graph
from glass_nav.topology.atlas.atlas import (
    BEARING_AT_M,
    DEAD_END,
    MEETPOINT,
    RING_MARKER,
    Atlas,
    AtlasError,
    Darts,
    Edges,
    MapReference,
    Nodes,
    Ragged,
    Visits,
    rings_clockwise,
)
from glass_nav.topology.atlas.edge_views import EdgeViews, ViewParams
from glass_nav.topology.atlas.voronoi.graph import VoronoiGraph
from glass_nav.topology.atlas.voronoi_graph import VoronoiParams
from glass_nav.world.free_space import FreeSpace
from glass_nav.world.grid_map import GridMap

R_SIGMA_CELLS = 1.0  # measured on rough walls: up to 0.9 less than on smooth ones
POSITION_SIGMA_CELLS = 1.0  # of a meetpoint
DEAD_END_SIGMA_SHARE = 0.1  # of r: where an edge ends depends on the corners there
LINE_TOLERANCE_M = 0.02  # of the line of an edge in the file


@dataclass(frozen=True)
class BuildParams:
    """How an atlas is made."""

    graph: VoronoiParams = VoronoiParams()
    view: ViewParams = ViewParams()


Watch = Callable[
    [str, int], ContextManager[Callable[[], None]]
]  # what is done, number of steps -> to be called after each step


@contextmanager
def unwatched(what: str, steps: int) -> Iterator[Callable[[], None]]:
    """Ignores progress."""
    yield lambda: None


def build(
    grid_map: GridMap, name: str, map_name: str, params: BuildParams = BuildParams(), watch: Watch = unwatched
) -> Tuple[Atlas, VoronoiGraph]:
    """The atlas of a map, and the graph that it was measured on.

    Args:
        grid_map: any occupancy grid; glass is occupied.
        name: of the atlas.
        map_name: what the map is called there.
        params: of the graph and of the lidar.
        watch: follows the progress.

    Raises:
        AtlasError: no free space in the map is wide and long enough for a robot.
    """
    with watch("graph", voronoi_graph.STEPS) as step:
        graph = voronoi_graph.build(grid_map, params.graph, step)
    if not graph.lines_m:
        raise AtlasError(
            f"no path of {params.graph.smallest_component_m:g} m in this map for a robot of "
            f"{params.graph.robot_radius_m:g} m radius"
        )
    with watch("segment maps", len(graph.lines_m) + 1) as step:
        views = EdgeViews(grid_map, params.view)
        step()
        seen: List[np.ndarray] = []
        for line in graph.lines_m:
            seen += views.of(line)
            step()
    return _atlas(graph, Ragged.of(seen, 4), grid_map, name, map_name), graph


def _atlas(graph: VoronoiGraph, seen: Ragged, grid_map: GridMap, name: str, map_name: str) -> Atlas:
    degree = graph.degree
    kind = np.select([degree == 1, degree == 2], [DEAD_END, RING_MARKER], MEETPOINT).astype(np.int8)
    cell_m = grid_map.resolution_m
    sigma_r_m = np.sqrt((R_SIGMA_CELLS * cell_m) ** 2 + graph.spread_m**2 + graph.doubt_m**2)
    sigma_at_m = np.sqrt(
        (POSITION_SIGMA_CELLS * cell_m) ** 2
        + graph.spread_m**2
        + graph.doubt_m**2
        + np.where(kind == DEAD_END, DEAD_END_SIGMA_SHARE * graph.r_m, 0.0) ** 2
    )
    length_m = np.array([polyline.length(line) for line in graph.lines_m])
    chord_m = np.array([np.hypot(*(line[-1] - line[0])) for line in graph.lines_m])
    edges = Edges(
        length_m,
        chord_m,
        np.sqrt((sigma_at_m[graph.edge_node] ** 2).sum(axis=1)),
        np.array([clearance.min() for clearance in graph.line_clearance_m]),
        Ragged.of([line[segments.corners(line, LINE_TOLERANCE_M)] for line in graph.lines_m], 2),
    )
    bearing = np.array([bearings(line) for line in graph.lines_m]).ravel()
    node = graph.edge_node.ravel().astype(np.int64)
    return Atlas(
        name,
        MapReference(map_name, grid_map.fingerprint, FreeSpace.of(grid_map)),
        Nodes(graph.position_m, graph.r_m, sigma_r_m, kind),
        edges,
        Darts(node, bearing, seen),
        rings_clockwise(node, bearing, len(degree)),
        Visits.none(len(degree), len(edges)),
    )


def bearings(line_m: np.ndarray) -> Tuple[float, float]:
    """Directions in which the two darts of a line (n, 2) leave, as the atlas defines them."""
    return _bearing(line_m), _bearing(line_m[::-1])


def _bearing(line_m: np.ndarray) -> float:
    along = polyline.distances_along(line_m)
    x, y = (np.interp(BEARING_AT_M, along, line_m[:, axis]) - line_m[0, axis] for axis in (0, 1))
    return float(np.arctan2(y, x))
