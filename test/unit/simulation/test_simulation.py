from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from glass_nav.geometry import angles, se2
from glass_nav.simulation.building import Building, Pane, Thing, Wall, box
from glass_nav.simulation.lidar import PRESETS
from glass_nav.simulation.odometry import EXACT
from glass_nav.simulation.path_follower import PathError, PathFollowerParams
from glass_nav.simulation.robot import RobotParams
from glass_nav.simulation.simulation import CONTROL_S, START_NS, Simulation, SimulationError

LIDAR = replace(PRESETS["sensitive"], beams=91)
NOISELESS = replace(LIDAR, noise_m=0.0, dropout=0.0)
FORWARD = np.array([0.5, 0.0, 0.0])


def hall(**changes):
    """6 x 4 m with its lower left inner corner at (0, 0), a pane across the middle but for 1.4 m, furniture behind."""
    walls = (Wall(np.array([[-0.1, -0.1], [6.1, -0.1], [6.1, 4.1], [-0.1, 4.1], [-0.1, -0.1]], float)),)
    values = dict(
        walls=walls,
        panes=(Pane(np.array([[3.0, 1.4], [3.0, 4.0]])),),
        things=tuple(Thing(box(4.5, 2.2 + 0.5 * index, 0.3, 0.3), movable=True) for index in range(3)),
        paths={
            "round": np.array([[1.0, 1.0], [1.0, 3.0], [2.0, 3.0]]),
            "into the wall": np.array([[1.0, 1.0], [8.0, 1.0]]),
            "through the pane": np.array([[1.0, 3.0], [5.0, 3.0]]),
        },
        start=np.array([1.0, 1.0, 0.0]),
        name="hall",
    )
    values.update(changes)
    return Building(**values)


def simulation(model=LIDAR, **options):
    return Simulation(hall(), model, **options)


def as_bytes(frames):
    return [
        b"".join(
            [
                str(frame.stamp_ns).encode(),
                frame.map_from_base.tobytes(),
                frame.odom_from_base.tobytes(),
                frame.scan.ranges_m.tobytes(),
                frame.truth.case.tobytes(),
                frame.truth.exact_m.tobytes(),
                frame.truth.crossing_m.tobytes(),
                *(reading.velocity.tobytes() for reading in frame.odometry),
            ]
        )
        for frame in frames
    ]


@pytest.mark.parametrize("kind", ["diff", "omni"])
def test_the_same_seed_gives_the_same_bytes_and_another_one_others(kind):
    runs = [as_bytes(islice(simulation(robot=RobotParams(kind), seed=seed).drive("round"), 20)) for seed in (3, 3, 4)]
    assert runs[0] == runs[1]
    assert not any(first == other for first, other in zip(runs[0], runs[2]))


def test_a_scan_is_what_the_walls_are_seen_from_where_the_laser_is():
    run = simulation(NOISELESS, base_from_laser=(0.2, 0.1, 0.5), start=np.array([1.0, 2.0, -0.5]))
    frame = run.look()
    ahead = int(np.argmin(np.abs(frame.scan.angles_rad)))  # the laser looks along the map's x
    x, y = np.array([1.0, 2.0]) + [0.2 * np.cos(0.5) + 0.1 * np.sin(0.5), -0.2 * np.sin(0.5) + 0.1 * np.cos(0.5)]
    aside = int(np.argmin(np.abs(frame.scan.angles_rad + np.pi / 2)))
    assert frame.scan.ranges_m[ahead] == pytest.approx(3.0 - x, abs=1e-4)  # the pane, seen face on
    assert frame.scan.ranges_m[aside] == pytest.approx(y, abs=1e-4)
    assert frame.truth.case[ahead] == 1
    assert frame.truth.exact_m[ahead] == pytest.approx(3.0 - x)
    np.testing.assert_allclose(frame.scan.base_from_laser, [0.2, 0.1, 0.5])


def test_scans_come_at_their_rate_and_the_wheels_are_read_in_between():
    frames = list(islice(simulation(scan_rate_hz=8.0, seed=1).drive("round"), 10))
    assert [frame.stamp_ns - START_NS for frame in frames] == [125_000_000 * index for index in range(10)]
    for before, frame in zip(frames, frames[1:]):
        stamps = [reading.stamp_ns for reading in frame.odometry]
        assert stamps[-1] == frame.stamp_ns == frame.scan.stamp_ns
        assert stamps[0] > before.stamp_ns
        assert np.diff([before.stamp_ns, *stamps]).max() <= 1e9 * CONTROL_S + 1
        np.testing.assert_array_equal(frame.odometry[-1].odom_from_base, frame.odom_from_base)
    assert [reading.stamp_ns for reading in frames[0].odometry] == [START_NS]


def test_a_path_is_driven_from_its_start_to_its_end():
    run = simulation(seed=2)
    frames = list(run.drive("round"))
    np.testing.assert_allclose(frames[0].map_from_base, [1.0, 1.0, np.pi / 2])
    assert np.hypot(*(frames[-1].map_from_base[:2] - [2.0, 3.0])) < 0.1
    np.testing.assert_array_equal(frames[0].odom_from_base, [0.0, 0.0, 0.0])
    assert not any(frame.blocked for frame in frames)
    expected = se2.compose(se2.inverse(frames[0].map_from_base), frames[-1].map_from_base)
    drift = frames[-1].odom_from_base - expected
    assert 0.0 < np.hypot(*drift[:2]) < 0.3
    assert abs(float(angles.wrap(drift[2]))) < 0.3


def test_exact_wheels_tell_the_truth():
    frames = list(simulation(odometry=EXACT).drive("round"))
    for frame in frames:
        expected = se2.compose(se2.inverse(frames[0].map_from_base), frame.map_from_base)
        np.testing.assert_allclose(frame.odom_from_base[:2], expected[:2], atol=1e-9)


