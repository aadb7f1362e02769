from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from glass_nav.simulation import path_follower
from glass_nav.simulation.building import Building, Wall
from glass_nav.simulation.path_follower import PathError, PathFollower, PathFollowerParams
from glass_nav.simulation.robot import KINDS, Obstacles, Robot, RobotParams

NOTHING = Obstacles(np.zeros((0, 2, 2)))
PATHS = {
    "straight": [[0, 0], [6, 0]],
    "corner": [[0, 0], [4, 0], [4, 3]],
    "there and back": [[0, 0], [4, 0], [0, 0]],
    "crossing itself": [[0, 0], [6, 0], [6, 3], [3, 3], [3, -3]],
    "short pieces": [[0.1 * index, 0.3 * math.sin(0.1 * index)] for index in range(60)],
    "shorter than the look-ahead": [[1, 1], [1.1, 1.2]],
}
CONTROL_S = 0.02


def followed(waypoints, kind, p=PathFollowerParams(), robot_pose=None, limit_s=120.0):
    """Poses of a robot that follows, until it stands at the end."""
    robot_params = RobotParams(kind)
    follower = PathFollower(np.array(waypoints, float), robot_params, p)
    robot = Robot(robot_params, follower.start if robot_pose is None else robot_pose, NOTHING)
    poses, velocities = [robot.map_from_base], [robot.velocity]
    for _ in range(round(limit_s / CONTROL_S)):
        robot.step(follower.command(robot.map_from_base), CONTROL_S)
        poses.append(robot.map_from_base)
        velocities.append(robot.velocity)
        if follower.done and robot.standing:
            return np.array(poses), np.array(velocities), follower
    raise AssertionError(f"not at the end after {limit_s} s: {follower.progress_m} of {follower.length_m} m")


def off_path(points, waypoints):
    """(N,) distance of each point from the polyline."""
    waypoints = np.array(waypoints, float)
    start, along = waypoints[:-1], np.diff(waypoints, axis=0)
    offset = points[:, None] - start
    share = np.clip((offset * along).sum(-1) / (along**2).sum(-1), 0, 1)
    return np.linalg.norm(offset - share[..., None] * along, axis=-1).min(axis=1)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", PATHS)
def test_a_path_is_followed_to_its_end(name, kind):
    poses, velocities, follower = followed(PATHS[name], kind)
    assert np.hypot(*(poses[-1, :2] - PATHS[name][-1])) < 0.1
    assert off_path(poses[:, :2], PATHS[name]).max() < 0.2
    pieces_m = np.linalg.norm(np.diff(np.array(PATHS[name], float), axis=0), axis=1)
    assert follower.length_m == pytest.approx(pieces_m.sum())
    acceleration = np.diff(velocities, axis=0) / CONTROL_S  # smooth: what the base can do
    assert np.abs(acceleration[:, 0]).max() < 0.8 + 1e-9


def test_the_whole_way_is_gone_where_a_path_crosses_itself_or_turns_back():
    for name in ("crossing itself", "there and back"):
        poses, _, follower = followed(PATHS[name], "diff")
        way_m = np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1).sum()
        assert 0.85 * follower.length_m < way_m < 1.1 * follower.length_m


def test_the_speed_is_that_asked_for_within_what_the_base_can():
    for asked, top in ((0.3, 0.3), (5.0, 1.0)):
        _, velocities, _ = followed(PATHS["straight"], "diff", PathFollowerParams(speed_m_s=asked))
        assert velocities[:, 0].max() == pytest.approx(top)


def test_an_omnidirectional_base_slides_and_two_wheels_do_not():
    assert np.abs(followed(PATHS["corner"], "omni")[1][:, 1]).max() > 0.1
    assert np.abs(followed(PATHS["corner"], "diff")[1][:, 1]).max() == 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_a_robot_that_looks_the_wrong_way_finds_the_path(kind):
    poses, _, _ = followed(PATHS["straight"], kind, robot_pose=np.array([0.0, 0.2, math.pi]))
    assert np.hypot(*(poses[-1, :2] - [6, 0])) < 0.1


def test_the_start_looks_along_the_path():
    follower = PathFollower(np.array([[1.0, 2.0], [1.0, 2.0], [1.0, 3.0]]), RobotParams())
    np.testing.assert_allclose(follower.start, [1.0, 2.0, math.pi / 2])


@pytest.mark.parametrize(
    "waypoints, text",
    [
        ([[1.0, 1.0]], "a path needs 2 different waypoints, got 1"),
        ([[1.0, 1.0], [1.0, 1.0]], "a path needs 2 different waypoints, got 1"),
        (np.zeros((0, 2)), "a path needs 2 different waypoints, got 0"),
        ([[1.0, 1.0], [math.nan, 1.0]], "waypoint 2 of the path is not finite: [nan, 1.0]"),
        ([1.0, 2.0], "a path needs waypoints (W, 2), got (2,)"),
    ],
)
def test_what_is_no_path_is_refused(waypoints, text):
    with pytest.raises(PathError) as caught:
        PathFollower(np.array(waypoints), RobotParams())
    assert str(caught.value) == text


