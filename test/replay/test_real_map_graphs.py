"""The graph of real maps: in one piece wherever the free space is, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from glass_nav.topology.atlas import voronoi_graph
from glass_nav.topology.atlas.voronoi.ridges import SEPARATION_CELLS
from glass_nav.topology.atlas.voronoi_graph import VoronoiParams
from glass_nav.world import map_file

MAPS = (
    "ac109_1",
    "ac109_3",
    "depot",
    "freihaus_eg/map",
    "gdc/1/1",
    "gdc/3/3",
    "gdc/4/4",
    "intel",
    "stata_basement",
    "ubremen-cartesium",
    "warehouse",
    "willow-full-0.05",
)  # all but huge_map, which is willow's kind eight times
LARGE_M2 = 60.0  # where the robot's centre may be; of a square room without furniture only a point is left
RASTER_CELLS = 0.75  # by so much the middle of a passage may lie off the middles of cells


@pytest.fixture(params=MAPS)
def real_map(request, data_dir):
    return map_file.load(data_dir / "maps" / f"{request.param}.yaml")


def clearance_cells(grid_map):
    robot = VoronoiParams()
    return max((robot.robot_radius_m + robot.passage_margin_m) / grid_map.resolution_m, SEPARATION_CELLS / 2.0)


@pytest.mark.parametrize("smallest_obstacle_m", [0.0, VoronoiParams().smallest_obstacle_m])
def test_the_graph_has_one_part_for_each_part_of_the_free_space(real_map, smallest_obstacle_m):
    """Second implementation: labels of the cells further than the robot's radius from all that are not free."""
    graph = voronoi_graph.build(real_map, VoronoiParams(smallest_obstacle_m=smallest_obstacle_m))
    away = ndimage.distance_transform_edt(np.pad(real_map.free, 1))[1:-1, 1:-1]
    wide, narrow = (
        ndimage.label(away > clearance_cells(real_map) + more, np.ones((3, 3), bool))[0]
        for more in (RASTER_CELLS, -RASTER_CELLS)
    )
    _, part = graph.components()
    in_wide, in_narrow = {}, {}
    for (first, _), line in zip(graph.edge_node, graph.lines_m):
        cells = real_map.cells(line)
        for found, label in ((in_wide, wide), (in_narrow, narrow)):
            under = np.unique(label[cells])
            found.setdefault(int(part[first]), set()).update(under[under > 0].tolist())
    if smallest_obstacle_m == 0.0:
        assert real_map.is_free(np.concatenate([graph.position_m, *graph.lines_m])).all()
        nearest = np.concatenate(graph.line_clearance_m).min() / real_map.resolution_m
        assert nearest > clearance_cells(real_map) - 2.0  # lines are smoothed, and meetpoints made one
        assert all(len(labels) == 1 for labels in in_narrow.values()), "an edge leads where the robot cannot go"
    shared = [label for labels in in_wide.values() for label in labels]
    assert len(set(shared)) == len(shared), "the graph is broken"
    area_m2 = np.bincount(wide.ravel()) * real_map.resolution_m**2
    large = set((np.flatnonzero(area_m2[1:] >= LARGE_M2) + 1).tolist())
    assert large <= set(shared), "a part of the floor has no graph"
