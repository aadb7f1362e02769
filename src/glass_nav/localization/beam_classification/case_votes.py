"""Decides the case of each beam by a vote of the preliminary samples on their expected ranges.

Seed document glass_localization.txt, sec. III.A, eq. (1) and steps 3 and 4: each preliminary sample votes for the
expected range nearest to the measured one, and the case with the most votes wins. The document breaks off at step 1,
so the rest is ours: the gate, the ties, and the soft vote. In the soft vote a sample divides its vote among the
cases, and counts the more the better it explains the whole scan; prior probabilities follow from the glass map and
the physics of a pane; and neighbouring beams draw each other towards the same case. N samples, B beams.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Optional

import numpy as np

from glass_nav import _beam_vote
from glass_nav.localization.beam_classification import behind_panes, glass_return_model
from glass_nav.localization.beam_classification.behind_panes import UNKNOWN_COATINGS, Coatings
from glass_nav.localization.beam_classification.expected_ranges import MIN_COS, ExpectedRanges
from glass_nav.localization.beam_classification.range_residuals import RangeResiduals
from glass_nav.params import choice, number
from glass_nav.vocabulary import BeamCase

VOTE_MODES = ("soft", "paper")
_TIE_ORDER = (BeamCase.DIFFUSE, BeamCase.FIRST_PENETRATION, BeamCase.SECOND_PENETRATION, BeamCase.SPECULAR)
_GATE_SIGMAS = 3.0
_TEMPER = 0.2  # of a sample's evidence: the errors of beams are correlated, and the best sample shall not vote alone
_MIRRORED = BeamCase.SPECULAR - 1  # row of the expected ranges
_BY_SAMPLE = ("range_m", "cos_incidence", "thickness_m")  # fields of ExpectedRanges that hold all samples


@dataclass(frozen=True)
class BeamCases:
    """What each beam of a scan met (B beams)."""

    case: np.ndarray  # (B,) uint8: 1 diffuse, 2 specular, 3 first penetration, 4 second, 0 uncertain
    expected_m: np.ndarray  # (B,) expected range of that case at the estimated pose, NaN for case 0
    residual_m: np.ndarray  # (B,) measured minus expected, NaN for case 0
    weight: np.ndarray  # (B,) share of the vote that the case won, 0..1

    def share(self) -> "dict[int, float]":
        """Share of the beams in each case 0..4."""
        counts = np.bincount(self.case, minlength=5)
        return {case: float(counts[case]) / max(len(self.case), 1) for case in range(5)}


@dataclass(frozen=True)
class CaseVote:
    """How beams are classified."""

    vote_mode: str = choice("soft", VOTE_MODES)
    case_gate_m: float = number(0.15, 0.0, 10.0)  # an expected range farther from the measured one gets no vote
    case_min_share: float = number(0.5, 0.0, 1.0)  # of the vote; a case with less is uncertain
    glass_max_thickness_m: float = number(0.2, 0.0, 10.0)  # a thicker run of occupied cells ends the beam
    normal_min_linearity: float = number(0.9, 0.0, 1.0)
    prior_uncertain: float = number(0.1, 0.0, 1.0)  # probability to meet what is not on the map
    # the same behind a pane: rooms that have changed since, and outdoors
    prior_uncertain_behind: float = number(0.2, 0.0, 1.0)
    mirror_gain: float = number(2.0, 0.0, 100.0)  # how much more light panes mirror than clear glass does
    neighbour_pull: float = number(1.5, 0.0, 100.0)  # log odds that equal cases of all neighbouring beams add

    def __post_init__(self) -> None:
        if self.vote_mode not in VOTE_MODES:
            raise ValueError(f"~vote_mode must be one of {', '.join(VOTE_MODES)}, got {self.vote_mode!r}")
        for name in ("case_gate_m", "glass_max_thickness_m"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"~{name} must be > 0 m, got {getattr(self, name)}")
        for name in ("case_min_share", "normal_min_linearity"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"~{name} must be in [0, 1], got {getattr(self, name)}")
        for name in ("prior_uncertain", "prior_uncertain_behind"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise ValueError(f"~{name} must be in (0, 1), got {getattr(self, name)}")
        for name in ("mirror_gain", "neighbour_pull"):
            if not 0.0 <= getattr(self, name) < np.inf:
                raise ValueError(f"~{name} must be finite and >= 0, got {getattr(self, name)}")


def classify(
    measured_m: np.ndarray,
    expected: ExpectedRanges,
    residuals: RangeResiduals,
    vote: CaseVote,
    glass: np.ndarray,
    max_range_m: float,
    unmapped_end: Optional[np.ndarray] = None,
    coatings: Coatings = UNKNOWN_COATINGS,
    target_returns: Optional[np.ndarray] = None,
) -> BeamCases:
    """Cases of the beams of one scan.

    Args:
        measured_m: (B,) ranges by REP 117; beams without an answer are uncertain.
        expected: of the preliminary samples; expected_m is that of sample 0, and for a beam that passes an edge
            there, that of the sample that explains it best.
        residuals: where in a wall beams end, and how widely.
        vote: mode, gate and priors.
        glass: (2, 2, B) probabilities that the first and the second surface at sample 0 can be seen through, and if so
            that they are there; for the soft vote.
        max_range_m: of the lidar; for the soft vote.
        unmapped_end: (B,) bool: the mapper did not see the place where the beam ended; None: it saw all. For the soft
            vote.
        coatings: of the panes, as far as they are known; for the soft vote.
        target_returns: (B,) share of beams that come back from the surface at the end of the mirrored path, which may be
            a pane; None: all. For the soft vote.
    """
    if vote.vote_mode == "paper":
        share = _paper_votes(measured_m, expected, residuals, vote)  # (5, B), column sums 1
    else:
        if unmapped_end is None:
            unmapped_end = np.zeros(len(measured_m), bool)
        if target_returns is None:
            target_returns = np.ones(len(measured_m))
        share = _soft_votes(
            measured_m, expected, residuals, vote, glass, max_range_m, unmapped_end, coatings, target_returns
        )
    return BeamCases(
        *_beam_vote.decided(
            share,
            measured_m,
            expected.range_m,
            expected.cos_incidence,
            expected.thickness_m,
            vote.case_min_share,
            gate_m(residuals, vote),
            residuals.depth_share,
            MIN_COS,
        )
    )


def as_seen_from(
    cases: BeamCases, measured_m: np.ndarray, expected: ExpectedRanges, residuals: RangeResiduals, vote: CaseVote
) -> BeamCases:
    """The same cases from a pose nearby, with the ranges expected at it, sample 0 of `expected`.

    A beam that passes an edge from there keeps its range; one that ends farther from its surface is uncertain.
    """
    return BeamCases(
        *_beam_vote.seen_from(
            cases.case,
            cases.expected_m,
            cases.weight,
            measured_m,
            expected.range_m,
            expected.cos_incidence,
            expected.thickness_m,
            gate_m(residuals, vote),
            residuals.depth_share,
            MIN_COS,
        )
    )


def learn_coatings(
    coatings: Coatings,
    measured_m: np.ndarray,
    expected: ExpectedRanges,
    residuals: RangeResiduals,
    vote: CaseVote,
    max_range_m: float,
    unmapped_end: np.ndarray,
    target_returns: np.ndarray,
) -> Coatings:
    """Learn the coating of the panes from sample 0 of `expected`, a trusted pose."""
    at_pose = _inside_walls(_of_sample_0(expected), residuals)
    coatings = coatings.learn(measured_m, at_pose, residuals.sigma_m, gate_m(residuals, vote), vote.mirror_gain)
    return coatings.learn_from_open_ends(
        measured_m,
        at_pose,
        residuals.sigma_m,
        gate_m(residuals, vote),
        max_range_m,
        vote.mirror_gain,
        unmapped_end,
        target_returns,
    )


def _of_sample_0(expected: ExpectedRanges) -> ExpectedRanges:
    return replace(expected, **{name: getattr(expected, name)[:, :1] for name in _BY_SAMPLE})


def _inside_walls(expected: ExpectedRanges, residuals: RangeResiduals) -> ExpectedRanges:
    """Expected ranges where beams end, not at the near boundary of the wall's cells."""
    depth = residuals.depth_share * expected.thickness_m
    shift = depth / np.maximum(expected.cos_incidence, MIN_COS)
    mirror = BeamCase.DIFFUSE - 1
    shift[_MIRRORED] += 2.0 * depth[mirror] * expected.cos_incidence[mirror]  # it lies so much deeper
    return replace(expected, range_m=expected.range_m + shift)


