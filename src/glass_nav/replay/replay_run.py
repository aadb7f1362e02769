"""The loop of a replay: every scan of a recording through the filter. Drops nothing, uses no clock."""

from __future__ import annotations

import time
from collections import Counter
from contextlib import closing
from typing import Callable, Dict, List, Optional, Tuple

import numpy as np

from glass_nav.evaluation.metrics import case_scores, pose_errors
from glass_nav.evaluation.metrics.case_scores import CaseScores, SurfaceScores
from glass_nav.evaluation.metrics.replay_result import NO_BEAM, BeamExample, KeptScan, ReplayResult
from glass_nav.geometry import se2
from glass_nav.localization.localizer import Estimate
from glass_nav.localization.method import PoseFilter
from glass_nav.recording.read_ahead import read_ahead
from glass_nav.recording.recording import BeamTruth, Recording, RecordingError, Refusal, Step
from glass_nav.replay.window import Window
from glass_nav.sensing.scan import Scan, ScanError
from glass_nav.vocabulary import LocalizationState

EXAMPLES = 3  # scans whose beams are kept for the picture, spread over the log
WORST = 10  # scans kept that went worst, each from another part of the log
PARTS = 60  # of the log, so that they do not all show one moment


def run(
    recording: Recording,
    localizer: PoseFilter,
    start: Callable[[int], None],
    seed: int,
    window: Optional[Window] = None,
    step_done: Callable[[], None] = lambda: None,
    listen: Callable[[Step, Estimate], None] = lambda step, estimate: None,
) -> ReplayResult:
    """Replay a recording.

    Args:
        recording: the log.
        localizer: a fresh filter.
        start: called once with the stamp [ns] of the first scan, before it is used: places the particles.
        seed: what the filter's random numbers were seeded with; for the result.
        window: the part of the log, all of it when not given.
        step_done: called after each scan.
        listen: called with each scan that the filter took, and what it said of it.

    Raises:
        RecordingError: not one scan of the log can be used.
    """
    began = time.perf_counter()
    window = Window() if window is None else window
    rows: List[_Row] = []
    refusals: "Counter[str]" = Counter()
    scores = _Scores(recording, window.expected(len(recording), recording.duration_s))
    worst = _WorstScans(recording, window.expected(len(recording), recording.duration_s))
    with closing(read_ahead(window.of(recording))) as entries:
        for entry in entries:
            if isinstance(entry, Refusal):
                refusals[entry.reason] += 1
            else:
                try:
                    if not rows:
                        start(entry.scan.stamp_ns)
                    before = time.process_time()
                    estimate = localizer.update(entry.scan, entry.odom_from_base)
                    estimate.report  # noqa: B018 - the cases are part of what the filter costs here
                    cpu_ms = 1e3 * (time.process_time() - before)
                    worst.take(len(rows), entry.scan, estimate)
                    rows.append(_Row(entry.odom_from_base, estimate, cpu_ms, scores.take(entry.scan, estimate)))
                    listen(entry, estimate)
                except ScanError as err:
                    refusals[err.reason] += 1
            step_done()
    if not rows:
        raise RecordingError(f"{recording.name}: {_nothing_usable(refusals)}")
    return _result(rows, refusals, recording, scores, worst.kept(), time.perf_counter() - began, seed)


class _Scores:
    """Scores of cases and scan_surfaces against the true beams, where the log has them."""

    def __init__(self, recording: Recording, expected_scans: int) -> None:
        self.cases: Optional[CaseScores] = None  # None: no truth
        self.surfaces: Optional[SurfaceScores] = None
        self.examples: List[BeamExample] = []
        self._recording = recording
        self._rest = iter(() if recording.beam_truth is None else recording.beam_truth)
        self._next = next(self._rest, None)
        self._scans = 0
        self._example_at = [int((number + 0.5) / EXAMPLES * expected_scans) for number in range(EXAMPLES)]

    def take(self, scan: Scan, estimate: Estimate) -> Optional[np.ndarray]:
        """Score one scan; its true cases (B,), None where there are none. Both go by ascending stamps."""
        self._scans += 1
        while self._next is not None and self._next.stamp_ns < scan.stamp_ns:
            self._next = next(self._rest, None)
        if self._next is None or self._next.stamp_ns != scan.stamp_ns:
            return None
        truth = self._next
        if len(truth.case) != len(scan):
            raise RecordingError(
                f"{self._recording.name}: the truth at {scan.stamp_ns * 1e-9:.3f} s is about "
                f"{len(truth.case)} beams, the scan has {len(scan)}"
            )
        found = case_scores.of_cases(truth.case, estimate.cases.case, scan.answered)
        self.cases = found if self.cases is None else self.cases + found
        if truth.crossing_m is not None:
            cut = estimate.surface_scan
            surfaces = case_scores.of_surfaces(truth.crossing_m, scan.as_measured(cut.ranges_m), cut.cut, cut.trusted)
            self.surfaces = surfaces if self.surfaces is None else self.surfaces + surfaces
        if self._example_at and self._scans > self._example_at[0]:
            del self._example_at[0]
            self.examples.append(_example(scan, estimate, truth))
        return truth.case


