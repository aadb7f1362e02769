"""Scan, references -> cases, by vote: what did each beam meet?

Seed document glass_localization.txt, sec. III.A, eq. (1) and steps 3 and 4: each preliminary sample
votes for the reference nearest to the measured range, and the case with the highest vote wins. What the
document leaves open (it breaks off at step 1) is ours: the gate, ties, and the soft vote, in which a
sample votes with shares, and the more the better it explains the whole scan. N samples, B beams.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Tuple

import numpy as np

from glass_nav.localization.range_residuals import RangeResiduals
from glass_nav.localization.reference_ranges import LEAST_COS, ReferenceRanges

UNCERTAIN, DIFFUSE, SPECULAR, FIRST_PENETRATION, SECOND_PENETRATION = range(5)
VOTE_MODES = ("soft", "paper")
_TIE_ORDER = (DIFFUSE, FIRST_PENETRATION, SECOND_PENETRATION, SPECULAR)
_GATE_SIGMAS = 3.0
_TOLD_GATES = 2.0         # the samples that won the vote may stand one gate away from the pose told
_PANE_INDEX = 1.51        # of soda-lime glass


@dataclass(frozen=True)
class BeamCases:
    """What each beam of a scan met (B beams)."""
    case: np.ndarray        # (B,) uint8: 1 diffuse, 2 specular, 3 first penetration, 4 second, 0 uncertain
    expected_m: np.ndarray  # (B,) reference range of that case at the estimated pose, NaN for case 0
    residual_m: np.ndarray  # (B,) measured minus expected, NaN for case 0
    weight: np.ndarray      # (B,) share of the vote that the case won, 0..1

    def share(self) -> "dict[int, float]":
        """Share of the beams in each case 0..4."""
        counts = np.bincount(self.case, minlength=5)
        return {case: float(counts[case]) / max(len(self.case), 1) for case in range(5)}


@dataclass(frozen=True)
class CaseVote:
    """How beams are told apart."""
    vote_mode: str = "soft"
    case_gate_m: float = 0.15          # a reference farther from the measured range gets no vote
    case_min_share: float = 0.5        # of the vote; a case with less is uncertain
    glass_max_thickness_m: float = 0.2  # a thicker run of occupied cells ends the beam
    normal_min_linearity: float = 0.9
    prior_specular: float = 0.02
    prior_first_penetration: float = 0.12
    prior_second_penetration: float = 0.04
    prior_uncertain: float = 0.1

    def __post_init__(self) -> None:
        if self.vote_mode not in VOTE_MODES:
            raise ValueError(f"~vote_mode must be one of {', '.join(VOTE_MODES)}, got {self.vote_mode!r}")
        for name in ("case_gate_m", "glass_max_thickness_m"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"~{name} must be > 0 m, got {getattr(self, name)}")
        for name in ("case_min_share", "normal_min_linearity", "prior_specular", "prior_first_penetration",
                     "prior_second_penetration", "prior_uncertain"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"~{name} must be in [0, 1], got {getattr(self, name)}")
        if not self.prior_diffuse > 0.0:
            raise ValueError("~prior_specular, ~prior_first_penetration, ~prior_second_penetration and "
                             f"~prior_uncertain must sum to less than 1, got {1.0 - self.prior_diffuse:g}")

    @property
    def prior_diffuse(self) -> float:
        """What the other priors leave."""
        return 1.0 - (self.prior_specular + self.prior_first_penetration
                      + self.prior_second_penetration + self.prior_uncertain)


def classify(measured_m: np.ndarray, references: ReferenceRanges, residuals: RangeResiduals,
             vote: CaseVote) -> BeamCases:
    """Cases of the beams of one scan.

    Args:
        measured_m: (B,) ranges by REP 117; beams without an answer are uncertain.
        references: of the preliminary samples; sample 0 is the pose that expected_m is told for. A beam that
            passes an edge there and met it from the samples that won keeps its case: it tells poses apart.
        residuals: where in a wall beams end, and how widely.
        vote: mode, gate and priors.
    """
    answered = np.isfinite(measured_m)
    ballots = _paper_ballots if vote.vote_mode == "paper" else _soft_ballots
    references = _inside_walls(references, residuals)
    share = ballots(measured_m, references, residuals, vote)  # (5, B), column sums 1
    share[:, ~answered] = np.array([1.0, 0.0, 0.0, 0.0, 0.0])[:, None]
    won = _winner(share)
    case = np.where(answered & (share[won, np.arange(len(won))] >= vote.case_min_share), won, UNCERTAIN)
    return _told_from_sample_0(case, share[case, np.arange(len(case))], measured_m, references, np.inf)


def as_seen_from(cases: BeamCases, measured_m: np.ndarray, references: ReferenceRanges,
                 residuals: RangeResiduals, vote: CaseVote) -> BeamCases:
    """The same cases, with the ranges expected at sample 0 of other references; uncertain where none is near."""
    return _told_from_sample_0(cases.case, cases.weight, measured_m, _inside_walls(references, residuals),
                               gate_m(residuals, vote))


def _told_from_sample_0(case: np.ndarray, weight: np.ndarray, measured_m: np.ndarray,
                        references: ReferenceRanges, within_m: float) -> BeamCases:
    row, beam = np.maximum(case.astype(int) - 1, 0), np.arange(len(case))
    expected = references.range_m[row, 0, beam]
    with np.errstate(invalid="ignore"):
        residual = measured_m - expected
        across = np.abs(residual) * references.cos_incidence[row, 0, beam]
        known = (case > 0) & np.isfinite(expected) & (across <= _TOLD_GATES * within_m)
    return BeamCases(np.where(known, case, UNCERTAIN).astype(np.uint8), np.where(known, expected, np.nan),
                     np.where(known, residual, np.nan), weight)


def _inside_walls(references: ReferenceRanges, residuals: RangeResiduals) -> ReferenceRanges:
    """References where beams end, not at the near boundary of the wall's cells."""
    cos = np.maximum(references.cos_incidence, LEAST_COS)
    depth = residuals.depth_share * references.thickness_m / cos
    return replace(references, range_m=references.range_m + depth)


