"""Poses from bearings: right ones, wrong ones, and the document's experiment."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from made_bearings import FIELD, VIEWERS, directions, seen

from glass_nav.geometry import angles, se2
from glass_nav.localization.bearings import triangulation
from glass_nav.localization.bearings.triangulation import TriangulationError, TriangulationLimits
from glass_nav.sensing import bearings
from glass_nav.sensing.bearings import LandmarkBearing, OdometryDrift
from glass_nav.world import landmark_map
from glass_nav.world.landmark_map import LandmarkMap, UnknownLandmark

ROOM = landmark_map.seen_from_all_sides(
    "abcdef", np.array([[0.2, 3.0], [5.0, 0.1], [9.9, 2.0], [9.0, 7.9], [4.0, 7.8], [0.3, 6.5]]), 15.0
)
NO_DRIFT = OdometryDrift(0.0, 0.0, 0.0)


def off_m(pose: np.ndarray, true: np.ndarray) -> float:
    return float(np.hypot(*(pose - true)[:2]))


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("count", [3, 4, 6])
def test_exact_bearings_give_the_pose_of_the_base_wherever_the_sensor_sits(seed, count):
    rng = np.random.default_rng(seed)
    pose = np.array([rng.uniform(2.0, 8.0), rng.uniform(2.0, 6.0), rng.uniform(-np.pi, np.pi)])
    exact = seen(ROOM, pose, ids=rng.permutation(list(ROOM.ids))[:count].tolist(), base_from_sensor=(0.3, -0.1, 2.0))
    fix = triangulation.triangulate(exact, ROOM)
    assert off_m(fix.map_from_base, pose) < 1e-9
    assert abs(angles.wrap(fix.map_from_base[2] - pose[2])) < 1e-9
    assert fix.used_ids == exact.ids and not fix.excluded_ids
    average = triangulation.average(exact, ROOM)
    assert off_m(average.map_from_base, pose) < 1e-9


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("count", [3, 5])
def test_a_robot_that_drives_while_the_sensor_turns_is_where_its_odometry_and_the_bearings_agree(seed, count):
    rng = np.random.default_rng(seed)
    way = np.cumsum(rng.uniform(-0.5, 0.5, (count, 3)), axis=0)
    poses = se2.compose(np.array([4.0, 4.0, rng.uniform(-np.pi, np.pi)]), way)
    base_from_sensor = np.array([0.2, 0.1, -0.4])
    odom_from_base = se2.compose(np.array([50.0, -20.0, 1.0]), poses)
    single = [
        LandmarkBearing(number, name, float(directions(ROOM, se2.compose(pose, base_from_sensor))[number]), 1e-6)
        for number, (name, pose) in enumerate(zip(ROOM.ids, poses))
    ]
    taken = bearings.collected(single, odom_from_base, base_from_sensor, NO_DRIFT)
    fix = triangulation.triangulate(taken, ROOM, TriangulationLimits(max_position_sigma_m=1e9))
    assert off_m(fix.map_from_base, poses[-1]) < 1e-8
    still = bearings.standing(taken.ids, taken.angles_rad, 0.01, base_from_sensor=base_from_sensor)
    poses_still = triangulation.triples(still, ROOM).map_from_base
    assert min(off_m(pose, poses[-1]) for pose in poses_still) > 1e-3  # the way was not left out for nothing


def test_the_heading_is_right_across_the_half_turn():
    for yaw in (np.pi - 1e-3, -np.pi + 1e-3):
        pose = np.array([0.0, 0.0, yaw])
        for method in (triangulation.triangulate, triangulation.average):
            assert abs(angles.wrap(method(seen(FIELD, pose), FIELD).map_from_base[2] - yaw)) < 1e-9


def test_least_squares_is_at_the_minimum_of_the_squared_residuals():
    """By definition: no pose nearby explains the bearings better."""
    rng = np.random.default_rng(3)
    noisy = seen(ROOM, np.array([4.0, 3.0, 1.0]), 0.01, rng)
    fix = triangulation.triangulate(noisy, ROOM)

    def cost(pose):
        return float((angles.wrap(noisy.angles_rad - directions(ROOM, pose)) ** 2).sum())

    for step in itertools.product((-1e-4, 0.0, 1e-4), repeat=3):
        assert cost(fix.map_from_base) <= cost(fix.map_from_base + step) + 1e-15
    np.testing.assert_allclose(
        fix.residuals_rad, angles.wrap(noisy.angles_rad - directions(ROOM, fix.map_from_base)), atol=1e-12
    )


@pytest.mark.long_run
def test_the_covariance_of_the_average_is_that_of_drawn_bearings():
    rng, sigma_rad = np.random.default_rng(8), np.radians(0.2)
    told = triangulation.average(seen(FIELD, VIEWERS[0], sigma_rad), FIELD).covariance
    drawn = np.array(
        [triangulation.average(seen(FIELD, VIEWERS[0], sigma_rad, rng), FIELD).map_from_base for _ in range(1500)]
    )
    np.testing.assert_allclose(drawn.std(axis=0), np.sqrt(np.diag(told)), rtol=0.1)


@pytest.mark.long_run
def test_the_average_over_triples_beats_the_worst_of_them():
    """The document's Figure 7: four landmarks, angles read in steps of 1 degree, four viewers."""
    rng = np.random.default_rng(7)
    better, errors_m = 0, []
    for draw in range(1000):
        viewer = np.append(VIEWERS[draw % 4, :2], rng.uniform(-np.pi, np.pi))
        exact = directions(FIELD, viewer)
        read = bearings.standing(FIELD.ids, np.radians(np.round(np.degrees(exact))), np.radians(1.0) / np.sqrt(12.0))
        found = triangulation.triples(read, FIELD)
        assert found.usable.all()
        by_triple = np.hypot(*(found.map_from_base - viewer)[:, :2].T)
        average = triangulation.average(read, FIELD, TriangulationLimits(max_position_sigma_m=2.0)).map_from_base
        better += off_m(average, viewer) < by_triple.max()
        errors_m.append(by_triple)
    assert better >= 950
    largest = np.max(errors_m, axis=0)
    assert (largest > 0.18).all() and (largest < 0.7).all(), largest  # A,B,C; A,B,D; A,C,D; B,C,D; document, once: 0.18


