"""The simulated robot of the demo: a whole wake-up in a small building, and the same seed twice."""

from __future__ import annotations

from typing import List

import made_buildings
import numpy as np
import pytest

from glass_nav.demo.simulated_robot import SimulatedRobot
from glass_nav.demo.wake_up_demo import WakeUpDemo, WakeUpDemoParams
from glass_nav.simulation import building_map
from glass_nav.simulation.building import Building
from glass_nav.simulation.simulation import Simulation
from glass_nav.topology.atlas import atlas_builder
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.vocabulary import LocalizationState, Outcome

START = np.array([1.5, 1.0, 0.3])
HOUSE = Building(made_buildings.SIDE_CORRIDOR_WALLS, start=START)
GRID_MAP = building_map.draw(HOUSE)
ATLAS = atlas_builder.build(GRID_MAP, "house", "house")[0]


def robot_at(seed: int, lines: List[str], search: SearchParams = SearchParams()) -> SimulatedRobot:
    simulation = Simulation(HOUSE, made_buildings.COARSE, seed=seed, start=START)
    return SimulatedRobot(simulation, GRID_MAP, ATLAS, seed, lines.append, search)


@pytest.mark.long_run
def test_a_robot_finds_its_place_is_localized_and_takes_goals() -> None:
    lines: List[str] = []
    robot = robot_at(1, lines, SearchParams(confirm_edges=0, use_scans=False))
    assert robot.restart_search() == "" and robot.takes_goals() and not robot.is_ending()
    assert WakeUpDemo(ATLAS, WakeUpDemoParams(atlas="house", tour=0), robot.reports, robot).run(), lines
    assert any("match node M0: degree " in line for line in lines)
    assert any(", right: hands over" in line for line in lines)
    assert robot.reports.localization == LocalizationState.LOCALIZED
    robot.go_to(0)
    assert robot.arrival() is None
    robot.stop()
    arrival = robot.arrival()
    assert arrival is not None and arrival.outcome == Outcome.PREEMPTED


@pytest.mark.long_run
def test_the_same_seed_gives_the_same_drive() -> None:
    robots = [robot_at(3, []) for _ in range(2)]
    for robot in robots:
        for _ in range(30):
            robot.listen()
    first, again = (robot.reports.true_trajectory().poses for robot in robots)
    np.testing.assert_array_equal(first, again)
    assert robots[0].wall_s() > robots[0].reports.simulated_s