def _paper_votes(
    measured_m: np.ndarray, expected: ExpectedRanges, residuals: RangeResiduals, vote: CaseVote
) -> np.ndarray:
    """(5, B) share of the samples whose nearest expected range is of that case; equal votes."""
    expected = _inside_walls(expected, residuals)
    with np.errstate(invalid="ignore"):
        off = np.abs(measured_m - expected.range_m)  # (4, N, B)
    off[np.isnan(off)] = np.inf
    order = np.array(_TIE_ORDER) - 1
    nearest = order[np.argmin(off[order], axis=0)]  # first of equals
    near = np.take_along_axis(off, nearest[None], axis=0)[0] <= gate_m(residuals, vote)
    voted = np.where(near, nearest + 1, BeamCase.UNCERTAIN)
    return np.stack([np.mean(voted == case, axis=0) for case in range(5)])


def reach_m(residuals: RangeResiduals, vote: CaseVote) -> float:
    """How far behind the end of a beam an expected range may be and still get a vote."""
    return gate_m(residuals, vote) / MIN_COS


def gate_m(residuals: RangeResiduals, vote: CaseVote) -> float:
    """How far across the surface a beam may end from it: a map that fits poorly everywhere needs a wider gate."""
    return max(vote.case_gate_m, _GATE_SIGMAS * residuals.sigma_m)


