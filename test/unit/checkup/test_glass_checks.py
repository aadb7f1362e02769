"""A robot drives through a hall: what is said of a map that lacks its pane, or shows a wall that is gone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from glass_nav.checkup import glass_checks
from glass_nav.simulation import building_map
from glass_nav.simulation.building import Building, Pane, Thing, Wall, box
from glass_nav.simulation.lidar import LidarModel
from glass_nav.simulation.simulation import Simulation
from glass_nav.world import pane as found

PANE_Y, PANE_X = 3.0, (3.0, 8.0)
HALL = Building(
    (Wall(np.array([[0.0, 0.0], [11.0, 0.0], [11.0, 6.0], [0.0, 6.0], [0.0, 0.0]])),),
    (Pane(np.array([[PANE_X[0], PANE_Y], [PANE_X[1], PANE_Y]])),),
    things=tuple(Thing(box(x, y, 0.5, 0.3, yaw)) for x, y, yaw in ((1.6, 5.0, 0.4), (5.5, 5.3, 0.0), (8.7, 3.6, 1.1))),
    paths={"along": np.array([[1.0, 1.4], [10.0, 1.4], [10.0, 4.5], [10.0, 1.4], [4.0, 1.4]])},
    start=np.array([1.0, 1.4, 0.0]),
    seen_m=np.array([[5.0, 4.5]]),
)


@pytest.fixture(scope="module")
def drive():
    """Scans and odometry (N, 3)."""
    simulation = Simulation(HALL, LidarModel(beams=181), seed=2, scan_rate_hz=5.0)
    frames = list(simulation.drive("along"))
    return [frame.scan for frame in frames], np.array([frame.odom_from_base for frame in frames])


def test_nothing_is_said_of_a_map_that_shows_what_there_is(drive):
    assert list(glass_checks.check(building_map.draw(HALL), *drive)) == []


def test_glass_that_the_map_lacks_is_named_with_its_length_and_place(drive):
    (finding,) = glass_checks.check(building_map.draw(HALL, erased=[0]), *drive)
    assert finding.name == "glass-not-mapped"
    length_m = float(finding.what.split()[3])
    assert 4.0 < length_m < 6.0
    assert "in 1 pane: " in finding.what and "y 3.0 m" in finding.what
    assert finding.advice.startswith("draw it in: glass_nav map panes BAG --map MAP.yaml --out DIR")


@pytest.mark.parametrize(
    ("probabilities", "end_m", "named"),
    [
        pytest.param((0.98,), 2.0, False, id="one pane, which one time in fifty is none"),
        pytest.param((0.995,), 2.0, True, id="one pane that is certain"),
        pytest.param((0.995,), 1.0, False, id="one that is no longer than a door"),
        pytest.param((0.92, 0.92), 1.0, True, id="two panes, one of which is real almost certainly"),
        pytest.param((0.92, 0.6, 0.6), 2.0, False, id="panes that are not probable do not count"),
    ],
)
def test_glass_is_named_once_it_is_certain_that_some_of_it_is_real(monkeypatch, drive, probabilities, end_m, named):
    panes = [found.Pane(np.zeros(2), np.array([end_m, 0.0]), probability) for probability in probabilities]

    class Finder:
        def __init__(self, grid_map):
            pass

        def observe(self, scan, map_from_base, covariance):
            return True

        def panes(self):
            return panes

    monkeypatch.setattr(glass_checks, "PaneFinder", Finder)
    monkeypatch.setattr(glass_checks, "follow", lambda *_: glass_checks.Followed(drive[0][:1], np.ones((1, 3))))
    findings = [finding.name for finding in glass_checks.check(building_map.draw(HALL), *drive)]
    assert findings == ["glass-not-mapped"] * named


def test_a_wall_that_beams_pass_from_all_sides_is_gone(drive):
    wall = Wall(np.array([[4.0, 2.3], [7.5, 2.3]]))
    grid_map = building_map.draw(replace(HALL, walls=(*HALL.walls, wall)))
    (finding,) = glass_checks.check(grid_map, *drive)
    assert finding.name == "wall-is-gone"
    assert "of walls of the map in all directions, in 1 piece: " in finding.what and "y 2.2 m" in finding.what


def test_where_the_robot_is_not_found_nothing_is_reported(drive):
    scans, odom_from_base = drive
    other = Building((Wall(np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [0.0, 2.0], [0.0, 0.0]])),), start=np.ones(3))
    assert list(glass_checks.check(building_map.draw(other), scans[:30], odom_from_base[:30])) == []
