"""Requests for a corrected pose: answered, refused in words, and measured beside without waiting."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from buildings import CORRIDOR, L_ROOM, off

from glass_nav.localization.segments.pose_locator import PoseLocator
from glass_nav.vocabulary import BeamCase
from glass_nav.world.grid_map import GridMap

HERE = np.array([2.3, 1.7, 1.0])
SCAN = L_ROOM.scan(HERE)


def test_a_rough_pose_is_corrected():
    answer = PoseLocator().locate(L_ROOM.grid_map(), SCAN, HERE + [0.2, -0.1, 0.05])
    away_m, away_rad = off(answer.map_from_base, HERE)
    assert away_m < 0.02 and away_rad < np.radians(0.3)
    assert answer.refusal is None and answer.text == "free: none: the walls constrain x, y and yaw"
    assert answer.correction.after.combined > answer.correction.before.combined


def test_the_hallway_effect_is_reported_in_the_message():
    true = np.array([30.0, 1.1, 0.2])
    scan = CORRIDOR.scan(true)
    answer = PoseLocator().locate(CORRIDOR.grid_map(), replace(scan, range_max_m=8.0), true + [0.3, 0.1, 0.0])
    assert answer.text in (f"free: the direction {deg} deg of the map: not corrected" for deg in (0, 180))
    assert answer.map_from_base[0] == pytest.approx(30.3, abs=1e-3)
    assert answer.map_from_base[1] == pytest.approx(1.1, abs=0.02)


def test_a_scan_that_fits_nowhere_near_leaves_the_pose_as_it_was():
    rough = HERE + [30.0, 0.0, 0.0]
    answer = PoseLocator().locate(L_ROOM.grid_map(), SCAN, rough)
    assert answer.map_from_base.tolist() == rough.tolist()
    assert answer.refusal is not None and answer.text.startswith("the scan fits nowhere near the pose: ")


@pytest.mark.parametrize(
    ("grid_map", "scan", "rough", "line"),
    [
        (L_ROOM.grid_map(), SCAN, [0.0, np.nan, 0.0], "the rough pose must be finite x, y, yaw, got [ 0. nan  0.]"),
        (
            L_ROOM.grid_map(),
            replace(SCAN, ranges_m=np.full(len(SCAN), np.inf)),
            HERE,
            "no beam of the scan returned",
        ),
        (
            GridMap(np.zeros((40, 40), np.int8), 0.1, np.zeros(3)),
            SCAN,
            HERE,
            "no wall of the map is long enough for a segment",
        ),
    ],
)
def test_what_cannot_be_answered_is_refused(grid_map, scan, rough, line):
    with pytest.raises(ValueError) as refused:
        PoseLocator().locate(grid_map, scan, np.array(rough))
    assert str(refused.value) == line


@pytest.mark.long_run
def test_the_quality_of_a_scan_does_not_wait_for_the_segments():
    locator, grid_map = PoseLocator(), L_ROOM.grid_map()
    case = np.full(len(SCAN), BeamCase.DIFFUSE)
    assert locator.quality(grid_map, SCAN, case, HERE) is None  # it starts to find them
    deadline_s = time.monotonic() + 60.0
    quality = None
    while quality is None and time.monotonic() < deadline_s:
        quality = locator.quality(grid_map, SCAN, case, HERE)
    assert quality is not None and quality.points == np.count_nonzero(SCAN.answered)
    assert quality.combined > 0.5
    mirrored = np.full(len(SCAN), BeamCase.SPECULAR)
    assert locator.quality(grid_map, SCAN, mirrored, HERE).points == 0