def _winner(share: np.ndarray) -> np.ndarray:
    """(B,) case with the highest share; equal shares by _TIE_ORDER, uncertain last."""
    order = np.array(_TIE_ORDER + (UNCERTAIN,))
    return order[np.argmax(share[order], axis=0)]


def _paper_ballots(measured_m: np.ndarray, references: ReferenceRanges, residuals: RangeResiduals,
                   vote: CaseVote) -> np.ndarray:
    """(5, B) share of the samples whose nearest reference is that case; equal votes."""
    with np.errstate(invalid="ignore"):
        off = np.abs(measured_m - references.range_m)  # (4, N, B)
    off[np.isnan(off)] = np.inf
    order = np.array(_TIE_ORDER) - 1
    nearest = order[np.argmin(off[order], axis=0)]  # first of equals
    near = np.take_along_axis(off, nearest[None], axis=0)[0] <= gate_m(residuals, vote)
    voted = np.where(near, nearest + 1, UNCERTAIN)
    return np.stack([np.mean(voted == case, axis=0) for case in range(5)])


def _soft_ballots(measured_m: np.ndarray, references: ReferenceRanges, residuals: RangeResiduals,
                  vote: CaseVote) -> np.ndarray:
    """(5, B) posterior over the cases, averaged over the samples by how well each explains the scan."""
    answered = np.isfinite(measured_m)
    z = np.where(answered, measured_m, 0.0)
    sigma_m, gate = residuals.sigma_m, gate_m(residuals, vote)
    density, plausible = _density(z, references, sigma_m, gate)
    prior = np.array([vote.prior_diffuse, vote.prior_specular, vote.prior_first_penetration,
                      vote.prior_second_penetration])
    joint = prior[:, None, None] * density * plausible  # (4, N, B)
    nothing = vote.prior_uncertain * np.exp(-0.25 * (gate / sigma_m) ** 2)
    total = joint.sum(axis=0) + nothing
    log_evidence = np.log(total) @ answered  # (N,)
    temper = 4.0 / np.sqrt(max(answered.sum(), 1))  # neighbouring beams err together
    sample_w = np.exp(temper * (log_evidence - log_evidence.max()))
    sample_w /= sample_w.sum()
    share = np.empty((5, len(measured_m)))
    share[1:] = np.einsum("n,cnb->cb", sample_w, joint / total)
    share[0] = 1.0 - share[1:].sum(axis=0)
    return share


def gate_m(residuals: RangeResiduals, vote: CaseVote) -> float:
    """How far across the surface a beam may end from it: a map that fits badly everywhere needs a wider gate."""
    return max(vote.case_gate_m, _GATE_SIGMAS * residuals.sigma_m)


def _density(z: np.ndarray, references: ReferenceRanges, sigma_m: float,
             gate: float) -> Tuple[np.ndarray, np.ndarray]:
    """(4, N, B) how near each reference is, relative to a perfect match, and how possible it is."""
    cos = np.maximum(references.cos_incidence, LEAST_COS)
    across = (z - references.range_m) * cos
    density = np.exp(-0.5 * np.minimum((across / sigma_m) ** 2, 100.0))
    density[~(np.abs(across) <= gate)] = 0.0
    plausible = np.ones_like(density)
    plausible[SPECULAR - 1] = _mirror_beats_what_is_behind(references)
    return density, plausible


def _mirror_beats_what_is_behind(references: ReferenceRanges) -> np.ndarray:
    """(N, B) 1 where a mirrored echo can be the stronger one: d3 / d2 > T / R of one clear pane.

    Echo powers as in the lidar equation for a diffuse target: T^2 / d3^2 behind the pane, R^2 / d2^2
    by way of the mirror (Fresnel, unpolarised, two surfaces).
    """
    incidence = np.nan_to_num(references.pane_incidence)
    inside = np.arcsin(np.sin(incidence) / _PANE_INDEX)
    parallel, across = np.cos(incidence), np.cos(inside)
    r_s = ((parallel - _PANE_INDEX * across) / (parallel + _PANE_INDEX * across)) ** 2
    r_p = ((across - _PANE_INDEX * parallel) / (across + _PANE_INDEX * parallel)) ** 2
    surface = 0.5 * (r_s + r_p)
    reflected = 2.0 * surface / (1.0 + surface)
    behind, mirrored = references.range_m[FIRST_PENETRATION - 1], references.range_m[SPECULAR - 1]
    with np.errstate(invalid="ignore"):
        return (behind * reflected > (1.0 - reflected) * mirrored).astype(float)