@pytest.mark.parametrize("count", [0, 1, 2])
def test_fewer_than_three_landmarks_are_refused(count):
    few = seen(FIELD, VIEWERS[0], ids=FIELD.ids[:count])
    names = ", ".join(FIELD.ids[:count]) or "-"
    for method in (triangulation.triangulate, triangulation.triples, triangulation.average):
        with pytest.raises(TriangulationError, match=f"^three landmarks are needed, {count} seen: {names}$"):
            method(few, FIELD)


def test_an_unknown_landmark_is_refused_with_the_nearest_name():
    read = bearings.standing(["A1", "B", "C"], np.zeros(3), 0.01)
    named = landmark_map.seen_from_all_sides(["A11", "B", "C"], FIELD.positions_m[:3])
    with pytest.raises(UnknownLandmark) as caught:
        triangulation.triangulate(read, named)
    assert str(caught.value) == "landmark 'A1' is not on the map, which has A11, B, C; did you mean 'A11'?"


def test_on_the_circle_through_the_landmarks_a_fix_is_refused():
    circle = landmark_map.seen_from_all_sides("ABC", np.array([[5.0, 0.0], [0.0, 5.0], [-5.0, 0.0]]))
    pose = np.array([5.0 * np.cos(-1.0), 5.0 * np.sin(-1.0), 0.4])
    for method in (triangulation.triangulate, triangulation.average):
        with pytest.raises(TriangulationError) as caught:
            method(seen(circle, pose, np.radians(0.3)), circle)
        assert str(caught.value).startswith("the robot may be anywhere along the circle through A, B and C (centre x ")
        assert str(caught.value).endswith("radius 5.00 m): it is 0.0 standard deviations off it")


def test_near_the_circle_more_landmarks_help_if_they_are_elsewhere():
    circle = np.array([[5.0, 0.0], [0.0, 5.0], [-5.0, 0.0], [3.0, 4.0]])
    pose = np.array([5.0 * np.cos(-1.0), 5.0 * np.sin(-1.0), 0.4])
    on_it = landmark_map.seen_from_all_sides("ABCD", circle)
    with pytest.raises(TriangulationError, match="off it, and no other three landmarks do better$"):
        triangulation.triangulate(seen(on_it, pose, np.radians(0.3)), on_it)
    beside = landmark_map.seen_from_all_sides("ABCD", np.vstack([circle[:3], [[9.0, 3.0]]]))
    fix = triangulation.triangulate(seen(beside, pose, np.radians(0.3)), beside)
    assert off_m(fix.map_from_base, pose) < 1e-9


