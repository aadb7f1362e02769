"""A tracked pose at every scan: its covariance, and whether the scan still fits there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from buildings import L_ROOM, SECOND_NS, loop_drive

from glass_nav.geometry import se2
from glass_nav.localization.integrity.integrity_monitor import IntegrityMonitor
from glass_nav.localization.particle_filter.motion import OdometryNoise
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.known_area import KnownArea

GRID = L_ROOM.grid_map()
FIELD = DistanceField(GRID)
NOISE = OdometryNoise()
HERE = loop_drive(1)[0]
NO_SPREAD = np.zeros((3, 3))


def scan_at(pose, index=0, lidar=""):
    return replace(L_ROOM.scan(pose, index * SECOND_NS, np.random.default_rng(index)), lidar=lidar)


def followed(scans=5, suspect=None):
    """A robot that stands, tracked for some scans."""
    monitor = IntegrityMonitor(FIELD, KnownArea(GRID))
    monitor.start(np.diag([0.25, 0.25, 0.07]))
    for index in range(scans):
        monitor.update(scan_at(HERE, index), HERE, None, NOISE, True, suspect)
    return monitor


def deviations(monitor, step=None, spread=NO_SPREAD):
    return np.sqrt(np.diag(monitor.at(step, NOISE, spread)))


def test_a_scan_that_fits_makes_a_pose_certain():
    found = deviations(followed())
    assert np.all(found[:2] < 0.05) and found[2] < np.radians(1.0)


def test_it_is_never_more_certain_than_its_particles():
    wide = np.diag([0.3, 0.2, 0.1]) ** 2
    assert np.all(deviations(followed(), spread=wide) >= np.sqrt(np.diag(wide)) - 1e-9)


@pytest.mark.parametrize("off", [[0.1, 0.0, 0.0], [0.0, -0.12, 0.0], [0.0, 0.0, 0.06]])
def test_a_scan_that_fits_beside_the_pose_shows_in_its_covariance_and_asks_for_an_update(off):
    monitor = followed()
    still = np.zeros(3)
    assert monitor.fits(scan_at(HERE, 9), HERE, still, NOISE)
    before = deviations(monitor, still)
    assert not monitor.fits(scan_at(se2.compose(HERE, np.array(off)), 10), HERE, still, NOISE)
    after = deviations(monitor, still)
    assert np.max(after - before) > 0.4 * np.max(np.abs(off))


def test_a_scan_that_fits_nowhere_asks_for_one_update_and_not_for_many():
    """A crowd around the robot: after the update its scans fit no worse than before."""
    monitor = followed()

    def crowd(index):
        scan = scan_at(HERE, index)
        return replace(scan, ranges_m=np.where(np.arange(len(scan)) % 3 > 0, 0.6, scan.ranges_m))

    still = np.zeros(3)
    assert not monitor.fits(crowd(10), HERE, still, NOISE)
    monitor.update(crowd(10), HERE, still, NOISE, False, None)
    assert monitor.fits(crowd(11), HERE, still, NOISE)


def test_a_place_that_has_to_be_confirmed_lies_within_the_covariance():
    other = se2.compose(HERE, np.array([0.1, 0.4, 0.3]))
    assert np.all(deviations(followed(suspect=other)) >= np.abs(other - HERE))


def test_each_lidar_is_compared_with_itself():
    monitor = followed()
    few = replace(scan_at(HERE, 10, "rear"), ranges_m=np.where(np.arange(180) % 3 > 0, 0.6, scan_at(HERE).ranges_m))
    assert monitor.fits(few, HERE, np.zeros(3), NOISE)


def test_without_a_tracked_pose_it_says_nothing_of_its_own():
    monitor = IntegrityMonitor(FIELD, KnownArea(GRID))
    monitor.update(scan_at(HERE), HERE, None, NOISE, True, None)
    monitor.narrow(NO_SPREAD)
    assert monitor.fits(scan_at(HERE, 1), HERE, np.zeros(3), NOISE)
    spread = np.diag([1.0, 2.0, 3.0])
    np.testing.assert_array_equal(monitor.at(None, NOISE, spread), spread)
    monitor.start(spread)
    monitor.stop()
    np.testing.assert_array_equal(monitor.at(None, NOISE, spread), spread)


def test_a_scan_without_answers_is_no_reason_for_an_update():
    monitor = followed()
    scan = scan_at(HERE, 10)
    blind = replace(scan, ranges_m=np.full(len(scan), np.inf))
    assert monitor.fits(blind, HERE, np.zeros(3), NOISE)
    monitor.update(blind, HERE, np.zeros(3), NOISE, True, None)
    assert np.isfinite(deviations(monitor)).all()
