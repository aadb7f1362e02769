"""Several contestants, each run over the same logs with several seeds: figures side by side, with confidence.

A contestant is a set of parameters, or poses of another localizer in the log. S scans of a run.
"""

from __future__ import annotations

import csv
import hashlib
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np

from glass_nav.evaluation.metrics import confidence, integrity_scores, pose_errors, relative_errors, replay_result
from glass_nav.evaluation.metrics.confidence import Interval
from glass_nav.evaluation.metrics.integrity_scores import IntegrityTrace
from glass_nav.evaluation.metrics.pose_errors import PoseErrors
from glass_nav.evaluation.metrics.replay_result import ReplayResult
from glass_nav.evaluation.metrics.thresholds import Threshold
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.vocabulary import LocalizationState


@dataclass(frozen=True)
class Figure:
    """One column of the comparison."""

    name: str  # in runs.csv and compare.json
    title: str
    unit: str
    scale: float  # from the value to what is shown
    digits: int
    better: int  # -1: less is better, 1: more, 0: neither
    timing: bool = False  # of the computer, not of the answer


FIGURES = (
    Figure("position_mean_m", "position error, mean", "m", 1.0, 4, -1),
    Figure("position_rmse_m", "position error, rms", "m", 1.0, 4, -1),
    Figure("position_p95_m", "position error, 95 %", "m", 1.0, 4, -1),
    Figure("yaw_mean_deg", "yaw error, mean", "deg", 1.0, 3, -1),
    Figure("aligned_rmse_m", "position error after alignment, rms", "m", 1.0, 4, -1),
    Figure("relative_1m_rmse_m", "relative error over 1 m, rms", "m", 1.0, 4, -1),
    Figure("relative_1m_yaw_rmse_deg", "relative yaw over 1 m, rms", "deg", 1.0, 3, -1),
    Figure("relative_1s_rmse_m", "relative error over 1 s, rms", "m", 1.0, 4, -1),
    Figure("relative_1s_yaw_rmse_deg", "relative yaw over 1 s, rms", "deg", 1.0, 3, -1),
    Figure("lost_share", "more than 0.5 m off", "%", 100.0, 3, -1),
    Figure("localized_share", "reports LOCALIZED", "%", 100.0, 2, 1),
    Figure("misleading_share", "misleading", "%", 100.0, 2, -1),
    Figure("misleading_max_s", "misleading, longest", "s", 1.0, 1, -1),
    Figure("misleading_max_m", "misleading, longest", "m", 1.0, 2, -1),
    Figure("nees_median", "NEES, median (consistent: 2.4)", "-", 1.0, 2, 0),
    Figure("alarm_share", "false alarms", "%", 100.0, 2, -1),
    Figure("level_ratio", "99.9 % level over error", "-", 1.0, 1, 0),
    Figure("time_to_alarm_s", "time to alarm, longest", "s", 1.0, 1, -1),
    Figure("time_back_s", "time back, longest", "s", 1.0, 1, -1),
    Figure("case_accuracy", "beam cases right", "%", 100.0, 3, 1),
    Figure("apart_mean_m", "distance from the first", "m", 1.0, 4, 0),
    Figure("cpu_ms_per_scan", "CPU per scan", "ms", 1.0, 1, -1, timing=True),
)
BY_NAME = {figure.name: figure for figure in FIGURES}


@dataclass(frozen=True)
class Run:
    """One run of a contestant over a log."""

    contestant: str
    log: str
    seed: Optional[int]  # None: nothing random, recorded poses
    stamps_ns: np.ndarray  # (S,) int64, ascending
    map_from_base: np.ndarray  # (S, 3)
    errors: PoseErrors  # (S,)
    states: Optional[List[str]]  # S of them; None: it says nothing of itself
    case_accuracy: Optional[float]  # of all scans; None: no truth about the beams
    cpu_ms: Optional[np.ndarray]  # (S,)
    wall_s: float
    reference: Optional[Trajectory] = None  # map_from_base
    integrity: Optional[IntegrityTrace] = None  # of the S scans; None: none reported

    @property
    def sha256(self) -> str:
        """Hash of every bit of the trajectory: equal runs have equal hashes."""
        digest = hashlib.sha256(np.ascontiguousarray(self.stamps_ns, "<i8").tobytes())
        digest.update(np.ascontiguousarray(self.map_from_base, "<f8").tobytes())
        return digest.hexdigest()


