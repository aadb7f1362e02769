"""Which beams of a scan support the pose, and which contradict it.

A beam supports the pose if a case explains it. It contradicts the pose if it ended in front of all mapped surfaces,
or behind a surface that lets no beam pass. A beam that ended in unmapped space, in an unmapped room or outdoors, is
no evidence, unless it crossed an opaque wall. B beams.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glass_nav import _beam_vote
from glass_nav.localization.beam_classification.expected_ranges import ExpectedRanges


@dataclass(frozen=True)
class BeamEvidence:
    """Numbers of beams, not whole: a beam that may have crossed a pane counts in part."""

    answered: float  # all that returned
    explained: float  # of them by a case 1 to 4
    short: float  # ended in front of everything mapped: at people, at what is new, or the pose is wrong
    passed: float  # went through a wall, or ended at nothing behind a pane

    @property
    def inlier_ratio(self) -> float:
        """Share of the beams that the map explains, of those that are evidence; NaN without any."""
        judged = self.explained + self.short + self.passed
        return self.explained / judged if judged > 0.0 else float("nan")

    def without_crowd(self) -> "BeamEvidence":
        """With at most half of the beams too short: people around the robot hide the map, but do not contradict it."""
        return BeamEvidence(self.answered, self.explained, min(self.short, self.explained + self.passed), self.passed)

    @property
    def judged_share(self) -> float:
        """Share of the returned beams that are evidence."""
        return (self.explained + self.short + self.passed) / max(self.answered, 1.0)


def of(
    measured_m: np.ndarray, case: np.ndarray, expected: ExpectedRanges, seen_through: np.ndarray, known_end: np.ndarray
) -> BeamEvidence:
    """The evidence of one scan about a pose.

    Args:
        measured_m: (B,) ranges by REP 117.
        case: (B,) what each beam met.
        expected: of the pose, its sample 0.
        seen_through: (B,) probability that the first surface along the beam can be seen through.
        known_end: (B,) bool: the map knows something of where the beam ended.
    """
    return BeamEvidence(*_beam_vote.evidence(measured_m, case, expected.line_m[0], seen_through, known_end))
