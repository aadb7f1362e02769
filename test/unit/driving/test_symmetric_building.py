"""A robot in a building that looks the same from four places drives until that is proved, and says which they are."""

from __future__ import annotations

from dataclasses import replace
from typing import Optional

import numpy as np
import pytest

from glass_nav.driving.base_limits import BaseLimits
from glass_nav.driving.edge_tracking.edge_driver import EdgeDriver
from glass_nav.driving.recovery import RecoveryParams
from glass_nav.driving.tasks import EdgeTask, Moment
from glass_nav.geometry import angles
from glass_nav.hypotheses.scan_explanation import ScanExplanation
from glass_nav.simulation import building_map, lidar
from glass_nav.simulation.building import Building, Wall
from glass_nav.simulation.simulation import Simulation
from glass_nav.topology.atlas import atlas_builder
from glass_nav.topology.search.atlas_localizer import AtlasLocalizer
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.vocabulary import Outcome, SearchState

CONTROL_S = 0.05
W, L = 1.0, 5.0  # half the width of the four arms of a cross, and how far they reach


def cross() -> Building:
    """Four equal arms at right angles."""
    outline = np.array(
        [
            [W, W],
            [L, W],
            [L, -W],
            [W, -W],
            [W, -L],
            [-W, -L],
            [-W, -W],
            [-L, -W],
            [-L, W],
            [-W, W],
            [-W, L],
            [W, L],
            [W, W],
        ]
    )
    ways = {
        "east and west": np.array([[L - 1.0, 0.0], [1.0 - L, 0.0]]),
        "north and south": np.array([[0.0, L - 1.0], [0.0, 1.0 - L]]),
    }
    return Building(walls=(Wall(outline),), paths=ways, start=np.array([2.5, 0.2, 1.0]), name="cross")


def drive(simulation: Simulation, driver: EdgeDriver, task: EdgeTask) -> None:
    """Until the task is over."""
    command = np.zeros(3)
    for _ in range(750):
        frame = simulation.look()
        driver.see(frame.scan, frame.odom_from_base)
        for _ in range(4):
            command = task.step(Moment(simulation.reading.odom_from_base, None, command, CONTROL_S))
            simulation.move(CONTROL_S, command)
            assert not simulation.blocked, "it ran into a wall"
        if task.ending is not None:
            assert task.ending.outcome == Outcome.SUCCEEDED, task.ending.reason
            return
    raise AssertionError("it did not arrive within 150 s")


@pytest.mark.long_run
def test_a_robot_in_a_cross_of_four_equal_arms_is_ambiguous_and_lists_the_four_places() -> None:
    building = cross()
    grid_map = building_map.draw(building)
    atlas, _ = atlas_builder.build(grid_map, "cross", "cross")
    simulation = Simulation(building, lidar.preset("sensitive"), seed=3, scan_rate_hz=5.0)
    driver, limits = EdgeDriver(), BaseLimits()
    localizer = AtlasLocalizer(atlas, SearchParams(), ScanExplanation(grid_map))
    rank: Optional[int] = None
    for _ in range(20):
        task = EdgeTask(driver, RecoveryParams(), limits, rank)
        drive(simulation, driver, task)
        arrival = task.arrival
        assert arrival is not None
        meetpoint = replace(arrival.meetpoint, odom_from_base=arrival.odom_from_base)
        if arrival.traversal is None:
            estimate = localizer.start(meetpoint)
        else:
            estimate = localizer.update(arrival.traversal, meetpoint)
        if estimate.choice is None:
            break
        rank = estimate.choice.rank
    assert estimate.state == SearchState.AMBIGUOUS, estimate.reason
    assert "4 places match, and no turn can tell them apart" in estimate.reason
    belief = localizer.belief
    assert belief is not None and belief.share[3] > 0.05, belief  # nor do the scans
    poses = localizer.map_from_base(estimate.dart)
    off = poses - simulation.map_from_base
    true = (np.hypot(off[:, 0], off[:, 1]) < 0.15) & (np.abs(angles.wrap(off[:, 2])) < 0.1)
    assert true.sum() == 1  # one of them is the truth,
    turned = np.sort(np.mod(poses[:, 2] - poses[true, 2] + 0.1, 2.0 * np.pi) - 0.1)
    np.testing.assert_allclose(turned, np.arange(4) * np.pi / 2.0, atol=0.1)  # and they are a quarter turn apart