def test_in_line_with_all_landmarks_a_fix_is_refused():
    line = landmark_map.seen_from_all_sides("ABC", np.array([[0.0, 0.0], [2.0, 0.0], [5.0, 0.0]]))
    with pytest.raises(TriangulationError, match="^the robot may be anywhere along the line through A, B and C: it "):
        triangulation.triangulate(seen(line, np.array([3.0, 0.0, 1.0]), 0.005), line)
    beside = np.array([1.0, 3.0, -2.0])
    assert off_m(triangulation.triangulate(seen(line, beside, 0.005), line).map_from_base, beside) < 1e-9


def test_a_far_robot_is_refused_for_its_uncertainty():
    near = landmark_map.seen_from_all_sides("ABCD", FIELD.positions_m)
    far = seen(near, np.array([3.0, -40.0, 0.0]), np.radians(0.3))
    for method in (triangulation.triangulate, triangulation.average):
        with pytest.raises(
            TriangulationError,
            match=r"too unsure: sigma \d+\.\d\d m, allowed 0.5 m; the landmarks A, "
            "B, C and D are far away",
        ):
            method(far, near, TriangulationLimits(min_off_circle_sigmas=1e-6))


def test_three_directions_that_no_place_sees_are_refused():
    wrong = seen(FIELD, VIEWERS[0], 0.005, ids="ABC")
    wrong.angles_rad[1] += np.pi
    with pytest.raises(
        TriangulationError, match="^no place sees A, B and C in these directions: one of them is wrong$"
    ):
        triangulation.triangulate(wrong, FIELD)


def test_a_place_from_which_a_landmark_cannot_be_seen_is_refused():
    facing = LandmarkMap(
        FIELD.ids, FIELD.positions_m, np.radians([0.0, 90.0, -90.0, 180.0]), np.full(4, np.pi / 2.0), np.full(4, 15.0)
    )  # B looks away from the field
    place = np.array([0.001, 4.0, 1.0])
    with pytest.raises(TriangulationError) as caught:
        triangulation.triangulate(seen(facing, place, 0.003, ids="ABC"), facing)
    assert str(caught.value) == (
        "the bearings of A, B and C lead to x 0.00 m, y 4.00 m, from where B cannot be seen: "
        "it would be 5.0 m away and 143 degrees off its direction"
    )
    fix = triangulation.triangulate(seen(facing, place, 0.003), facing)  # of four, it is the wrong one
    assert fix.excluded_ids == ("B",)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("count", [5, 6])
def test_of_five_or_more_one_wrong_bearing_is_found(seed, count):
    rng = np.random.default_rng(seed)
    sigma_rad = np.radians(0.3)
    found = 0
    for draw in range(20):
        wrong, pose = draw % count, np.array([rng.uniform(3.0, 7.0), rng.uniform(2.0, 6.0), rng.uniform(-np.pi, np.pi)])
        read = seen(ROOM, pose, sigma_rad, rng, ids=ROOM.ids[:count])
        read.angles_rad[wrong] += rng.choice([-1.0, 1.0]) * rng.uniform(0.3, np.pi)
        try:
            fix = triangulation.triangulate(read, ROOM)
        except TriangulationError as err:
            assert "it cannot be told" in str(err) and f"{ROOM.ids[wrong]}" in str(err).partition("wrong: ")[2]
            continue
        assert off_m(fix.map_from_base, pose) < 5.0 * np.sqrt(np.trace(fix.covariance[:2, :2]))
        found += fix.excluded_ids == (ROOM.ids[wrong],)
    assert found >= 18


