"""The smoother against a drive whose poses are known."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from glass_nav.geometry import angles, se2
from glass_nav.replay.smoother import Smoother
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.raycast import RayCaster
from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import GridMap

ANGLES_RAD = np.linspace(-np.pi, np.pi, 90, endpoint=False)


def room() -> GridMap:
    """6 m by 4 m, with a pillar."""
    occupancy = np.zeros((80, 120), np.int8)
    occupancy[[0, -1]] = occupancy[:, [0, -1]] = 100
    occupancy[30:36, 70:76] = 100
    return GridMap(occupancy, 0.05, np.zeros(3))


def drive(count=40):
    """(S, 3) true poses."""
    share = np.linspace(0.0, 1.0, count)
    return np.stack([1.0 + 3.0 * share, 1.0 + 1.5 * share**2, 0.8 * share], axis=-1)


def smoothed(true, filtered, odometry, answer=np.isfinite, seed=0):
    """The smoothed poses of a drive in the room; `answer` says which of the ranges return."""
    grid_map, rng = room(), np.random.default_rng(seed)
    smoother = Smoother(DistanceField(grid_map))
    ranges_m = RayCaster(grid_map).cast(true, ANGLES_RAD, 20.0) + 0.025 + rng.normal(0.0, 0.01, (len(true), 90))
    for index, measured_m in enumerate(ranges_m):
        measured_m = np.where(answer(measured_m), measured_m, np.inf)
        scan = Scan(index * 10**8, measured_m, ANGLES_RAD, 0.05, 20.0, np.zeros(3))
        step = SimpleNamespace(scan=scan, odom_from_base=odometry[index])
        smoother.listen(step, SimpleNamespace(map_from_base=filtered[index]))
    return smoother.smooth()


def off_m(poses, true):
    return np.hypot(*(poses - true)[:, :2].T)


def test_noise_of_the_filter_is_smoothed_away():
    true = drive()
    filtered = true + np.random.default_rng(1).normal(0.0, [0.05, 0.05, 0.02], true.shape)
    odometry = se2.compose(np.array([3.0, -2.0, 1.0]), true)  # exact, in its own frame
    found = smoothed(true, filtered, odometry)
    assert len(found) == len(true)
    assert off_m(found.poses, true).max() < 0.02 < off_m(filtered, true).mean()
    assert np.abs(angles.wrap(found.poses[:, 2] - true[:, 2])).max() < np.radians(0.7)


def test_a_step_of_odometry_that_is_far_off_gives_way_to_the_scans():
    true = drive()
    odometry = true.copy()
    odometry[20:, 0] += 0.7
    assert off_m(smoothed(true, true, odometry).poses, true).max() < 0.03


def test_where_no_beam_returns_odometry_leads_between_what_was_seen_before_and_after():
    true = drive()
    filtered = true.copy()
    filtered[15:25, :2] += 0.3
    blind = iter(range(len(true)))

    def answer(measured_m):
        return np.full(len(measured_m), not 15 <= next(blind) < 25)

    assert off_m(smoothed(true, filtered, true, answer).poses, true).max() < 0.03


def test_of_two_lidars_at_one_moment_the_first_counts():
    scan = Scan(5, np.full(90, 1.0), ANGLES_RAD, 0.05, 20.0, np.zeros(3))
    smoother = Smoother(DistanceField(room()))
    for x in (2.0, 3.0):
        step = SimpleNamespace(scan=scan, odom_from_base=np.zeros(3))
        smoother.listen(step, SimpleNamespace(map_from_base=np.array([x, 2.0, 0.0])))
    assert smoother.smooth().stamps_ns.tolist() == [5]


def test_without_a_scan_there_is_nothing_to_smooth():
    with pytest.raises(ValueError, match="at least one scan"):
        Smoother(DistanceField(room())).smooth()
