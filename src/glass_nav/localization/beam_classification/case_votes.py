"""Scan, expected -> cases, by vote: what did each beam meet?

Seed document glass_localization.txt, sec. III.A, eq. (1) and steps 3 and 4: each preliminary sample
votes for the reference nearest to the measured range, and the case with the highest vote wins. What the
document leaves open (it breaks off at step 1) is ours: the gate, ties, and the soft vote, in which a
sample votes with shares, and the more the better it explains the whole scan; in which the chance of each
case before the beam is looked at follows from the probability of glass and the physics of a pane;
and in which neighbouring beams pull each other. N samples, B beams.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Optional, Tuple

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
_OTHER_SURFACE_M = 0.3  # between two expected ranges: an edge lies between them
_REPORTED_GATES = 2.0  # the samples that won the vote may be one gate away from the reported pose
_UNSEEN_SIDE = 0.002  # probability that a beam meets a wall from an unmapped side, over that from the mapped side
_MIN_SEEN_THROUGH = 0.05  # a cell may hold a post and the edge of the pane beside it
_MIRROR_MIN_SHARE = 0.7  # of the vote: a beam that is called mirrored wrongly costs more than an uncertain one
_TEMPER = 0.2  # of a sample's evidence: the errors of beams are correlated, and the best sample shall not vote alone
_REACH, _ROUNDS = 2, 3  # of the pull between neighbouring beams
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
    """
    answered = np.isfinite(measured_m)
    if vote.vote_mode == "paper":
        share = _paper_votes(measured_m, expected, residuals, vote)  # (5, B), column sums 1
    else:
        if unmapped_end is None:
            unmapped_end = np.zeros(len(measured_m), bool)
        at_pose = _inside_walls(_of_sample_0(expected), residuals)
        prior = _priors(measured_m, at_pose, residuals, glass, max_range_m, unmapped_end, coatings, vote)
        alone = _soft_votes(measured_m, expected, residuals, vote, prior)
        share = _pulled(alone, answered, vote.neighbour_pull)
        doubtful = alone[BeamCase.SPECULAR] < _MIRROR_MIN_SHARE  # and neighbours would only repeat it
        share[BeamCase.UNCERTAIN, doubtful] += share[BeamCase.SPECULAR, doubtful]
        share[BeamCase.SPECULAR, doubtful] = 0.0
    share[:, ~answered] = np.array([1.0, 0.0, 0.0, 0.0, 0.0])[:, None]
    won, beam = _winner(share), np.arange(len(measured_m))
    case = np.where(answered & (share[won, beam] >= vote.case_min_share), won, BeamCase.UNCERTAIN)
    expected_m, across_m = (values[0] for values in _expected_of(case, measured_m, _of_sample_0(expected), residuals))
    elsewhere = np.flatnonzero((case > 0) & ~(across_m <= gate_m(residuals, vote)))
    if len(elsewhere):
        expected_there_m, across_there_m = _expected_of(
            case[elsewhere], measured_m[elsewhere], _of_beams(expected, elsewhere), residuals
        )
        nearest = np.argmin(across_there_m, axis=0), np.arange(len(elsewhere))
        expected_m[elsewhere], across_m[elsewhere] = expected_there_m[nearest], across_there_m[nearest]
    return _beam_cases(case, share[case, beam], measured_m, expected_m, np.isfinite(across_m))


def as_seen_from(
    cases: BeamCases, measured_m: np.ndarray, expected: ExpectedRanges, residuals: RangeResiduals, vote: CaseVote
) -> BeamCases:
    """The same cases from a pose nearby, with the ranges expected at it, sample 0 of `expected`.

    A beam that passes an edge from there keeps its range; one that ends farther from its surface is uncertain.
    """
    expected_m, across_m = _expected_of(cases.case, measured_m, _of_sample_0(expected), residuals)
    other = np.abs(np.nan_to_num(expected_m[0] - cases.expected_m)) > _OTHER_SURFACE_M  # also where there is none
    fits = across_m[0] <= _REPORTED_GATES * gate_m(residuals, vote)
    return _beam_cases(
        cases.case, cases.weight, measured_m, np.where(fits, expected_m[0], cases.expected_m), fits | other
    )


