"""The reported covariance: as wide as the errors of fitted poses, and wider where the map is wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from buildings import L_ROOM, SECOND_NS, loop_drive

from glass_nav.geometry import se2
from glass_nav.hypotheses import scan_alignment
from glass_nav.localization.integrity.claimed_covariance import ClaimedCovariance
from glass_nav.localization.integrity.integrity_monitor import IntegrityMonitor
from glass_nav.localization.particle_filter.motion import OdometryNoise
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.known_area import KnownArea

GRID = L_ROOM.grid_map()
NOISE = OdometryNoise()
HERE = loop_drive(1)[0]
NO_SPREAD = np.zeros((3, 3))
START = np.diag([0.25, 0.25, 0.07])


def scan_at(pose, index=0):
    return L_ROOM.scan(pose, index * SECOND_NS, np.random.default_rng(index))


def followed(kind=ClaimedCovariance, grid_map=GRID, scans=40):
    """Of a robot that stands, after some scans."""
    claimed = kind(DistanceField(grid_map), KnownArea(grid_map))
    claimed.start(START)
    for index in range(scans):
        arguments = (None,) if kind is IntegrityMonitor else ()
        claimed.update(scan_at(HERE, index), HERE, None, NOISE, 1.0, *arguments)
    return claimed


def deviations(covariance):
    return np.sqrt(np.diag(covariance))


def test_doubts_about_the_pose_widen_it_as_they_do_the_one_that_decides():
    monitor = followed(IntegrityMonitor)
    assert np.all(deviations(monitor.claimed_at(None, NOISE, NO_SPREAD))[:2] < 0.01)
    other = se2.compose(HERE, np.array([0.1, 0.4, 0.3]))
    monitor.update(scan_at(HERE, 50), HERE, None, NOISE, 1.0, other)
    assert np.all(deviations(monitor.claimed_at(None, NOISE, NO_SPREAD)) >= np.abs(other - HERE))


def test_a_spread_of_millimetres_is_no_doubt_and_one_of_decimetres_is():
    claimed = followed()
    alone = deviations(claimed.at(None, NOISE, NO_SPREAD))
    usual = np.diag([0.008, 0.008, 0.002]) ** 2
    np.testing.assert_allclose(deviations(claimed.at(None, NOISE, usual)), alone, rtol=0.05)
    wide = np.diag([0.3, 0.2, 0.1]) ** 2
    np.testing.assert_allclose(deviations(claimed.at(None, NOISE, wide)), deviations(wide), rtol=0.01)


def test_walls_that_are_drawn_off_widen_it():
    """The same scans in a map in which every second metre of the walls is drawn a cell off."""
    rows, columns = np.nonzero(GRID.occupied)
    moved = (rows + columns) * GRID.resolution_m % 2.0 > 1.0
    occupancy = np.where(GRID.occupied, 0, GRID.occupancy).astype(np.int8)
    occupancy[np.minimum(rows + moved, len(occupancy) - 1), np.minimum(columns + moved, occupancy.shape[1] - 1)] = 100
    right, wrong = followed(), followed(grid_map=replace(GRID, occupancy=occupancy))
    assert np.all(
        deviations(wrong.at(None, NOISE, NO_SPREAD))[:2] > 1.5 * deviations(right.at(None, NOISE, NO_SPREAD))[:2]
    )


@pytest.mark.parametrize("worth", [0.0, 1.0])
def test_scans_that_say_nothing_leave_the_start(worth):
    claimed = followed(scans=0)
    scan = scan_at(HERE)
    claimed.update(replace(scan, ranges_m=np.full(len(scan), np.inf)), HERE, None, NOISE, worth)
    np.testing.assert_allclose(claimed.at(None, NOISE, NO_SPREAD), START, atol=1e-9)


def test_other_evidence_narrows_it():
    claimed = followed(scans=0)
    claimed.narrow(1e-4 * np.eye(3))
    assert np.all(deviations(claimed.at(None, NOISE, NO_SPREAD)) < 0.02)


def test_errors_of_fitted_poses_are_as_large_as_it_says():
    """Poses that scans with noise are fitted to, in a room that is drawn right: NEES, 3 degrees of freedom."""
    field = DistanceField(GRID)
    claimed = ClaimedCovariance(field, KnownArea(GRID))
    claimed.start(START)
    nees = []
    for index in range(50):
        scan = scan_at(HERE, index)
        points_m = scan.points_in_base()[scan.answered]
        pose = scan_alignment.align(field, points_m, HERE[None], last_scale_m=0.06).poses[0]
        claimed.update(scan, pose, np.zeros(3), NOISE, 1.0)
        nees.append((pose - HERE) @ np.linalg.solve(claimed.at(None, NOISE, NO_SPREAD), pose - HERE))
    assert 0.1 < np.median(nees[20:]) < 4.0