def run_of(contestant: str, log: str, result: ReplayResult, case_accuracy: Optional[float]) -> Run:
    """A replay as a run."""
    return Run(
        contestant,
        log,
        result.seed,
        result.stamps_ns,
        result.map_from_base,
        result.errors,
        result.states,
        case_accuracy,
        result.cpu_ms,
        result.wall_s,
        result.reference,
        result.integrity,
    )


@dataclass(frozen=True)
class Comparison:
    """Runs on the logs that every contestant has run on; each figure over the scans that all runs of a log have."""

    contestants: List[str]  # the first is what the others are compared with
    logs: List[str]
    runs: List[Run]
    scans: Dict[str, int]  # by log: how many are compared
    figures: List[Figure]  # that some run has
    notes: List[str]  # what was left out, a line each
    _values: Dict[Tuple[str, str, Optional[int]], Dict[str, float]]

    def value(self, run: Run, figure: Figure) -> float:
        """NaN: not known."""
        return self._values[run.contestant, run.log, run.seed][figure.name]

    def values(self, contestant: str, figure: Figure, log: str) -> np.ndarray:
        """(N,) of its runs that know it, by seed."""
        found = np.array([self.value(run, figure) for run in self.runs_of(contestant, log)])
        return found[~np.isnan(found)]

    def runs_of(self, contestant: str, log: str) -> List[Run]:
        return [run for run in self.runs if (run.contestant, run.log) == (contestant, log)]

    def interval(self, contestant: str, figure: Figure, log: Optional[str] = None) -> Optional[Interval]:
        """The mean over seeds of one log, or of all; None: not known in all of them.

        Recorded poses have one value a log, and no interval.
        """
        strata = [self.values(contestant, figure, each) for each in (self.logs if log is None else [log])]
        return confidence.of_strata(strata) if all(map(len, strata)) else None

    def difference(self, contestant: str, figure: Figure, log: Optional[str] = None) -> Optional[Interval]:
        """Its mean minus that of the first contestant, seed by seed where both ran the same seeds."""
        logs = self.logs if log is None else [log]
        groups: List[Tuple[float, np.ndarray]] = []
        for each in logs:
            found = self._difference_groups(contestant, figure, each)
            if not found:
                return None
            groups += [(weight / len(logs), values) for weight, values in found]
        with np.errstate(invalid="ignore"):
            return confidence.of_sum(groups)

    def _difference_groups(self, contestant: str, figure: Figure, log: str) -> "List[Tuple[float, np.ndarray]]":
        """Weights and values of one log, whose sum of means is the difference; empty if unknown."""
        ours, first = (
            {run.seed: self.value(run, figure) for run in self.runs_of(each, log)}
            for each in (contestant, self.contestants[0])
        )
        pairs = seed_pairs(list(ours), list(first))
        if pairs:
            with np.errstate(invalid="ignore"):
                values = np.array([ours[a] - first[b] for a, b in pairs])
            return [(1.0, values[~np.isnan(values)])] if (~np.isnan(values)).any() else []
        groups = [(1.0, self.values(contestant, figure, log)), (-1.0, self.values(self.contestants[0], figure, log))]
        return groups if all(len(values) for _, values in groups) else []


def seed_pairs(
    ours: Sequence[Optional[int]], first: Sequence[Optional[int]]
) -> "List[Tuple[Optional[int], Optional[int]]]":
    """Which run belongs to which: equal seeds; a run without a seed belongs to every other."""
    if None in ours:
        return [(None, seed) for seed in first]
    if None in first:
        return [(seed, None) for seed in ours]
    return [(seed, seed) for seed in ours if seed in set(first)]