class _WorstScans:
    """The worst scan of each part of the log: largest error, or least reliable without a ground truth. One part of it is in
    memory at a time: all scans of a long log would not fit.
    """

    def __init__(self, recording: Recording, expected_scans: int) -> None:
        self._reference = recording.ground_truth
        self._expected = max(expected_scans, 1)
        self._of_part: Dict[int, Tuple[Tuple[bool, float], KeptScan]] = {}

    def take(self, row: int, scan: Scan, estimate: Estimate) -> None:
        """Look at one scan."""
        errors = pose_errors.of(np.array([estimate.stamp_ns]), estimate.map_from_base[None], self._reference)
        # Poses during a search are not relied on: such scans come last.
        bad = (
            estimate.state not in (LocalizationState.UNKNOWN, LocalizationState.GLOBAL_SEARCH),
            float(errors.position_m[0]) if errors.matched[0] else 1.0 - estimate.confidence,
        )
        part = row * PARTS // self._expected
        if part not in self._of_part or bad > self._of_part[part][0]:
            self._of_part[part] = bad, KeptScan(row, scan.base_from_laser, scan.points_in_base())

    def kept(self) -> List[KeptScan]:
        """The worst of all parts, the worst first."""
        ordered = sorted(self._of_part.values(), key=lambda each: each[0], reverse=True)
        return [kept for _, kept in ordered[:WORST]]


def _example(scan: Scan, estimate: Estimate, truth: BeamTruth) -> BeamExample:
    map_from_laser = se2.compose(estimate.map_from_base, scan.base_from_laser)
    return BeamExample(
        scan.stamp_ns,
        map_from_laser[:2],
        se2.transform_points(estimate.map_from_base, scan.points_in_base()),
        truth.case,
        estimate.cases.case,
    )


class _Row:
    """The data kept of one scan; without the particles, since a long log would not fit into memory."""

    def __init__(
        self, odom_from_base: np.ndarray, estimate: Estimate, cpu_ms: float, true_case: Optional[np.ndarray]
    ) -> None:
        self.odom_from_base, self.cpu_ms = odom_from_base, cpu_ms
        self.stamp_ns, self.map_from_base = estimate.stamp_ns, estimate.map_from_base
        self.covariance, self.levels = estimate.covariance, estimate.levels
        self.state, self.reason = estimate.state, estimate.reason
        self.used_share, self.updated = estimate.inlier_ratio, estimate.updated
        self.reliability, self.places = estimate.confidence, estimate.places
        self.particles, self.case, self.true_case = len(estimate.particles), estimate.cases.case, true_case


def _nothing_usable(refusals: "Counter[str]") -> str:
    if not refusals:
        return "no scan in the part to be replayed"
    most = "; ".join(f"{count} times: {reason}" for reason, count in refusals.most_common(3))
    return f"none of its {sum(refusals.values())} scans can be used; {most}"


def _result(
    rows: List[_Row],
    refusals: "Counter[str]",
    recording: Recording,
    scores: _Scores,
    worst: List[KeptScan],
    wall_s: float,
    seed: int,
) -> ReplayResult:
    cases = np.full((len(rows), max(len(row.case) for row in rows)), NO_BEAM, np.uint8)
    true_cases = None if scores.cases is None else cases.copy()
    for index, row in enumerate(rows):
        cases[index, : len(row.case)] = row.case
        if true_cases is not None and row.true_case is not None:
            true_cases[index, : len(row.true_case)] = row.true_case
    return ReplayResult(
        stamps_ns=np.array([row.stamp_ns for row in rows], np.int64),
        map_from_base=np.array([row.map_from_base for row in rows], float),
        odom_from_base=np.array([row.odom_from_base for row in rows], float),
        covariance=np.array([row.covariance for row in rows], float),
        level_95=np.array([row.levels.p95 for row in rows], float),
        level_999=np.array([row.levels.p999 for row in rows], float),
        states=[row.state for row in rows],
        reasons=[row.reason for row in rows],
        used_share=np.array([row.used_share for row in rows], float),
        updated=np.array([row.updated for row in rows], bool),
        particles=np.array([row.particles for row in rows], int),
        reliability=np.array([row.reliability for row in rows], float),
        places=np.array([row.places for row in rows], int),
        cpu_ms=np.array([row.cpu_ms for row in rows], float),
        cases=cases,
        refusals=refusals,
        reference=recording.ground_truth,
        wall_s=wall_s,
        seed=seed,
        true_cases=true_cases,
        case_scores=scores.cases,
        surface_scores=scores.surfaces,
        examples=scores.examples,
        worst=worst,
    )
