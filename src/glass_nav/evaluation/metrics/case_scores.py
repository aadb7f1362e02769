"""Scores cases and scan_surfaces against the ground truth of a simulator: confusion matrix, precision, recall.

Cases 0..4 as in msg/BeamCases, B beams. Scores are counts, so that those of scans and of runs add up;
figures are None where nothing was counted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, Optional

import numpy as np

from glass_nav.vocabulary import BeamCase

CASES = len(BeamCase)
MIN_SHARE = 0.01  # of all beams; a case that is rarer counts in no macro F1
NEAR_M = 0.15  # a beam cut that near the pane shows a costmap where it is


@dataclass(frozen=True)
class CaseScores:
    """How often beams of one case were reported as another."""

    confusion: np.ndarray  # (5, 5) int64 beams: rows the true case, columns the reported one
    answered: np.ndarray  # (5, 5) int64 of them the beams that came back with a range

    def __add__(self, other: "CaseScores") -> "CaseScores":
        return CaseScores(self.confusion + other.confusion, self.answered + other.answered)

    def metrics(self) -> Dict[str, Any]:
        """The figures under the names of metrics.json, lists by case 0..4."""
        right, total = np.diag(self.confusion), int(self.confusion.sum())
        true, reported = self.confusion.sum(axis=1), self.confusion.sum(axis=0)
        f1 = [_share(2 * hit, here + there) for hit, here, there in zip(right, true, reported)]
        present = [case for case in range(CASES) if true[case] and true[case] >= MIN_SHARE * total]
        return {
            "beams": total,
            "beams_answered": int(self.answered.sum()),
            "accuracy": _share(right.sum(), total),
            "accuracy_answered": _share(np.diag(self.answered).sum(), self.answered.sum()),
            "macro_f1": float(np.mean([f1[case] or 0.0 for case in present])) if present else None,
            "macro_f1_cases": present,
            "precision": [_share(hit, there) for hit, there in zip(right, reported)],
            "recall": [_share(hit, here) for hit, here in zip(right, true)],
            "f1": f1,
            "true_share": [_share(here, total) for here in true],
            "told_share": [_share(there, total) for there in reported],
            "used_share": _share(self.answered[:, 1:].sum(), self.answered.sum()),
            "confusion": self.confusion.tolist(),
        }


@dataclass(frozen=True)
class SurfaceScores:
    """Whether scan_surfaces ends beams at the panes that they went through or were mirrored at, and no others."""

    at_pane: int = 0  # beams that passed, or were mirrored at, a pane of the map
    at_pane_cut: int = 0  # of them cut
    at_pane_cut_near: int = 0  # and that within NEAR_M of the pane
    others: int = 0  # all other beams
    others_cut: int = 0
    scans: int = 0
    scans_trusted: int = 0  # the pose was good enough to cut anything

    def __add__(self, other: "SurfaceScores") -> "SurfaceScores":
        return SurfaceScores(*(ours + theirs for ours, theirs in zip(vars(self).values(), vars(other).values())))

    def metrics(self) -> Dict[str, Any]:
        """The figures under the names of metrics.json."""
        return {
            **vars(self),
            "cut_at_pane_share": _share(self.at_pane_cut_near, self.at_pane),
            "cut_wrongly_share": _share(self.others_cut, self.others),
            "trusted_share": _share(self.scans_trusted, self.scans),
        }


def none_yet() -> CaseScores:
    """Empty scores, to add to."""
    return CaseScores(np.zeros((CASES, CASES), np.int64), np.zeros((CASES, CASES), np.int64))


def of_cases(true: np.ndarray, reported: np.ndarray, answered: np.ndarray) -> CaseScores:
    """Scores of beams of any shape.

    Args:
        true, reported: (...) uint8 cases 0..4.
        answered: (...) bool, the beam came back with a range.

    Raises:
        ValueError: shapes that differ, or a case that there is not.
    """
    true, reported = np.asarray(true), np.asarray(reported)
    if not true.shape == reported.shape == np.shape(answered):
        raise ValueError(
            f"expected as many true as reported cases and answers, got {true.shape}, {reported.shape}, {np.shape(answered)}"
        )
    for name, cases in (("true", true), ("reported", reported)):
        if cases.size and not (cases.min() >= 0 and cases.max() < CASES):
            raise ValueError(f"{name} cases must be 0 to {CASES - 1}, got {int(cases.min())} to {int(cases.max())}")
    pair = CASES * true.astype(np.int64) + reported
    return CaseScores(_counts(pair), _counts(pair[np.asarray(answered, bool)]))


def of_surfaces(crossing_m: np.ndarray, ranges_m: np.ndarray, cut: np.ndarray, trusted: bool) -> SurfaceScores:
    """Scores of one scan of scan_surfaces.

    Args:
        crossing_m: (B,) true range of the pane that the beam passed or was mirrored at, NaN for neither.
        ranges_m: (B,) as in scan_surfaces.
        cut: (B,) bool, the range was shortened.
        trusted: the pose was good enough to cut.
    """
    at_pane, cut = np.isfinite(crossing_m), np.asarray(cut, bool)
    with np.errstate(invalid="ignore"):
        near = np.abs(ranges_m - crossing_m) <= NEAR_M
    return SurfaceScores(
        int(at_pane.sum()),
        int((at_pane & cut).sum()),
        int((at_pane & cut & near).sum()),
        int((~at_pane).sum()),
        int((~at_pane & cut).sum()),
        1,
        int(trusted),
    )


def _counts(pair: np.ndarray) -> np.ndarray:
    return np.bincount(pair.ravel(), minlength=CASES**2).reshape(CASES, CASES).astype(np.int64)


def _share(part: Any, whole: Any) -> Optional[float]:
    return float(part) / float(whole) if whole else None