def test_waypoints_are_a_path_too_and_a_start_that_was_given_is_kept():
    run = simulation(start=np.array([0.6, 1.0, 0.0]))
    frames = list(run.drive(np.array([[1.0, 1.0], [2.0, 1.0]]), PathFollowerParams(speed_m_s=0.3)))
    np.testing.assert_array_equal(frames[0].map_from_base, [0.6, 1.0, 0.0])
    assert np.hypot(*(frames[-1].map_from_base[:2] - [2.0, 1.0])) < 0.05
    steps_m = np.diff([frame.map_from_base[0] for frame in frames])
    assert max(steps_m) == pytest.approx(0.03, rel=1e-3)  # at 10 Hz


def test_a_second_path_begins_where_the_first_ended():
    run = simulation()
    first = list(run.drive("round"))
    second = next(run.drive(np.array([[2.0, 3.0], [1.0, 3.0]])))
    np.testing.assert_array_equal(second.map_from_base, first[-1].map_from_base)


@pytest.mark.long_run
@pytest.mark.parametrize("path", ["into the wall", "through the pane"])
def test_neither_walls_nor_panes_are_driven_through(path):
    run = simulation()
    seen = []
    with pytest.raises(SimulationError) as caught:
        for frame in run.drive(path):
            seen.append(frame)
    assert seen[-1].blocked
    wall_m = 6.0 if path == "into the wall" else 3.0
    assert seen[-1].map_from_base[0] == pytest.approx(wall_m - 0.22, abs=0.01)
    assert str(caught.value).startswith(f"hall: the robot is stuck at x {wall_m - 0.22:.2f} m, y ")
    assert str(caught.value).endswith("something stands in the way of the path")


def test_a_step_moves_and_looks():
    run = simulation(odometry=EXACT)
    frame = run.step(1.0, FORWARD)
    assert frame.stamp_ns == run.stamp_ns == START_NS + 10**9
    assert frame.map_from_base[0] == pytest.approx(1.0 + 0.5 - 0.5**2 / 0.8 / 2)  # it accelerates at 0.8 m/s^2
    assert len(frame.odometry) == 51
    assert not run.blocked
    for _ in range(20):
        frame = run.step(0.5, FORWARD)
    assert frame.blocked
    assert run.blocked
    frame = run.step(0.5, np.zeros(3))
    assert not frame.blocked


def test_two_looks_at_one_time_are_two_scans():
    run = simulation()
    first, second = run.look(), run.look()
    assert first.stamp_ns == second.stamp_ns
    assert (first.scan.ranges_m != second.scan.ranges_m).any()
    assert [reading.stamp_ns for reading in second.odometry] == [second.stamp_ns]


def test_furniture_that_moved_is_where_the_seed_puts_it_and_stays_on_the_map():
    moved = [simulation(changed_share=0.67, seed=seed).building for seed in (1, 1, 2)]
    outlines = [
        np.concatenate([thing.outline_m for thing in building.things if not thing.mapped]).tobytes()
        for building in moved
    ]
    assert outlines[0] == outlines[1] != outlines[2]
    assert [sum(not thing.present for thing in building.things) for building in moved] == [2, 2, 2]
    assert simulation().building is not moved[0]


def test_the_wheels_do_not_depend_on_the_lidar():
    ways = [
        [frame.odom_from_base.tobytes() for frame in islice(simulation(model, seed=5).drive("round"), 20)]
        for model in (LIDAR, replace(LIDAR, beams=11), PRESETS["weak"])
    ]
    assert ways[0] == ways[1] == ways[2]


@pytest.mark.parametrize(
    "options, text",
    [
        (dict(seed=-1), "seed must be a whole number >= 0, got -1"),
        (dict(seed=1.5), "seed must be a whole number >= 0, got 1.5"),
        (dict(scan_rate_hz=0.0), "scan rate must be 0.1 to 1000 Hz, got 0.0"),
        (dict(base_from_laser=(0.0, 0.0)), "the laser's pose on the robot must be finite x, y, yaw, got (0.0, 0.0)"),
        (
            dict(start=np.array([0.1, 2.0, 0.0])),
            "hall: no room for the robot at x 0.10 m, y 2.00 m: its radius is 0.22 m, the nearest obstacle 0.10 m away",
        ),
        (dict(start=np.array([np.nan, 2.0, 0.0])), "the robot's start must be finite x, y, yaw, got [nan, 2.0, 0.0]"),
        (dict(changed_share=2.0), "changed share must be 0 to 1, got 2.0"),
    ],
)
def test_what_cannot_be_simulated_is_refused(options, text):
    with pytest.raises(ValueError) as caught:
        simulation(**options)
    assert str(caught.value) == text


@pytest.mark.parametrize(
    "path, text",
    [
        ("rund", "hall: no path 'rund', it has round, into the wall, through the pane; did you mean round?"),
        ("xyz", "hall: no path 'xyz', it has round, into the wall, through the pane"),
        (np.array([[1.0, 1.0]]), "a path needs 2 different waypoints, got 1"),
    ],
)
def test_what_is_no_path_is_refused(path, text):
    with pytest.raises(PathError) as caught:
        next(simulation().drive(path))
    assert str(caught.value) == text


def test_a_building_without_paths_says_so():
    with pytest.raises(PathError, match="^hall: no path 'round', it has none$"):
        Simulation(hall(paths={}), LIDAR).follower("round")


@pytest.mark.parametrize("dt_s", [0.0, -1.0, np.inf, np.nan])
def test_a_step_takes_time(dt_s):
    with pytest.raises(ValueError, match="^a step must take >= 1e-6 s, got "):
        simulation().move(dt_s, FORWARD)