def of(runs: Sequence[Run], contestants: Sequence[str], logs: Sequence[str]) -> Comparison:
    """Compare runs; contestants and logs give the order.

    Raises:
        ValueError: no log that all have run on, or no scan that all runs of a log have.
    """
    ran = {contestant: {run.log for run in runs if run.contestant == contestant} for contestant in contestants}
    common = [log for log in logs if all(log in ran[contestant] for contestant in contestants)]
    if not common:
        raise ValueError(
            "there is no log that all have run on: "
            + "; ".join(f"{contestant} on {', '.join(sorted(each)) or 'none'}" for contestant, each in ran.items())
        )
    notes = [
        f"{log} left out: no run of {', '.join(name for name in contestants if log not in ran[name])}"
        for log in logs
        if log not in common
    ]
    kept = [run for run in runs if run.log in common]
    scans: Dict[str, int] = {}
    values: Dict[Tuple[str, str, Optional[int]], Dict[str, float]] = {}
    for log in common:
        of_log = [run for run in kept if run.log == log]
        stamps_ns = _common_stamps(of_log, log)
        scans[log], most = len(stamps_ns), max(len(np.unique(run.stamps_ns)) for run in of_log)
        if scans[log] < most:
            notes.append(f"{log}: compared over the {scans[log]} of {most} scans that all runs have a pose for")
        for run in of_log:
            key = run.contestant, run.log, run.seed
            if key in values:
                raise ValueError(f"two runs of {run.contestant} over {log} have the seed {run.seed}")
            values[key] = _values(run, stamps_ns, [each for each in of_log if each.contestant == contestants[0]])
    figures = [figure for figure in FIGURES if any(not math.isnan(each[figure.name]) for each in values.values())]
    return Comparison(list(contestants), common, kept, scans, figures, notes, values)


def _common_stamps(runs: Sequence[Run], log: str) -> np.ndarray:
    stamps_ns = np.unique(runs[0].stamps_ns)
    for run in runs[1:]:
        stamps_ns = np.intersect1d(stamps_ns, run.stamps_ns)
    if not len(stamps_ns):
        raise ValueError(f"{log}: there is no scan that all its runs have a pose for")
    return stamps_ns


def _values(run: Run, stamps_ns: np.ndarray, first: Sequence[Run]) -> Dict[str, float]:
    """The figures of a run over those scans; NaN: unknown, inf: a pose was not finite."""
    used = np.isin(run.stamps_ns, stamps_ns)
    summary = pose_errors.summary(PoseErrors(run.errors.position_m[used], run.errors.yaw_rad[used]))
    absent = math.nan if not run.errors.matched[used].any() else math.inf  # summary() has None for both
    found = {name: absent if value is None else value for name, value in summary.items()}
    relative = relative_errors.summary(run.stamps_ns[used], run.map_from_base[used], run.reference)
    found.update((name, math.nan if value is None else value) for name, value in relative.items())
    states = None if run.states is None else np.array(run.states)[used]
    pairs = seed_pairs([run.seed], [each.seed for each in first])
    apart = [_apart_m(run, each, stamps_ns) for each in first if (run.seed, each.seed) in pairs]
    is_first = any(each is run for each in first)
    found["apart_mean_m"] = math.nan if is_first or not apart else float(np.mean(apart))
    found["localized_share"] = math.nan if states is None else float((states == LocalizationState.LOCALIZED).mean())
    found.update(_integrity(run, used))
    found["case_accuracy"] = math.nan if run.case_accuracy is None else run.case_accuracy
    found["cpu_ms_per_scan"] = math.nan if run.cpu_ms is None else float(run.cpu_ms[used].mean())
    return {figure.name: found[figure.name] for figure in FIGURES}


def _integrity(run: Run, used: np.ndarray) -> Dict[str, float]:
    """Integrity figures of those scans; infinite: the awaited event did not happen."""
    if run.integrity is None:
        return dict.fromkeys(integrity_scores.METRICS, math.nan)
    claims = run.integrity.part(used)
    never = math.inf if claims.matched.any() else math.nan
    return {
        name: (never if name in integrity_scores.NEVER else math.nan) if value is None else value
        for name, value in integrity_scores.summary(claims).items()
    }


def _apart_m(one: Run, other: Run, stamps_ns: np.ndarray) -> float:
    a, b = (run.map_from_base[np.searchsorted(run.stamps_ns, stamps_ns), :2] for run in (one, other))
    return float(np.hypot(*(a - b).T).mean())


def text(figure: Figure, interval: Optional[Interval], signed: bool = False) -> str:
    """0.147 ± 0.004, in the figure's unit."""
    if interval is None or math.isnan(interval.mean):
        return "–"
    if math.isinf(interval.mean):
        return "infinite"
    sign, digits = "+" if signed else "", figure.digits
    width = interval.half_width
    if width and figure.scale * width >= 10.0 ** -(digits + 2):  # as many digits as show the first one of the interval
        digits = max(digits, -math.floor(math.log10(figure.scale * width)))
    shown = round(figure.scale * interval.mean, digits) or 0.0  # no minus before a zero
    mean = f"{shown:{sign}.{digits}f}"
    return mean if width is None else f"{mean} ± {figure.scale * width:.{digits}f}"


