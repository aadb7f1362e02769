"""Writes the output of the filter into the bag of `glass_nav replay --bag`."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from typing import Callable, Iterator

from glass_nav.evaluation.plots import legend
from glass_nav.localization.beam_classification import beam_cloud
from glass_nav.localization.beam_classification.beam_shapes import beam_shapes
from glass_nav.localization.beam_classification.wall_shapes import wall_shapes
from glass_nav.localization.localizer import Estimate
from glass_nav.localization.method import PoseFilter
from glass_nav.localization.place_shapes import place_shapes
from glass_nav.localization.status_text import status_text
from glass_nav.recording.recording import Recording, Step
from glass_nav.recording.result_bag import ResultBag
from glass_nav.world.grid_map import GridMap

MARKERS_PERIOD_NS = 200_000_000  # as many as an eye needs: they are large
GLASS_PERIOD_NS = 30_000_000_000  # a map is large


@contextmanager
def listener(
    path: Path, recording: Recording, localizer: PoseFilter, grid_map: GridMap
) -> "Iterator[Callable[[Step, Estimate], None]]":
    """What replay_run.run() calls with each scan; the bag is there when the block has ended without an error.

    Raises:
        RecordingError: the bag cannot be written; one line.
    """
    with ResultBag(path, ("map", recording.odom_frame, recording.base_frame)) as bag:
        writer = _Writer(bag, recording, localizer, grid_map)
        yield writer.take
        writer.end()


class _Writer:
    def __init__(self, bag: ResultBag, recording: Recording, localizer: PoseFilter, grid_map: GridMap) -> None:
        self._bag, self._truth, self._localizer, self._grid_map = bag, recording.ground_truth, localizer, grid_map
        self._glass_ns = self._last_ns = self._markers_ns = -1

    def take(self, step: Step, estimate: Estimate) -> None:
        """Writes everything about one scan."""
        bag, scan, cases, stamp_ns = self._bag, step.scan, estimate.cases, estimate.stamp_ns
        if self._last_ns < 0:
            bag.begin(stamp_ns, self._grid_map)
            bag.legend(stamp_ns, legend.draw())
            self._glass_ns = stamp_ns
        self._last_ns = stamp_ns
        bag.transforms(stamp_ns, estimate.map_from_odom, step.odom_from_base)
        bag.scan(
            scan,
            scan.as_measured(estimate.surface_scan.ranges_m),
            cases.case,
            scan.as_measured(cases.expected_m),
            cases.residual_m,
            cases.weight,
        )
        bag.cloud(stamp_ns, beam_cloud.FIELDS, beam_cloud.points(scan, cases))
        bag.status(
            stamp_ns,
            estimate.state,
            estimate.reason,
            estimate.inlier_ratio,
            estimate.confidence,
            estimate.levels.p95,
            estimate.levels.p999,
        )
        if stamp_ns - self._markers_ns >= MARKERS_PERIOD_NS:
            self._markers_ns = stamp_ns
            self._send_markers(step, estimate)
        if estimate.updated:
            bag.pose(stamp_ns, estimate.map_from_base, estimate.covariance, estimate.particles)
        if self._truth is not None and bool(self._truth.covers(stamp_ns)):
            bag.truth(stamp_ns, self._truth.at(stamp_ns))
        if stamp_ns - self._glass_ns >= GLASS_PERIOD_NS:
            self._send_glass()

    def end(self) -> None:
        """The glass map as it was learnt in the end."""
        if self._last_ns >= 0:
            self._send_glass()

    def _send_markers(self, step: Step, estimate: Estimate) -> None:
        """The beams by case, the places of a global search, and the state in words."""
        words = status_text(estimate.map_from_base, estimate.state, estimate.reason, estimate.inlier_ratio)
        self._bag.beam_markers(
            estimate.stamp_ns,
            beam_shapes(step.scan, estimate.cases, estimate.surface_scan, 0.0),
            [*place_shapes(estimate.state, estimate.particles), words],
        )

    def _send_glass(self) -> None:
        self._glass_ns = self._last_ns
        glass = self._localizer.glass_map.occupancy()
        self._bag.glass_map(self._last_ns, self._grid_map, glass)
        self._bag.wall_markers(self._last_ns, wall_shapes(self._grid_map, glass, self._localizer.unmapped_panes))
