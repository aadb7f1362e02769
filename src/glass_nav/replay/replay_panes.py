"""Finds the panes that a map lacks in recorded logs.

A log is read twice: first through the filter, whose sure poses are smoothed, then scan by scan into the finder. A stretch
on which the filter was not sure, because the glass that the map lacks is all that there is to see, counts as far as
odometry between two sure stretches leaves no doubt, or where the log has a ground truth. The panes found there show where
the robot was, which shows more panes: such logs are smoothed and read again on the map with the panes. The filter itself
does not run again: on a map with half of its panes a bridge looks like its own beginning.
"""

from __future__ import annotations

import contextlib
import dataclasses
from dataclasses import dataclass
from typing import Callable, Iterable, Iterator, List, Optional, Sequence

from glass_nav.geometry.trajectory import Trajectory
from glass_nav.localization.localizer import Localizer
from glass_nav.panes.pane_finder import PaneFinder, PaneFinderParams
from glass_nav.recording.recording import Step
from glass_nav.replay.prepared_replay import PreparedReplay
from glass_nav.replay.smoother import SmoothedPoses, Smoother
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.scan import Scan, ScanError
from glass_nav.world import drawn_panes
from glass_nav.world.grid_map import GridMap
from glass_nav.world.pane import Pane

_ROUNDS = 4  # each reaches some metres farther along a bridge
_MIN_GROWTH_M = 0.5  # of the panes, for another round
_BELIEVED = 0.9


class NoUsablePose(ValueError):
    """The robot never knew where it was: nothing can be learnt about the map; one line."""


@dataclass
class _Drive:
    """A log, read once."""

    scans: Callable[[], Iterable[Scan]]
    smoother: Smoother
    truth: Optional[Trajectory]
    poses: SmoothedPoses


class PaneSearch:
    """Looks for the panes that one map lacks, in one log after the other."""

    def __init__(self, grid_map: GridMap, params: PaneFinderParams) -> None:
        self._grid_map, self._params = grid_map, params
        self._field: Optional[DistanceField] = None
        self._drives: List[_Drive] = []
        self._scans = 0

    def add(self, ready: PreparedReplay, step_done: Callable[[], None] = lambda: None) -> None:
        """Adds a log.

        Args:
            ready: the log and a filter on this map.
            step_done: called after each scan of the first reading.

        Raises:
            RecordingError: not one scan of the log can be used.
        """
        params, localizer = ready.settings.localizer, ready.localizer
        pane_use = dataclasses.replace(params.pane_use, find_panes=False)  # they are looked for below
        localizer.reconfigure(dataclasses.replace(params, pane_use=pane_use))
        if self._field is None:
            self._field = localizer.field if isinstance(localizer, Localizer) else DistanceField(self._grid_map)
        smoother = Smoother(self._field)
        ready.run(step_done, smoother.listen)
        limits, window = params.limits, ready.options.use.window
        self.add_drive(
            smoother,
            lambda: _scans(window.of(ready.recording), limits.laser_min_range, limits.laser_max_range),
            ready.recording.ground_truth,
        )

    def add_drive(
        self, smoother: Smoother, scans: Callable[[], Iterable[Scan]], truth: Optional[Trajectory] = None
    ) -> None:
        """A drive that a smoother listened to.

        Args:
            smoother: on this map.
            scans: reads its scans, from the first on.
            truth: map_from_base of a reference, where there is one.
        """
        self._scans += len(smoother)
        poses = smoother.smooth_sure(truth)
        if poses is not None:
            self._drives.append(_Drive(scans, smoother, truth, poses))

    def panes(self) -> List[Pane]:
        """All candidates, most probable first.

        Raises:
            NoUsablePose: no scan was taken at a trusted pose.
        """
        found, before_m = self._found(), 0.0
        for _ in range(_ROUNDS):
            believed = [pane for pane in found if pane.probability >= _BELIEVED]
            length_m = sum(pane.length_m for pane in believed)
            if length_m < before_m + _MIN_GROWTH_M or all(drive.smoother.is_sure for drive in self._drives):
                break
            self._smooth_again(believed)
            found, before_m = self._found(), length_m
        return found

    def _found(self) -> List[Pane]:
        """The panes found from all scans at their present poses."""
        finder = PaneFinder(self._grid_map, self._params)
        if not sum(_observed(drive, finder) for drive in self._drives):
            raise NoUsablePose(
                f"in none of {self._scans} scans was the pose certain enough (LOCALIZED) to learn about the map; "
                "nothing is drawn"
            )
        return finder.panes(anew=True)

    def _smooth_again(self, panes: Sequence[Pane]) -> None:
        """Smooths all drives again, on the map with these panes."""
        field = DistanceField(drawn_panes.drawn(self._grid_map, panes))
        for drive in self._drives:
            drive.poses = drive.smoother.smooth_sure(drive.truth, (field, drive.poses)) or drive.poses


def _observed(drive: _Drive, finder: PaneFinder) -> int:
    """How many scans of a drive the finder keeps."""
    return sum(finder.observe(scan, *drive.poses.at(scan.stamp_ns)) for scan in drive.scans())


def _scans(entries: Iterable[object], min_range_m: float, max_range_m: float) -> Iterator[Scan]:
    """The scans of a log; one that cannot be used was counted in the first reading."""
    for entry in entries:
        if isinstance(entry, Step):
            with contextlib.suppress(ScanError):
                yield entry.scan.limited(min_range_m, max_range_m)