def test_a_speed_of_nothing_is_refused():
    with pytest.raises(ValueError) as caught:
        PathFollowerParams(speed_m_s=0.0)
    assert str(caught.value) == "speed_m_s of the path follower must be > 0 m/s and finite, got 0.0"


@pytest.mark.parametrize(
    "name, text",
    [
        ("p.csv", "0,1\n2.5,3\n"),
        ("p.txt", "# x y\n0 1\n\n2.5 3  # the door\n"),
        ("p.yaml", "- [0, 1]\n- [2.5, 3]\n"),
        ("p.yml", "[[0, 1], [0, 1], [2.5, 3]]"),
    ],
)
def test_a_file_of_waypoints(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    np.testing.assert_array_equal(path_follower.load(tmp_path / name), [[0.0, 1.0], [2.5, 3.0]])


def test_a_path_is_found_by_name_by_order_and_as_a_file(tmp_path):
    building = Building(
        (Wall(np.array([[0.0, 9.0], [9.0, 9.0]])),),
        name="hall",
        paths={"round": np.array([[0.0, 0.0], [1.0, 0.0]]), "a.b": np.array([[0.0, 0.0], [2.0, 0.0]])},
    )
    (tmp_path / "way").write_text("0 0\n3 0\n")
    for wanted, end in (("round", 1.0), ("first", 1.0), ("a.b", 2.0), (str(tmp_path / "way"), 3.0)):
        np.testing.assert_array_equal(path_follower.find(wanted, building), [[0.0, 0.0], [end, 0.0]])
    named_first = replace(building, paths={"other": building.paths["round"], "first": building.paths["a.b"]})
    assert path_follower.find("first", named_first)[1, 0] == 2.0
    for wanted, text in (
        ("rond", "hall: no path 'rond', it has round, a.b; did you mean round?"),
        ("x", "hall: no path 'x', it has round, a.b"),
        ("no.csv", "no.csv: cannot be read: No such file or directory"),
    ):
        with pytest.raises(PathError) as caught:
            path_follower.find(wanted, building)
        assert str(caught.value) == text
    for wanted, text in (
        ("first", "hall: has no path; give a file of waypoints"),
        ("x", "hall: no path 'x', it has none"),
    ):
        with pytest.raises(PathError) as caught:
            path_follower.find(wanted, replace(building, paths={}))
        assert str(caught.value) == text


def test_the_way_back_is_the_same_path():
    follower = PathFollower(np.array(PATHS["corner"], float), RobotParams(), PathFollowerParams(speed_m_s=0.2)).back()
    np.testing.assert_allclose(follower.start, [4.0, 3.0, -math.pi / 2])
    assert follower.length_m == 7.0
    assert np.abs(follower.command(follower.start)).max() == pytest.approx(0.2)


@pytest.mark.parametrize(
    "name, text, reason",
    [
        ("p.csv", "", "a path needs 2 different waypoints, got 0"),
        ("p.csv", "0,1\n2\n", "waypoint 2 must be x and y in m, got ['2']"),
        ("p.csv", "x,y\n0,1\n2,1\n", "waypoint 1 must be x and y in m, got ['x', 'y']"),
        ("p.csv", "0,1\n2,inf\n", "waypoint 2 of the path is not finite: [2.0, inf]"),
        ("p.yaml", "path: 1\n", "must be a list of waypoints [x, y] in m, got dict"),
        ("p.yaml", "[[0, 1], 7]", "waypoint 2 must be x and y in m, got 7"),
        ("p.yaml", "[[0, 1", "is not yaml: "),
    ],
)
def test_a_file_that_holds_no_path_is_refused(tmp_path, name, text, reason):
    (tmp_path / name).write_text(text)
    with pytest.raises(PathError) as caught:
        path_follower.load(tmp_path / name)
    assert str(caught.value).startswith(f"{tmp_path / name}: {reason}")
    assert "\n" not in str(caught.value)


def test_a_file_that_cannot_be_read_is_reported(tmp_path):
    with pytest.raises(PathError, match="no.csv: cannot be read: No such file or directory$"):
        path_follower.load(tmp_path / "no.csv")
    (tmp_path / "p.csv").write_bytes(b"\xff\xfe")
    with pytest.raises(PathError, match="p.csv: cannot be read: 'utf-8'"):
        path_follower.load(tmp_path / "p.csv")
