"""Limits on the figures of a run, for CI: `position_p95_m>0.3` fails a run that is worse."""

from __future__ import annotations

import math
import operator
import re
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, Callable, Dict, Mapping, Optional, Sequence

from glass_nav.evaluation.metrics import integrity_scores, pose_errors, relative_errors
from glass_nav.vocabulary import BeamCase, LocalizationState

COMPARISONS: "Dict[str, Callable[[float, float], bool]]" = {
    ">=": operator.ge,
    "<=": operator.le,
    ">": operator.gt,
    "<": operator.lt,
}
KNOWN = (
    *pose_errors.METRICS,
    *relative_errors.METRICS,
    *integrity_scores.METRICS,
    "scans",
    "scans_refused",
    "updates",
    "scans_without_ground_truth",
    "cpu_ms_per_scan",
    "cpu_ms_per_update",
    "log_duration_s",
    "wall_s",
    "times_real_time",
    *(f"state_share.{state}" for state in LocalizationState),
    *(f"case_share.{case.value}" for case in BeamCase),
    "cases.accuracy",
    "cases.accuracy_answered",
    "cases.macro_f1",
    "cases.used_share",
    "scan_surfaces.cut_at_pane_share",
    "scan_surfaces.cut_wrongly_share",
    "scan_surfaces.trusted_share",
    *(
        f"topology.{figure}"
        for figure in ("passed", "seen", "missed", "invented", "degree_right", "seen_share", "degree_right_share")
    ),
)


@dataclass(frozen=True)
class Threshold:
    """A run fails if the comparison holds."""

    metric: str
    comparison: str
    limit: float

    def __str__(self) -> str:
        return f"{self.metric} {self.comparison} {self.limit:g}"

    def is_missed_by(self, value: float) -> bool:
        """Whether such a figure fails the run."""
        return COMPARISONS[self.comparison](value, self.limit)

    def failure(self, metrics: Mapping[str, Any]) -> Optional[str]:
        """The line on a run that fails; None for one that does not.

        Args:
            metrics: of the run, as ReplayResult.metrics() has them.

        Raises:
            ValueError: the run has no such figure (no ground truth, no true cases): it can neither fail nor pass.
        """
        value = _value(metrics, self.metric)
        if value is None:
            raise ValueError(
                f"--fail-if {self}: this log gives no {self.metric}; it has no ground truth or no true "
                "cases for it, or --topology was not given"
            )
        if not self.is_missed_by(value):
            return None
        return f"{self.metric} is {value:.4g}: failed by --fail-if {self}"


def parse(text: str, known: Sequence[str] = KNOWN) -> Threshold:
    """`metric>limit`, with >, <, >= or <=.

    Args:
        text: as given.
        known: the metrics that there may be.

    Raises:
        ValueError: another form, or a metric that is not known; one line that lists what there is.
    """
    match = re.match(r"^\s*([\w.]+)\s*(>=|<=|>|<)\s*(\S+)\s*$", text)
    limit = math.nan
    if match is not None:
        try:
            limit = float(match.group(3))
        except ValueError:
            pass
    if match is None or not math.isfinite(limit):
        raise ValueError(
            f"--fail-if must be METRIC, one of {' '.join(COMPARISONS)}, and a number, such as "
            f"position_p95_m>0.3, got {text!r}"
        )
    metric = match.group(1)
    if metric not in known:
        near = get_close_matches(metric, known, n=1)
        hint = f"; did you mean {near[0]}?" if near else "."
        raise ValueError(f"--fail-if: unknown metric {metric!r}{hint} Known: {', '.join(known)}")
    return Threshold(metric, match.group(2), limit)


def _value(metrics: Mapping[str, Any], name: str) -> Optional[float]:
    """A figure by its dotted name; a state or case that did not occur has the share 0."""
    group, _, inner = name.partition(".")
    value = metrics.get(group)
    if inner and value is not None:
        value = value.get(inner, 0.0 if group in ("state_share", "case_share") else None)
    if (
        value is None
        and name in (*pose_errors.METRICS, *integrity_scores.NEVER)
        and metrics.get("scans_without_ground_truth", metrics["scans"]) is not None
    ):
        matched = metrics["scans"] - metrics["scans_without_ground_truth"]
        return math.inf if matched else None  # JSON has no number for infinity
    return None if value is None else float(value)
