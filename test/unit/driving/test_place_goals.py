"""Which goals in the map become tasks, and why others do not."""

from __future__ import annotations

import math

import numpy as np
import pytest
from made_buildings import t_corridor

from glass_nav.driving.driver_params import DriveParams
from glass_nav.driving.edge_tracking.edge_driver import EdgeDriver
from glass_nav.driving.place_goals import PlaceGoal, PlaceTasks
from glass_nav.driving.tasks import GoTask, Moment
from glass_nav.simulation import building_map
from glass_nav.simulation.building import Building
from glass_nav.topology.atlas import atlas_builder
from glass_nav.topology.atlas.atlas import AtlasError

POSE = np.array([2.0, 1.0, 0.5])
IN_MAP = PlaceGoal(-1, POSE, "map")


@pytest.fixture(scope="module")
def grid_map():
    building = t_corridor()
    paths = {"all": np.array([[1.0, 1.0], [11.0, 1.0], [6.0, 1.0], [6.0, -4.0]])}
    return building_map.draw(Building(building.walls, paths=paths, start=np.array([2.0, 1.0, 0.0]), name="t"))


@pytest.fixture(scope="module")
def atlas(grid_map):
    return atlas_builder.build(grid_map, "t", "t")[0]


def tasks_of(atlas, backend=None):
    return PlaceTasks(DriveParams(), EdgeDriver(), "map", atlas, backend)


@pytest.mark.parametrize("goal", [PlaceGoal(0), IN_MAP], ids=["node", "pose"])
def test_a_place_is_driven_to_along_edges(atlas, grid_map, goal):
    places = tasks_of(atlas)
    places.map_served(grid_map, "that of topic /map")
    task = places.task(goal, None)
    assert isinstance(task, GoTask)
    task.step(Moment(np.zeros(3), np.array([6.0, 1.0, 0.0]), np.zeros(3), 0.05))
    end_m = atlas.nodes.position_m[0] if goal.node == 0 else POSE[:2]
    np.testing.assert_allclose(task.route.polyline_m[-1], end_m, atol=0.01)


def test_a_backend_is_given_a_pose_with_a_heading_in_any_case(atlas):
    places = tasks_of(atlas, backend=lambda pose: pose)
    at_node = atlas.nodes.position_m[1]
    np.testing.assert_allclose(places.task(IN_MAP, None), POSE)
    np.testing.assert_allclose(places.task(PlaceGoal(1), None), [*at_node, 0.0])
    np.testing.assert_allclose(places.task(PlaceGoal(1), np.array([1.0, 1.0, 2.0])), [*at_node, 2.0])
    headed = PlaceGoal(1, POSE, "", with_heading=True)
    np.testing.assert_allclose(places.task(headed, np.array([1.0, 1.0, 2.0])), [*at_node, 0.5])


def test_a_backend_drives_to_poses_without_an_atlas():
    np.testing.assert_allclose(tasks_of(None, backend=lambda pose: pose).task(IN_MAP, None), POSE)


@pytest.mark.parametrize(
    "goal, has_atlas, text",
    [
        (PlaceGoal(-1, POSE, "odom"), True, "the pose must be given in frame 'map', got 'odom'"),
        (PlaceGoal(-1, None, "map", False, "no rotation"), True, "no rotation"),
        (PlaceGoal(0, None, "", True, "no rotation"), True, "no rotation"),
        (PlaceGoal(99), True, "node 99: the atlas t has nodes 0 to 3"),
        (PlaceGoal(0), False, "a goal by node needs an atlas: ~atlas is ''"),
        (IN_MAP, False, "routes to goals follow an atlas: ~atlas is ''"),
    ],
)
def test_what_cannot_be_a_goal_is_refused_in_a_sentence(atlas, goal, has_atlas, text):
    with pytest.raises(ValueError) as caught:
        tasks_of(atlas if has_atlas else None).task(goal, None)
    assert str(caught.value) == text


def test_goals_are_refused_while_another_map_is_served(atlas, grid_map):
    places = tasks_of(atlas)
    other = building_map.draw(Building(t_corridor().walls[:0], start=np.zeros(3), paths={"p": np.eye(2)}, name="other"))
    with pytest.raises(AtlasError, match="^goto_node cannot be used: the atlas "):
        places.map_served(other, "that of topic /map")
    with pytest.raises(ValueError, match="^the atlas .*that of topic /map"):
        places.task(PlaceGoal(0), None)
    places.map_served(grid_map, "that of topic /map")
    assert math.isnan(places.task(PlaceGoal(0), None).remaining_m)
    tasks_of(None).map_served(other, "")  # nothing to compare it with
