"""One scan put on the walls of a map, where its beams meet walls, panes and people."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from buildings import CORRIDOR, GLASS_ROOM, L_ROOM, off

from glass_nav.geometry import se2
from glass_nav.localization.segments.segment_locator import SegmentLocator
from glass_nav.world.grid_map import GridMap

HERE = np.array([2.3, 1.7, 1.0])


@pytest.fixture(scope="module")
def room():
    return SegmentLocator(L_ROOM.grid_map())


@pytest.mark.parametrize("seed", range(3))
def test_a_scan_finds_its_place_in_a_room(room, seed):
    scan = L_ROOM.scan(HERE, rng=np.random.default_rng(seed))
    rough = HERE + np.random.default_rng(seed).uniform(-1.0, 1.0, 3) * [0.3, 0.3, np.radians(8.0)]
    located = room.locate(scan, rough)
    away_m, away_rad = off(located.correction.map_from_base, HERE)
    assert away_m < 0.02 and away_rad < np.radians(0.3)
    assert np.mean(located.case == 1) > 0.95 and located.used.sum() > 170
    assert located.correction.after.combined > 2.0 * located.correction.before.combined


@pytest.mark.parametrize("seed", range(3))
def test_beams_that_pass_a_pane_pull_on_the_wall_behind_and_mirrored_ones_on_none(seed):
    """A seventh of the beams towards the pane come back mirrored: from beyond, where there is no wall."""
    true = np.array([4.4, 1.7, 0.3])
    rng = np.random.default_rng(seed)
    scan = GLASS_ROOM.scan(true, rng=rng, glass_share=0.5)
    at_pane = GLASS_ROOM.crossings(se2.compose(true, scan.base_from_laser), scan.angles_rad)
    towards = at_pane[1][:, 0]
    mirrored = towards & (rng.random(len(scan)) < 1.0 / 7.0)
    ranges_m = np.where(mirrored, at_pane[0][:, 0] + rng.uniform(0.3, 1.0, len(scan)), scan.ranges_m)
    scan = replace(scan, ranges_m=ranges_m)
    passed = towards & ~mirrored & (scan.ranges_m > at_pane[0][:, 0] + 0.5)
    located = SegmentLocator(GLASS_ROOM.grid_map()).locate(scan, true + [0.25, -0.2, np.radians(5.0)])
    away_m, away_rad = off(located.correction.map_from_base, true)
    assert away_m < 0.02 and away_rad < np.radians(0.3)
    assert np.mean(located.case[passed] == 3) > 0.7
    assert not located.used[mirrored].any() or np.mean(located.used[mirrored]) < 0.3


@pytest.mark.parametrize("ranges", [np.nan, np.inf, -np.inf])
def test_without_an_answer_the_pose_stays(room, ranges):
    scan = L_ROOM.scan(HERE)
    located = room.locate(replace(scan, ranges_m=np.full(len(scan), ranges)), HERE)
    assert located.correction.map_from_base.tolist() == HERE.tolist()
    assert not located.used.any() and len(located.correction.free) == 3


def test_a_map_without_walls_moves_nothing():
    empty = GridMap(np.zeros((40, 40), np.int8), 0.1, np.zeros(3))
    located = SegmentLocator(empty).locate(L_ROOM.scan(HERE), HERE)
    assert located.correction.map_from_base.tolist() == HERE.tolist() and len(located.correction.free) == 3
    assert located.correction.after.combined == 0.0


def test_few_beams_pull_all_together_whatever_they_met(room):
    scan = L_ROOM.scan(HERE, beams=16)
    located = room.locate(scan, HERE + [0.1, 0.0, 0.0])
    assert located.used.sum() == 16
    assert off(located.correction.map_from_base, HERE)[0] < 0.03


@pytest.mark.parametrize("seed", range(3))
def test_along_a_hallway_the_rough_pose_is_kept(seed):
    true = np.array([30.0, 1.1, 0.1])
    scan = CORRIDOR.scan(true, rng=np.random.default_rng(seed))
    scan = replace(scan, ranges_m=np.where(scan.ranges_m < 10.0, scan.ranges_m, np.inf))  # sees neither end
    found = SegmentLocator(CORRIDOR.grid_map()).locate(scan, true + [0.2, -0.3, 0.08]).correction
    assert found.map_from_base[0] == pytest.approx(30.2, abs=2e-3)
    assert found.map_from_base[1:] == pytest.approx(true[1:], abs=0.01)
    assert len(found.free) == 1 and abs(np.sin(found.free_heading_rad)) < 0.01
