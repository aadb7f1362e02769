"""Which echo a lidar reports from a pane: the mirrored one, the one from behind the pane, or one from unmapped space.

Echo powers follow the lidar equation for diffuse targets: T^2 / d^2 from a surface at the range d behind the pane,
R^2 / d^2 along the mirrored path, with R and T from Fresnel's equations. The strongest echo is reported. Behind a
pane the map often ends: outdoors, or in a room that the mapper did not enter. What is there is unknown, but usually
something returns an echo. One thing is likely: walls continue. The mirror image of a wall perpendicular to the pane
lies where the same wall would continue behind it, so both give the same range. The same holds for a wall of which the
map shows only the other face: its near face is somewhere in front of it. The formulation is ours. B beams;
expected ranges are those of sample 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glass_nav import _beam_vote
from glass_nav.localization.beam_classification.expected_ranges import MIN_COS, ExpectedRanges
from glass_nav.vocabulary import BeamCase

_PANE_INDEX = 1.51  # of soda-lime glass
COATINGS = np.array([0.5, 1.0, 2.0])  # times the usual reflectance; which it is, is learnt while driving
_FREQUENT = np.array([0.5, 0.25, 0.25])  # until then
_WRONG = 0.05  # share of the echoes that are told wrongly, whatever the coating
_SCAN_SHARE, _SCAN_BEAMS, _MOST_LOG = 0.5, 5.0, 4.0  # beams of one scan are one piece of evidence; it is bounded
_MOST_OPEN_LOG = 2.0  # the same for beams that end where the map knows nothing
_COINCIDES = (
    0.7  # of what stands where the map knows nothing: it ends beams at the mirrored range, as a wall that goes on
)
_MOST_REFLECTED = 0.9
_OTHER_WALL = 2.0  # steepness of a victory: reflectances of other walls differ by factors
_FIRST, _MIRRORED, _SECOND = BeamCase.DIFFUSE - 1, BeamCase.SPECULAR - 1, BeamCase.FIRST_PENETRATION - 1


@dataclass(frozen=True)
class Coatings:
    """How much the panes of this map mirror, learnt from beams whose echo is not in doubt."""

    log_odds: np.ndarray  # (C,) of each coating, up to a constant

    def frequencies(self) -> np.ndarray:
        """(C,) probabilities, sum 1."""
        chances = np.exp(self.log_odds - self.log_odds.max())
        return chances / chances.sum()

    def learn(
        self, measured_m: np.ndarray, expected: ExpectedRanges, sigma_m: float, gate_m: float, gain: float
    ) -> "Coatings":
        """Learn from a scan at a trusted pose; arguments as of of().

        Args:
            gate_m: across a surface; where both echoes are expected farther apart, the range tells which it was.
        """
        mirrored_m, behind_m = expected.range_m[_MIRRORED, 0], expected.range_m[_SECOND, 0]
        cos = np.maximum(expected.cos_incidence[[_MIRRORED, _SECOND], 0], MIN_COS)
        with np.errstate(invalid="ignore"):
            at_mirrored, at_behind = (
                np.abs(measured_m - expected.range_m[[_MIRRORED, _SECOND], 0]) * cos <= 3.0 * sigma_m
            )
            apart = np.abs(mirrored_m - behind_m) * cos.min(axis=0) > 2.0 * gate_m
            past = measured_m - expected.range_m[_FIRST, 0] > 2.0 * gate_m / MIN_COS
            behind = (behind_m - expected.range_m[_FIRST, 0]) * expected.cos_incidence[_FIRST, 0] > 2.0 * gate_m
        told = apart & past & behind & (at_mirrored != at_behind) & expected.seen_side[[_MIRRORED, _SECOND]].all(axis=0)
        told &= np.isfinite(mirrored_m) & np.isfinite(behind_m)
        if not told.any():
            return self
        clear = reflectance(expected.pane_incidence[0][told])
        reflected = np.minimum(gain * COATINGS[:, None] * clear, _MOST_REFLECTED)  # (C, told)
        wins = _wins(reflected / (1.0 - reflected) * behind_m[told] / mirrored_m[told], _OTHER_WALL)
        likelihood = _WRONG + (1.0 - 2.0 * _WRONG) * np.where(at_mirrored[told], wins, 1.0 - wins)
        count = np.count_nonzero(told)
        added = _SCAN_SHARE * min(count / _SCAN_BEAMS, 1.0) * np.log(likelihood).mean(axis=1)
        log_odds = self.log_odds + added
        return Coatings(np.maximum(log_odds - log_odds.max(), -_MOST_LOG))

    def learn_from_open_ends(
        self,
        measured_m: np.ndarray,
        expected: ExpectedRanges,
        sigma_m: float,
        gate_m: float,
        max_range_m: float,
        gain: float,
        unmapped_end: np.ndarray,
        target_returns: np.ndarray,
    ) -> "Coatings":
        """Learn from the beams that ended where the map knows nothing: did the mirrored echo win over what is there?"""
        mirrored_m = expected.range_m[_MIRRORED, 0]
        cos = np.maximum(expected.cos_incidence[_MIRRORED, 0], MIN_COS)
        with np.errstate(invalid="ignore"):
            across_m = np.abs(measured_m - mirrored_m) * cos
            told = unmapped_end & np.isfinite(mirrored_m) & ((across_m <= 3.0 * sigma_m) | (across_m > 2.0 * gate_m))
            told &= measured_m - expected.range_m[_FIRST, 0] > 2.0 * gate_m / MIN_COS
        if not told.any():
            return self
        at_mirrored = across_m[told] <= 3.0 * sigma_m
        chance = np.stack(
            [
                target_returns * of(measured_m, expected, sigma_m, max_range_m, gain, unmapped_end, one).mirrored
                for one in _EACH_COATING
            ]
        )[:, told]
        ends_there = chance + (1.0 - chance) * _COINCIDES
        likelihood = _WRONG + (1.0 - 2.0 * _WRONG) * np.where(at_mirrored, ends_there, 1.0 - ends_there)
        added = _SCAN_SHARE * min(len(at_mirrored) / _SCAN_BEAMS, 1.0) * np.log(likelihood).mean(axis=1)
        log_odds = self.log_odds + added
        least = np.minimum(self.log_odds, -_MOST_OPEN_LOG)  # what is not on the map is weaker evidence than what is
        return Coatings(np.maximum(log_odds - log_odds.max(), least))


_EACH_COATING = [Coatings(np.where(np.arange(len(COATINGS)) == each, 0.0, -np.inf)) for each in range(len(COATINGS))]
UNKNOWN_COATINGS = Coatings(np.log(_FREQUENT))


@dataclass(frozen=True)
class PaneEchoes:
    """What returns of the beams that the pane itself does not return; (B,) each."""

    mirrored: np.ndarray  # probability that it is a mirrored echo; 0 where nothing mirrors
    unmapped: np.ndarray  # density [1/m] at the measured range of ends behind the pane at what no map shows


def of(
    measured_m: np.ndarray,
    expected: ExpectedRanges,
    sigma_m: float,
    max_range_m: float,
    gain: float,
    unmapped_end: np.ndarray,
    coatings: Coatings = UNKNOWN_COATINGS,
) -> PaneEchoes:
    """The chances of each beam if the first surface along it is a pane.

    Args:
        measured_m: (B,) ranges by REP 117.
        expected: with ranges where beams end.
        sigma_m: spread of beams around walls, across them.
        max_range_m: at which the lidar still sees a dark wall, face on.
        gain: how much more light panes mirror than clear glass does, on average.
        unmapped_end: (B,) bool: the mapper did not see the place where the beam ended.
        coatings: what is known of them.
    """
    return PaneEchoes(
        *_beam_vote.pane_echoes(
            measured_m,
            expected.range_m[:, 0],
            expected.cos_incidence[:, 0],
            expected.axis_rad[_MIRRORED] - expected.axis_rad[_FIRST],
            reflectance(expected.pane_incidence[0]),
            expected.seen_side,
            unmapped_end,
            gain * COATINGS,
            coatings.frequencies(),
            sigma_m,
            max_range_m,
            MIN_COS,
        )
    )


def _wins(over: np.ndarray, steepness: float) -> np.ndarray:
    """(B,) probability that an echo of that amplitude over another is the stronger one."""
    return 1.0 / (1.0 + over**-steepness)


def reflectance(incidence_rad: np.ndarray) -> np.ndarray:
    """Share of the light that a sheet of clear glass mirrors: Fresnel, unpolarised, two surfaces; NaN: head on."""
    return _beam_vote.reflectance(incidence_rad, _PANE_INDEX)
