"""A second opinion on the soft vote: in numpy, formula by formula.

The tests hold the compiled vote against it. N samples, B beams; arrays by case have a row for each.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Tuple

import numpy as np

from glass_nav.localization.beam_classification import glass_return_model
from glass_nav.localization.beam_classification.behind_panes import COATINGS, Coatings, PaneEchoes, reflectance
from glass_nav.localization.beam_classification.case_votes import BeamCases, CaseVote, gate_m
from glass_nav.localization.beam_classification.expected_ranges import MIN_COS, ExpectedRanges
from glass_nav.localization.beam_classification.range_residuals import RangeResiduals
from glass_nav.vocabulary import BeamCase

_TIE_ORDER = (BeamCase.DIFFUSE, BeamCase.FIRST_PENETRATION, BeamCase.SECOND_PENETRATION, BeamCase.SPECULAR)
_OTHER_SURFACE_M = 0.3  # between two expected ranges: an edge lies between them
_REPORTED_GATES = 2.0  # the samples that won the vote may be one gate away from the reported pose
_UNSEEN_SIDE = 0.002  # probability that a beam meets a wall from an unmapped side, over that from the mapped side
_MIN_SEEN_THROUGH = 0.05  # a cell may hold a post and the edge of the pane beside it
_MIRROR_MIN_SHARE = 0.4  # of the vote: a beam that is called mirrored wrongly costs more than an uncertain one
_TEMPER = 0.2  # of a sample's evidence: the errors of beams are correlated, and the best sample shall not vote alone
_REACH, _ROUNDS = 2, 3  # of the pull between neighbouring beams
_BY_SAMPLE = ("range_m", "cos_incidence", "thickness_m")  # fields of ExpectedRanges that hold all samples
_MOST_REFLECTED = 0.9
_WALL_OVER_DARK = 5.0  # reflectance of a wall over that of the darkest one seen at the largest range
_UNMAPPED_PER_M = 0.2  # things that end a beam where the map knows nothing
_NEW_PER_M = 0.02  # the same where it knows something: people, new furniture
_FACE_M = 0.5  # a wall drawn from its other side has its near face at most so far in front of the drawn one
_OTHER_WALL, _SAME_WALL = 2.0, 4.0  # steepness of a victory: reflectances of other walls differ by factors
_WALL_GOES_ON = 0.5  # probability that a wall which a pane adjoins goes on behind it, where the map knows nothing
_GOES_ON_SIGMAS, _PERPENDICULAR_RAD = 2.0, np.radians(10.0)  # how straight it does
_CORNER_COS = 0.5  # of the incidence on a surface whose normal is not known
_FIRST, _MIRRORED, _SECOND = BeamCase.DIFFUSE - 1, BeamCase.SPECULAR - 1, BeamCase.FIRST_PENETRATION - 1


def classify(
    measured_m: np.ndarray,
    expected: ExpectedRanges,
    residuals: RangeResiduals,
    vote: CaseVote,
    glass: np.ndarray,
    max_range_m: float,
    unmapped_end: np.ndarray,
    coatings: Coatings,
    target_returns: np.ndarray,
) -> BeamCases:
    """As case_votes.classify(), by the soft vote."""
    answered = np.isfinite(measured_m)
    at_pose = _inside_walls(_of_sample_0(expected), residuals)
    prior = _priors(measured_m, at_pose, residuals, glass, max_range_m, unmapped_end, coatings, vote, target_returns)
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


def _soft_votes(
    measured_m: np.ndarray, expected: ExpectedRanges, residuals: RangeResiduals, vote: CaseVote, prior: np.ndarray
) -> np.ndarray:
    """(5, B) posterior over the cases, without the pull of neighbours."""
    temper = _TEMPER / np.sqrt(max(np.count_nonzero(np.isfinite(measured_m)), 1))
    uncertain = vote.prior_uncertain * np.exp(-0.25 * (gate_m(residuals, vote) / residuals.sigma_m) ** 2)
    cos = np.maximum(expected.cos_incidence, MIN_COS)
    widening = np.ones(cos.shape)
    widening[_MIRRORED] = np.hypot(1.0, 2.0 * expected.cos_incidence[_FIRST])
    with np.errstate(invalid="ignore"):
        across = (measured_m - _inside_walls(expected, residuals).range_m) * cos
        density = np.exp(-0.5 * np.minimum((across / residuals.sigma_m / widening) ** 2, 100.0)) / widening
        density = np.where(np.abs(across) <= gate_m(residuals, vote), density, 0.0)  # (4, N, B)
    joint = np.concatenate([np.zeros((1,) + cos.shape[1:]), prior[:4, None] * density])
    joint[0] = uncertain + prior[4] * density[_SECOND] + prior[5]
    evidence = np.where(np.isfinite(measured_m), np.log(joint.sum(axis=0)), 0.0).sum(axis=1)  # (N,)
    weight = np.exp(temper * (evidence - evidence.max()))
    share = np.einsum("n,knb->kb", weight / weight.sum(), joint)
    return share / share.sum(axis=0)


def _priors(
    measured_m: np.ndarray,
    expected: ExpectedRanges,
    residuals: RangeResiduals,
    glass: np.ndarray,
    max_range_m: float,
    unmapped_end: np.ndarray,
    coatings: Coatings,
    vote: CaseVote,
    target_returns: np.ndarray,
) -> np.ndarray:
    """(6, B) prior of cases 1 to 4, then of the ends that are case 0: at the second surface where the first is gone, and
    behind a pane at something that no map shows, as a density on the scale of those of the cases.

    From the probability of glass and the glass return model at that incidence.
    """
    incidence = expected.pane_incidence[0]
    (first, second), (there, _) = glass
    first = np.clip(first, _MIN_SEEN_THROUGH, 1.0)
    passes = first * there * (1.0 - glass_return_model.min_share(incidence))
    echoes = _echoes(measured_m, expected, residuals.sigma_m, max_range_m, vote.mirror_gain, unmapped_end, coatings)
    mirrored = passes * echoes.mirrored * target_returns
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


def _echoes(
    measured_m: np.ndarray,
    expected: ExpectedRanges,
    sigma_m: float,
    max_range_m: float,
    gain: float,
    unmapped_end: np.ndarray,
    coatings: Coatings,
) -> PaneEchoes:
    """As behind_panes.of()."""
    first_m, mirrored_m, behind_m, _ = expected.range_m[:, 0]
    back_cos, drawn = _backs(measured_m, expected)
    at_back = np.isfinite(back_cos)
    goes_on = np.where(unmapped_end & (_is_perpendicular(expected) | at_back), _WALL_GOES_ON, 0.0)
    stands = np.where(at_back, 1.0, goes_on)
    corner = np.isnan(expected.axis_rad[_MIRRORED] - expected.axis_rad[_FIRST])
    target_cos = np.where(corner, _CORNER_COS, np.maximum(expected.cos_incidence[_MIRRORED, 0], MIN_COS))
    than_wall = np.where(at_back, np.sqrt(target_cos / np.maximum(back_cos, MIN_COS)), 1.0)
    clear = reflectance(expected.pane_incidence[0])
    mirrored, loses = np.zeros((2, len(clear)))
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        for coating, frequency in zip(COATINGS, coatings.frequencies()):
            reflected = np.minimum(gain * coating * clear, _MOST_REFLECTED)
            over = reflected / (1.0 - reflected)
            seen = 1.0 / (1.0 + 1.0 / ((reflected * max_range_m / mirrored_m) ** 2 * _WALL_OVER_DARK))
            # Up to this range whatever stands behind the pane is brighter than the mirrored echo.
            reach_m = np.minimum(np.minimum(mirrored_m / over, behind_m), max_range_m)
            nothing_there = np.where(unmapped_end, np.exp(-_UNMAPPED_PER_M * np.maximum(reach_m - first_m, 0.0)), 1.0)
            over_wall = _wins(over * than_wall, _SAME_WALL)
            wins = stands * over_wall + (1.0 - stands) * nothing_there * _wins(
                over * behind_m / mirrored_m, _OTHER_WALL
            )
            mirrored += frequency * seen * np.nan_to_num(wins)
            loses += frequency * (1.0 - over_wall)
        mirrored = np.where(np.isfinite(mirrored_m), mirrored, 0.0)
        past_m = measured_m - first_m
        reached = np.where(unmapped_end, np.exp(-_UNMAPPED_PER_M * np.maximum(past_m, 0.0)), 1.0)
        density = np.where(unmapped_end, _UNMAPPED_PER_M, _NEW_PER_M)
        density = np.where(drawn, 1.0 / _FACE_M, density)
        sigma_m = _GOES_ON_SIGMAS * sigma_m / np.maximum(expected.cos_incidence[_MIRRORED, 0], MIN_COS)
        off = np.where(np.isfinite(mirrored_m), (measured_m - mirrored_m) / sigma_m, np.inf)
        wall = goes_on * loses * np.exp(-0.5 * off**2) / (np.sqrt(2.0 * np.pi) * sigma_m)
        behind = np.isfinite(measured_m) & (past_m > 0.0)
    return PaneEchoes(mirrored, np.where(behind, reached * density + np.nan_to_num(wall), 0.0))


def _backs(measured_m: np.ndarray, expected: ExpectedRanges) -> Tuple[np.ndarray, np.ndarray]:
    """(B,) cos of the incidence on a wall drawn from its other side, if the beam may have ended there, else NaN; (B,) bool:
    the wall is drawn on this beam, not only on a neighbour.
    """
    ranges_m, cos, seen = (
        expected.range_m[_SECOND:, 0],
        expected.cos_incidence[_SECOND:, 0],
        expected.seen_side[_SECOND:],
    )
    with np.errstate(invalid="ignore"):
        before_m = ranges_m - measured_m
        met = ~seen & (before_m >= 0.0) & (before_m <= _FACE_M)
        nothing_near = ~(np.abs(before_m) <= _FACE_M).any(axis=0)
        own = np.where(met[0], cos[0], np.where(met[1], cos[1], np.nan))
        back_cos = own.copy()
        for shift in range(-_REACH, _REACH + 1):
            at = np.arange(len(own)) + shift
            inside = (at >= 0) & (at < len(own))
            at = np.clip(at, 0, len(own) - 1)
            near = inside & (np.abs(measured_m[at] - measured_m) < _FACE_M)
            take = nothing_near & near & np.isnan(back_cos)
            back_cos[take] = own[at][take]
    return back_cos, ~np.isnan(own)


def _wins(over: np.ndarray, steepness: float) -> np.ndarray:
    """(B,) probability that an echo of that amplitude over another is the stronger one."""
    return 1.0 / (1.0 + over**-steepness)


def _is_perpendicular(expected: ExpectedRanges) -> np.ndarray:
    """(B,) bool: the wall that the mirrored path ends at may be perpendicular to the mirror, so that its image has the same
    line: it is, or it is met at a corner.
    """
    turned_rad = expected.axis_rad[_MIRRORED] - expected.axis_rad[_FIRST]  # of the image, as far as the wall itself
    with np.errstate(invalid="ignore"):
        return ~(np.abs(np.cos(turned_rad)) >= np.sin(_PERPENDICULAR_RAD))