@pytest.mark.long_run
def test_of_four_bearings_a_wrong_one_is_found_or_refused():
    """With one bearing to spare geometry alone cannot tell which one it is.

    It leads astray only where all four fit another place that sees them all: no evidence is left then. That happens to
    a robot near the circle of the three right ones.
    """
    rng = np.random.default_rng(11)
    facing = LandmarkMap(
        FIELD.ids,
        FIELD.positions_m,
        np.radians([-45.0, -90.0, -90.0, -135.0]),
        np.full(4, np.pi / 2.0),
        np.full(4, 15.0),
    )
    outcome = {"found": 0, "refused": 0, "astray": 0}
    for _ in range(300):
        pose = np.array([rng.uniform(-2.0, 2.0), rng.uniform(-2.0, 3.0), rng.uniform(-np.pi, np.pi)])
        read = seen(facing, pose, np.radians(0.3), rng)
        wrong = rng.integers(4)
        read.angles_rad[wrong] += rng.choice([-1.0, 1.0]) * rng.uniform(0.5, np.pi)
        try:
            fix = triangulation.triangulate(read, facing)
        except TriangulationError:
            outcome["refused"] += 1
            continue
        sigma_m = np.sqrt(np.linalg.eigvalsh(fix.covariance[:2, :2])[-1])
        astray = off_m(fix.map_from_base, pose) > 5.0 * sigma_m
        outcome["astray" if astray else "found"] += 1
        assert fix.excluded_ids == (() if astray else (facing.ids[wrong],))
        if astray:
            right = triangulation.triples(read.subset(np.arange(4) != wrong), facing)
            assert right.off_circle[0] < 10.0
    assert outcome["found"] > 100 and outcome["astray"] < 9, outcome


def test_what_cannot_be_told_is_refused_with_the_suspects():
    read = seen(FIELD, np.array([0.0, 2.0, 0.0]), np.radians(0.3))
    read.angles_rad[2] += np.radians(8.0)
    with pytest.raises(TriangulationError) as caught:
        triangulation.triangulate(read, FIELD)
    assert str(caught.value) == (
        "the bearings of A, B, C and D contradict each other, and it cannot be told which one is wrong: A, B, C or D"
    )


def test_two_wrong_bearings_of_five_are_refused():
    read = seen(ROOM, np.array([4.0, 4.0, 0.0]), np.radians(0.3), ids="abcde")
    read.angles_rad[0] += 0.5
    read.angles_rad[3] -= 0.7
    with pytest.raises(TriangulationError, match="contradict each other, and leaving one of them out does not help$"):
        triangulation.triangulate(read, ROOM)


def test_a_wrong_bearing_is_not_blamed_on_a_fit_that_is_too_unsure():
    four = landmark_map.seen_from_all_sides("abcd", ROOM.positions_m[:4])
    facing = LandmarkMap(
        four.ids, four.positions_m, np.radians([0.0, 90.0, 180.0, -90.0]), np.full(4, np.pi / 2.0), np.full(4, 15.0)
    )
    read = seen(facing, np.array([5.0, 4.0, 0.0]), np.radians(0.3))
    read.angles_rad[3] += 2.0
    with pytest.raises(TriangulationError, match="contradict each other; without d, the position .* is too unsure"):
        triangulation.triangulate(read, facing, TriangulationLimits(max_position_sigma_m=0.001))


@pytest.mark.parametrize(
    "name, value, text",
    [
        ("min_off_circle_sigmas", 0.0, "~min_off_circle_sigmas must be > 0, got 0.0"),
        ("max_position_sigma_m", -1.0, "~max_position_sigma_m must be > 0, got -1.0"),
        ("max_misfit_chance", 1.0, "~max_misfit_chance must be > 0 and < 1, got 1.0"),
    ],
)
def test_limits_that_mean_nothing_are_refused(name, value, text):
    with pytest.raises(ValueError) as caught:
        TriangulationLimits(**{name: value})
    assert str(caught.value) == text


@pytest.mark.parametrize("seed", range(3))
def test_a_fix_that_is_carried_along_is_as_unsure_as_drawn_poses_moved_by_drawn_odometry(seed):
    rng = np.random.default_rng(seed)
    fix = triangulation.triangulate(seen(FIELD, VIEWERS[seed], np.radians(0.3)), FIELD)
    step, drift = np.array([2.0, 0.5, 1.0]), OdometryDrift(0.05, 0.01, 0.03)
    later = triangulation.carried_along(fix, 77, step, drift)
    np.testing.assert_allclose(later.map_from_base, se2.compose(fix.map_from_base, step))
    assert (later.stamp_ns, later.used_ids) == (77, fix.used_ids)
    way_m = float(np.hypot(*step[:2]))
    noise = rng.normal(0.0, 1.0, (4000, 3)) * [0.05 * way_m, 0.05 * way_m, 0.01 * way_m + 0.03 * step[2]]
    poses = rng.multivariate_normal(fix.map_from_base, fix.covariance, 4000)
    moved = se2.compose(poses, step + noise)
    off = moved - later.map_from_base
    off[:, 2] = angles.wrap(off[:, 2])
    np.testing.assert_allclose(np.sqrt((off**2).mean(axis=0)), np.sqrt(np.diag(later.covariance)), rtol=0.06)
