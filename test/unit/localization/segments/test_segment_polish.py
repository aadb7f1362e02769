"""Polishing of the filter's pose: what it moves, what it leaves alone, and that the filter uses it when told to."""

from __future__ import annotations

import numpy as np
import pytest
from buildings import CORRIDOR, L_ROOM, SECOND_NS, loop_drive, odometry, off

from glass_nav.localization.localizer import Localizer
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.localization.particle_filter.pose_estimate import PoseEstimate
from glass_nav.localization.segments.segment_polish import Polish, SegmentPolish

TRUE = np.array([2.3, 1.7, 1.0])


def estimate(pose, sigma_m=0.02, sigma_rad=0.01):
    return PoseEstimate(np.asarray(pose, float), np.diag([sigma_m, sigma_m, sigma_rad]) ** 2, 1.0, np.ones(1, bool))


@pytest.fixture(scope="module")
def polish():
    return SegmentPolish(L_ROOM.grid_map())


@pytest.mark.parametrize("shift", [(0.03, -0.02, 0.008), (-0.04, 0.0, -0.01), (0.0, 0.04, 0.0)])
def test_a_pose_that_is_nearly_right_is_put_right(polish, shift):
    ends_m = L_ROOM.scan(TRUE, rng=np.random.default_rng(0)).points_in_base()
    away_m, away_rad = off(polish.pose(estimate(TRUE + shift), ends_m), TRUE)
    assert away_m < 0.006 and away_rad < np.radians(0.2)


def test_a_pose_is_not_moved_further_than_the_filter_believes_possible(polish):
    ends_m = L_ROOM.scan(TRUE).points_in_base()
    wrong = TRUE + [0.12, 0.0, 0.0]
    np.testing.assert_array_equal(polish.pose(estimate(wrong), ends_m), wrong)
    assert off(polish.pose(estimate(wrong, sigma_m=0.1), ends_m), TRUE)[0] < 0.01


def test_few_beams_and_beams_off_the_walls_move_nothing(polish):
    ends_m = L_ROOM.scan(TRUE).points_in_base()
    near = TRUE + [0.03, 0.0, 0.0]
    np.testing.assert_array_equal(polish.pose(estimate(near), ends_m[:19]), near)
    elsewhere = 0.6 * ends_m
    elsewhere[::3] = ends_m[::3]
    np.testing.assert_array_equal(polish.pose(estimate(near), elsewhere), near)


def test_along_a_corridor_the_pose_stays():
    true = np.array([30.0, 1.1, 0.1])
    scan = CORRIDOR.scan(true)
    pose = SegmentPolish(CORRIDOR.grid_map()).pose(
        estimate(true + [0.04, 0.03, 0.0]), scan.points_in_base()[scan.ranges_m < 12.0]
    )
    assert pose[0] == pytest.approx(30.04, abs=1e-3) and pose[1] == pytest.approx(1.1, abs=0.005)


def test_the_filter_polishes_when_it_is_told_to():
    """The same drive: as long as it is off the poses are those of the filter without it; then they are others."""
    plain, polished = (
        Localizer(LocalizerParams(polish=Polish(on)), L_ROOM.grid_map(), np.random.default_rng(3))
        for on in (False, True)
    )
    off_again = Localizer(LocalizerParams(polish=Polish(True)), L_ROOM.grid_map(), np.random.default_rng(3))
    off_again.reconfigure(LocalizerParams())
    on_again = Localizer(LocalizerParams(), L_ROOM.grid_map(), np.random.default_rng(3))
    on_again.reconfigure(LocalizerParams(polish=Polish(True)))
    drive = loop_drive(8)
    wheels = odometry(drive, np.random.default_rng(4))
    filters = (plain, polished, off_again, on_again)
    for each in filters:
        each.set_pose(drive[0], np.diag([0.05, 0.05, 0.02]) ** 2)
    for step, (true, odom) in enumerate(zip(drive, wheels)):
        scan = L_ROOM.scan(true, step * SECOND_NS, np.random.default_rng(step))
        told = [each.update(scan, odom).map_from_base for each in filters]
        np.testing.assert_array_equal(told[0], told[2])
        np.testing.assert_array_equal(told[1], told[3])
        assert np.abs(told[0] - told[1]).max() > 0.0
        for pose in told[:2]:
            away_m, away_rad = off(pose, true)
            assert away_m < 0.02 and away_rad < np.radians(0.5)


def test_another_map_has_other_walls():
    localizer = Localizer(LocalizerParams(polish=Polish(True)), CORRIDOR.grid_map(), np.random.default_rng(0))
    localizer.set_map(L_ROOM.grid_map())
    localizer.set_pose(TRUE + [0.03, 0.0, 0.0], np.diag([0.03, 0.03, 0.01]) ** 2)
    found = localizer.update(L_ROOM.scan(TRUE, rng=np.random.default_rng(0)), np.zeros(3)).map_from_base
    assert off(found, TRUE)[0] < 0.01