def learn_coatings(
    coatings: Coatings, measured_m: np.ndarray, expected: ExpectedRanges, residuals: RangeResiduals, vote: CaseVote
) -> Coatings:
    """What sample 0 of `expected`, a trusted pose, says of the panes' coatings."""
    at_pose = _inside_walls(_of_sample_0(expected), residuals)
    return coatings.learn(measured_m, at_pose, residuals.sigma_m, gate_m(residuals, vote), vote.mirror_gain)


def _of_sample_0(expected: ExpectedRanges) -> ExpectedRanges:
    return replace(expected, **{name: getattr(expected, name)[:, :1] for name in _BY_SAMPLE})


def _of_beams(expected: ExpectedRanges, beams: np.ndarray) -> ExpectedRanges:
    return replace(expected, **{name: getattr(expected, name)[:, :, beams] for name in _BY_SAMPLE})


def _expected_of(
    case: np.ndarray, measured_m: np.ndarray, expected: ExpectedRanges, residuals: RangeResiduals
) -> Tuple[np.ndarray, np.ndarray]:
    """(N, B) ranges expected at the samples for the case of each beam, and the distance from the surface to its end."""
    expected = _inside_walls(expected, residuals)
    row, beam = np.maximum(case.astype(int) - 1, 0), np.arange(len(case))
    expected_m = expected.range_m[row, :, beam].T
    with np.errstate(invalid="ignore"):
        across_m = np.abs(measured_m - expected_m) * expected.cos_incidence[row, :, beam].T
    return expected_m, np.where(np.isnan(across_m), np.inf, across_m)


def _beam_cases(
    case: np.ndarray, weight: np.ndarray, measured_m: np.ndarray, expected_m: np.ndarray, known: np.ndarray
) -> BeamCases:
    known = known & (case > 0)
    with np.errstate(invalid="ignore"):
        residual_m = np.where(known, measured_m - expected_m, np.nan)
    return BeamCases(
        np.where(known, case, BeamCase.UNCERTAIN).astype(np.uint8),
        np.where(known, expected_m, np.nan),
        residual_m,
        weight,
    )


def _inside_walls(expected: ExpectedRanges, residuals: RangeResiduals) -> ExpectedRanges:
    """Expected ranges where beams end, not at the near boundary of the wall's cells."""
    depth = residuals.depth_share * expected.thickness_m
    shift = depth / np.maximum(expected.cos_incidence, MIN_COS)
    mirror = BeamCase.DIFFUSE - 1
    shift[_MIRRORED] += 2.0 * depth[mirror] * expected.cos_incidence[mirror]  # it lies so much deeper
    return replace(expected, range_m=expected.range_m + shift)


def _winner(share: np.ndarray) -> np.ndarray:
    """(B,) case with the highest share; equal shares by _TIE_ORDER, uncertain last."""
    order = np.array(_TIE_ORDER + (BeamCase.UNCERTAIN,))
    return order[np.argmax(share[order], axis=0)]


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


def _soft_votes(
    measured_m: np.ndarray, expected: ExpectedRanges, residuals: RangeResiduals, vote: CaseVote, prior: np.ndarray
) -> np.ndarray:
    """(5, B) posterior over the cases; samples are weighted by how well each explains the scan.

    The density around an expected range is normal of width residuals.sigma_m, cut at the gate, across the surface; each
    case has its prior, (6, B) of _priors(), times that density. The samples are summed before the cases compete: a
    corner that some of them graze and others miss is no surface to explain the beam by, if without it a likelier case
    does. The evidence of a sample is the product over the beams that answered, to the power of _TEMPER over the root of
    their number.
    """
    temper = _TEMPER / np.sqrt(max(np.count_nonzero(np.isfinite(measured_m)), 1))
    return _beam_vote.case_votes(
        measured_m,
        expected.range_m,
        expected.cos_incidence,
        expected.thickness_m,
        prior,
        vote.prior_uncertain,
        residuals.depth_share,
        residuals.sigma_m,
        gate_m(residuals, vote),
        MIN_COS,
        temper,
    )


