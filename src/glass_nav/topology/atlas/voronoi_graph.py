"""The generalized Voronoi graph of the free space of a map: meetpoints, and the edges between them.

The graph is that of the cells that bound free space: Delaunay triangles of their centres, whose circumcentres are
equidistant from three of them, joined where two triangles share a side. Ridges between neighbouring cells of one wall
and what a robot of that radius cannot reach are left out, twigs are pruned, and meetpoints that no lidar can tell apart
are merged. The map of a building and the few metres around a robot are treated alike, so the atlas and the robot see
the same graph.

What is an obstacle:
- Occupied cells are walls, glass or not.
- Unknown cells cannot be driven through, so they bound the graph like walls. But no lidar sees that boundary: the real
  wall is somewhere beyond. So each node has the distance of its obstacles from the nearest wall (doubt_m): 0 at walls,
  some cells where a wall has gaps, up to r at the frontier of what is known.
- Things smaller than smallest_obstacle_m that the robot can pass on all sides make no meetpoints; they count in the
  clearance of an edge. Unknown specks of that size with no wall in them are free.

The stages are in voronoi/, a file each; coordinates inside are cells, x along columns, y along rows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable

import numpy as np

from glass_nav.topology.atlas.voronoi import bounds, graph, pruning, ridges
from glass_nav.topology.atlas.voronoi.graph import VoronoiGraph
from glass_nav.topology.atlas.voronoi.meetpoints import Meetpoints
from glass_nav.topology.atlas.voronoi.ridges import SEPARATION_CELLS
from glass_nav.world.grid_map import GridMap

STEPS = 5  # of build()


@dataclass(frozen=True)
class VoronoiParams:
    """Lengths in metres. The defaults are for a robot of 0.22 m radius with a lidar good to some centimetres."""

    robot_radius_m: float = 0.22  # narrower passages and what lies beyond them are not in the graph,
    passage_margin_m: float = 0.04  # nor those with less room than this on each side: no robot drives through them
    smallest_obstacle_m: float = 0.25  # free-standing things that measure less make no meetpoints
    leaf_m: float = 0.3  # a twig goes when length + r at its end - r at its junction is less than this,
    leaf_share_of_r: float = 0.6  # or less than this times r at its junction
    merge_m: float = 0.3  # meetpoints closer along their edge are one, and those where a robot at
    equidistance_m: float = 0.15  # either sees the obstacles of the other nearer than r and this
    smallest_component_m: float = 2.0  # a part of the graph with a smaller total length is left out

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (np.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} must be finite and >= 0, got {value}")
        if not self.robot_radius_m > 0.0:
            raise ValueError(f"robot_radius_m must be > 0 m, got {self.robot_radius_m}")


def build(
    grid_map: GridMap, params: VoronoiParams = VoronoiParams(), step: Callable[[], None] = lambda: None
) -> VoronoiGraph:
    """The graph of all free space that the robot can stand in; without any, a graph without nodes.

    Args:
        grid_map: any grid, large or small.
        params: of the robot and of its lidar.
        step: called STEPS times.
    """
    cell_m = grid_map.resolution_m
    clearance = max((params.robot_radius_m + params.passage_margin_m) / cell_m, SEPARATION_CELLS / 2.0)
    cells = bounds.of(grid_map, clearance, params.smallest_obstacle_m / cell_m)
    step()
    raw = ridges.of(cells, clearance)
    step()
    chains = pruning.Chains(raw)
    chains.prune(params.leaf_m / cell_m, params.leaf_share_of_r)
    step()
    meetpoints = Meetpoints(cells, raw, chains.kept())
    meetpoints.merge(params.merge_m / cell_m, params.equidistance_m / cell_m)
    left_out = meetpoints.drop_small(params.smallest_component_m / cell_m)
    step()
    result = graph.in_map(grid_map, cells, raw, meetpoints, left_out)
    step()
    return result
