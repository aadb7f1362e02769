"""Logs -> the panes that their map lacks.

A log is read twice: first through the filter, whose sure poses are smoothed, then scan by scan into the finder. A stretch
on which the filter was not sure, because the glass that the map lacks is all that there is to see, counts as far as
odometry between two sure stretches leaves no doubt, or where the log has a ground truth.
"""

from __future__ import annotations

import dataclasses
from typing import Callable, List

from glass_nav.panes.pane_finder import PaneFinder, PaneFinderParams
from glass_nav.recording.recording import Step
from glass_nav.replay.prepared_replay import PreparedReplay
from glass_nav.replay.smoother import SmoothedPoses, Smoother
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.scan import ScanError
from glass_nav.world.grid_map import GridMap
from glass_nav.world.pane import Pane


class NoUsablePose(ValueError):
    """The robot never knew where it was: nothing can be learnt about the map; one line."""


class PaneSearch:
    """Looks for the panes that one map lacks, in one log after the other."""

    def __init__(self, grid_map: GridMap, params: PaneFinderParams) -> None:
        self._finder = PaneFinder(grid_map, params)
        self._field = DistanceField(grid_map)
        self._scans = self._used = 0

    def add(self, ready: PreparedReplay, step_done: Callable[[], None] = lambda: None) -> None:
        """One log.

        Args:
            ready: the log and a filter on this map.
            step_done: called after each scan of the first reading.

        Raises:
            RecordingError: not one scan of the log can be used.
        """
        localizer = ready.settings.localizer
        pane_use = dataclasses.replace(localizer.pane_use, find_panes=False)  # they are looked for below
        ready.localizer.reconfigure(dataclasses.replace(localizer, pane_use=pane_use))
        smoother = Smoother(self._field)
        self._scans += len(ready.run(step_done, smoother.listen))
        poses = smoother.smooth_sure(ready.recording.ground_truth)
        if poses is None:
            return
        for entry in ready.options.use.window.of(ready.recording):
            if isinstance(entry, Step):
                self._observe(entry, poses, localizer.limits.laser_min_range, localizer.limits.laser_max_range)

    def _observe(self, step: Step, poses: SmoothedPoses, min_range_m: float, max_range_m: float) -> None:
        try:
            scan = step.scan.limited(min_range_m, max_range_m)
        except ScanError:
            return  # counted in the first reading
        self._used += self._finder.observe(scan, *poses.at(scan.stamp_ns))

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