def reach_m(residuals: RangeResiduals, vote: CaseVote) -> float:
    """How far behind the end of a beam an expected range may be and still get a vote."""
    return gate_m(residuals, vote) / MIN_COS


def gate_m(residuals: RangeResiduals, vote: CaseVote) -> float:
    """How far across the surface a beam may end from it: a map that fits poorly everywhere needs a wider gate."""
    return max(vote.case_gate_m, _GATE_SIGMAS * residuals.sigma_m)


def _priors(
    measured_m: np.ndarray,
    expected: ExpectedRanges,
    residuals: RangeResiduals,
    glass: np.ndarray,
    max_range_m: float,
    unmapped_end: np.ndarray,
    coatings: Coatings,
    vote: CaseVote,
) -> np.ndarray:
    """(6, B) prior of cases 1 to 4, then of the ends that are case 0: at the second surface where the first is gone, and
    behind a pane at something that no map shows, as a density on the scale of those of the cases.

    From the probability of glass and the glass return model at that incidence.
    """
    incidence = expected.pane_incidence[0]
    (first, second), (there, _) = glass
    first = np.clip(first, _MIN_SEEN_THROUGH, 1.0)
    passes = first * there * (1.0 - glass_return_model.min_share(incidence))
    echoes = behind_panes.of(
        measured_m, expected, residuals.sigma_m, max_range_m, vote.mirror_gain, unmapped_end, coatings
    )
    mirrored = passes * echoes.mirrored
    behind = (passes - mirrored) * (1.0 - vote.prior_uncertain_behind)
    passes_again = second * (1.0 - glass_return_model.min_share(np.full(len(first), np.nan)))
    gone = first * (1.0 - there)
    peak_m = np.sqrt(2.0 * np.pi) * residuals.sigma_m / np.maximum(expected.cos_incidence[_MIRRORED, 0], MIN_COS)
    unmapped = passes * echoes.unmapped * peak_m
    prior = np.stack(
        [1.0 - passes - gone, mirrored, behind * (1.0 - passes_again), behind * passes_again, gone, unmapped]
    )
    prior[1:4] *= np.where(expected.seen_side[1:], 1.0, _UNSEEN_SIDE)
    return (1.0 - vote.prior_uncertain) * prior


def _pulled(share: np.ndarray, answered: np.ndarray, pull: float) -> np.ndarray:
    """(5, B) shares after neighbouring beams have pulled each other: mean field of a chain, a few rounds.

    Neighbours mostly meet the same wall at the same incidence; a single beam that fits a farther wall mostly does so by chance.
    """
    log_share = np.log(share + 1e-6)
    belief = share
    for _ in range(_ROUNDS):
        around = _mean_of_neighbours(np.where(answered, belief, 0.0), answered)
        belief = np.exp(log_share + pull * around)
        belief /= belief.sum(axis=0)
    return belief


def _mean_of_neighbours(belief: np.ndarray, answered: np.ndarray) -> np.ndarray:
    """(5, B) mean over the returns among the _REACH beams to either side."""
    width = 2 * _REACH + 1
    padded = np.pad(np.vstack([belief, answered]), ((0, 0), (_REACH + 1, _REACH)))
    running = np.cumsum(padded, axis=1)
    around = running[:, width:] - running[:, :-width] - np.vstack([belief, answered])
    return around[:5] / np.maximum(around[5], 1.0)
