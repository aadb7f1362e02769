"""Panes of a drive on which the filter was sure of the beginning and of the end only."""

from __future__ import annotations

from types import SimpleNamespace

import made_pane_drive
import numpy as np
import pytest

from glass_nav.panes.pane_finder import PaneFinderParams
from glass_nav.replay.replay_panes import NoUsablePose, PaneSearch
from glass_nav.replay.smoother import Smoother
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.vocabulary import LocalizationState


def search(sure: np.ndarray) -> PaneSearch:
    """After a drive past two panes of 6 m, of whose poses the filter was sure or not, (S,) bool."""
    grid_map = made_pane_drive.hall()
    looks = made_pane_drive.pane((2.0, 2.5), (8.0, 2.5)), made_pane_drive.pane((2.0, 0.2), (8.0, 0.2))
    drive = list(made_pane_drive.scans(*looks))
    smoother = Smoother(DistanceField(grid_map))
    for number, (scan, pose) in enumerate(drive):
        known = number >= len(sure) or sure[number]
        state = LocalizationState.LOCALIZED if known else LocalizationState.LOST
        step = SimpleNamespace(scan=scan, odom_from_base=pose + [0.0, 0.0, 0.002 * number])
        smoother.listen(step, SimpleNamespace(map_from_base=pose, state=state))
    panes = PaneSearch(grid_map, PaneFinderParams())
    panes.add_drive(smoother, lambda: (scan for scan, _ in drive))
    return panes


def length_m(sure: np.ndarray) -> float:
    return sum(pane.length_m for pane in search(sure).panes() if pane.probability > 0.9)


def test_panes_beside_unsure_poses_are_found_by_those_beside_sure_ones() -> None:
    unsure = np.ones(1000, bool)
    unsure[20:60] = False
    assert length_m(unsure) == pytest.approx(12.0, abs=0.7)


def test_without_a_sure_pose_nothing_is_drawn() -> None:
    with pytest.raises(NoUsablePose, match="in none of [0-9]+ scans was the pose certain enough"):
        search(np.zeros(1000, bool)).panes()