def judged(figure: Figure, difference: Optional[Interval]) -> str:
    """A difference to the first contestant in words."""
    if figure.better == 0 or difference is None or difference.half_width is None:
        return ""
    if difference == Interval(0.0, 0.0):
        return "equal"
    return {0: "not significantly different", figure.better: "better", -figure.better: "worse"}[difference.sign]


def difference_text(comparison: Comparison, contestant: str, figure: Figure, log: Optional[str] = None) -> str:
    """-0.012 ± 0.004 better."""
    if figure.better == 0:
        return ""
    difference = comparison.difference(contestant, figure, log)
    return f"{text(figure, difference, signed=True)} {judged(figure, difference)}".rstrip()


def failures(comparison: Comparison, limits: Sequence[Threshold]) -> List[str]:
    """A line on each contestant and limit that its mean over all logs and seeds misses.

    Raises:
        ValueError: no contestant has such a figure: the comparison can neither fail nor pass.
    """
    found: List[str] = []
    for limit in limits:
        figure = BY_NAME[limit.metric]
        means = {
            name: interval.mean
            for name in comparison.contestants
            if (interval := comparison.interval(name, figure)) is not None
        }
        if not means:
            raise ValueError(
                f"--fail-if {limit}: no contestant has {limit.metric}; the logs have no ground truth or "
                "no true cases for it, or there is nothing to compare with"
            )
        found += [
            f"{limit.metric} of {name} is {mean:.4g}: failed by --fail-if {limit}"
            for name, mean in means.items()
            if limit.is_missed_by(mean)
        ]
    return found


def counted(comparison: Comparison) -> str:
    """What there is, in words."""

    def many(count: int, what: str) -> str:
        return f"{count} {what}" if count == 1 else f"{count} {what}s"

    return (
        f"{many(len(comparison.runs), 'run')} over {many(len(comparison.logs), 'log')}, "
        f"{many(sum(comparison.scans.values()), 'scan')} compared"
    )


def write(comparison: Comparison, folder: Path, about: Mapping[str, Any]) -> None:
    """runs.csv, a row per run, and compare.json, means and intervals: the same bit for bit however it was run. The
    times it took are in timings.csv.
    """
    figures = [figure for figure in comparison.figures if not figure.timing]
    with (folder / "runs.csv").open("w", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(
            [
                "log",
                "contestant",
                "seed",
                "scans",
                "scans_compared",
                *(each.name for each in figures),
                "trajectory_sha256",
            ]
        )
        for run in comparison.runs:
            rows.writerow(
                [
                    run.log,
                    run.contestant,
                    _seed(run),
                    len(run.stamps_ns),
                    comparison.scans[run.log],
                    *(_cell(comparison.value(run, figure)) for figure in figures),
                    run.sha256,
                ]
            )
    with (folder / "timings.csv").open("w", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["log", "contestant", "seed", "wall_s", "cpu_ms_per_scan"])
        for run in comparison.runs:
            cpu_ms = comparison.value(run, BY_NAME["cpu_ms_per_scan"])
            rows.writerow([run.log, run.contestant, _seed(run), f"{run.wall_s:.3f}", _cell(cpu_ms)])
    replay_result.write_json(
        folder / "compare.json",
        {
            **about,
            "level": confidence.LEVEL,
            "contestants": comparison.contestants,
            "logs": comparison.logs,
            "scans_compared": comparison.scans,
            "notes": comparison.notes,
            "means": {
                name: {
                    "all": _all(comparison, name, None, figures),
                    **{log: _all(comparison, name, log, figures) for log in comparison.logs},
                }
                for name in comparison.contestants
            },
        },
    )


def _all(comparison: Comparison, contestant: str, log: Optional[str], figures: Sequence[Figure]) -> Dict[str, Any]:
    found: Dict[str, Any] = {}
    for figure in figures:
        both = comparison.interval(contestant, figure, log), comparison.difference(contestant, figure, log)
        found[figure.name] = {
            name: None if each is None else {"mean": each.mean, "half_width": each.half_width}
            for name, each in zip(("value", "minus_first"), both)
        }
    return found


def _seed(run: Run) -> str:
    return "" if run.seed is None else str(run.seed)


def _cell(value: float) -> str:
    return "" if math.isnan(value) else repr(float(value))