def _soft_votes(
    measured_m: np.ndarray,
    expected: ExpectedRanges,
    residuals: RangeResiduals,
    vote: CaseVote,
    glass: np.ndarray,
    max_range_m: float,
    unmapped_end: np.ndarray,
    coatings: Coatings,
    target_returns: np.ndarray,
) -> np.ndarray:
    """(5, B) posterior over the cases; samples are weighted by how well each explains the scan.

    The prior of each case follows from the probability of glass, the glass return model at that incidence and the echoes
    of panes; two more are of ends that are case 0: at the second surface where the first is gone, and behind a pane at
    something that no map shows. The density around an expected range is normal of width residuals.sigma_m, cut at the
    gate, across the surface. The samples are summed before the cases compete: a corner that some of them graze and
    others miss is no surface to explain the beam by, if without it a likelier case does. The evidence of a sample is the
    product over the beams that answered, to the power of _TEMPER over the root of their number.

    Neighbours mostly meet the same wall at the same incidence; a single beam that fits a farther wall mostly does so by
    chance: so neighbouring beams pull each other, mean field of a chain, a few rounds.
    """
    incidence = expected.pane_incidence[0]
    return _beam_vote.soft_votes(
        measured_m,
        expected.range_m,
        expected.cos_incidence,
        expected.thickness_m,
        expected.axis_rad,
        expected.seen_side,
        behind_panes.reflectance(incidence),
        glass_return_model.min_share(incidence),
        unmapped_end,
        glass,
        target_returns,
        vote.mirror_gain * behind_panes.COATINGS,
        coatings.frequencies(),
        float(glass_return_model.min_share(np.array(np.nan))),
        vote.prior_uncertain,
        vote.prior_uncertain_behind,
        max_range_m,
        residuals.depth_share,
        residuals.sigma_m,
        gate_m(residuals, vote),
        MIN_COS,
        _TEMPER / np.sqrt(max(np.count_nonzero(np.isfinite(measured_m)), 1)),
        vote.neighbour_pull,
    )
