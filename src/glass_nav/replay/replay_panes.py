"""Replays of logs -> the panes that their map lacks."""

from __future__ import annotations

from typing import List

from glass_nav.localization.localizer import Estimate
from glass_nav.panes.pane_finder import PaneFinder, PaneFinderParams
from glass_nav.recording.recording import Step
from glass_nav.vocabulary import LocalizationState
from glass_nav.world.grid_map import GridMap
from glass_nav.world.pane import Pane


class NoUsablePose(ValueError):
    """The robot never knew where it was: nothing can be learnt about the map; one line."""


class PaneSearch:
    """Listens to replays of one map, see replay_run.run()."""

    def __init__(self, grid_map: GridMap, params: PaneFinderParams) -> None:
        self._finder = PaneFinder(grid_map, params)
        self._scans = self._used = 0

    def listen(self, step: Step, estimate: Estimate) -> None:
        """Each scan; those from a pose that is trusted count."""
        self._scans += 1
        if estimate.state == LocalizationState.LOCALIZED:
            self._used += self._finder.observe(step.scan, estimate.map_from_base, estimate.covariance)

    def panes(self) -> List[Pane]:
        """All candidates, the most probable first.

        Raises:
            NoUsablePose: no scan was taken at a trusted pose.
        """
        if not self._used:
            raise NoUsablePose(
                f"in none of {self._scans} scans was the pose certain enough (LOCALIZED) to learn about the map; "
                "nothing is drawn"
            )
        return self._finder.panes(anew=True)
