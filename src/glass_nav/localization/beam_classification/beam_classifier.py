"""Classifies the beams of a scan: expected ranges -> cases -> glass map.

The steps of the seed document glass_localization.txt in their order, with two things that are learnt while driving:
where in the walls of this map beams end, and which of its walls are glass. B beams.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Callable, Sequence, Tuple

import numpy as np

from glass_nav.geometry import se2
from glass_nav.localization.beam_classification import (
    beam_evidence,
    case_votes,
    expected_ranges,
    glass_map,
    preliminary_samples,
    surface_scan,
)
from glass_nav.localization.beam_classification.beam_evidence import BeamEvidence
from glass_nav.localization.beam_classification.behind_panes import UNKNOWN_COATINGS
from glass_nav.localization.beam_classification.case_votes import BeamCases, CaseVote
from glass_nav.localization.beam_classification.expected_ranges import MIN_COS, ExpectedRanges
from glass_nav.localization.beam_classification.glass_map import GlassEvidence, GlassMap
from glass_nav.localization.beam_classification.glass_return_model import ObliqueReturns
from glass_nav.localization.beam_classification.preliminary_samples import PreliminarySamples
from glass_nav.localization.beam_classification.range_residuals import RangeResiduals
from glass_nav.localization.beam_classification.surface_scan import SurfaceScan
from glass_nav.sensing import wall_thickness
from glass_nav.sensing.known_area import KnownArea
from glass_nav.sensing.raycast import RayCaster, changed_box
from glass_nav.sensing.scan import Scan
from glass_nav.world import drawn_panes, free_standing
from glass_nav.world.grid_map import GridMap
from glass_nav.world.pane import Pane

_DEPTH_SHARE = 0.5  # of a wall's drawn thickness at which beams end, until it is learnt
_BEHIND_M = 0.15  # a surface: a beam that ends there passed it
_FEWER_SAMPLES = 3  # times, where the pose is known well, or no particle is weighed by the cases


@dataclass(frozen=True)
class BeamClassifierParams:
    """How beams are classified, a struct per step."""

    samples: PreliminarySamples
    vote: CaseVote
    glass: GlassEvidence
    min_sigma_m: float  # limits of the learnt spread of beams around walls
    max_sigma_m: float
    raycast_threads: int = 1
    raycast_backend: str = "exact"


class BeamClassifier:
    """Classifies the beams of scans on one map, and learns that map's glass."""

    def __init__(self, params: BeamClassifierParams, grid_map: GridMap) -> None:
        self._params = params
        self.caster = RayCaster(grid_map, params.raycast_backend, params.raycast_threads)
        self.caster.walls_at(np.zeros(0, np.int32))  # works out all normals now: that takes longer than a scan may wait
        self.known_area = KnownArea(grid_map)
        self.thickness_m = wall_thickness.wall_thickness(grid_map)  # (H * W,)
        self._mapped = grid_map  # without the panes that redraw() adds
        self._opaque = self._thick_things()
        self.residuals = RangeResiduals(_DEPTH_SHARE, params.min_sigma_m)
        self.glass_map = GlassMap(grid_map, params.glass)
        self._coatings = UNKNOWN_COATINGS
        self._oblique_returns = ObliqueReturns()

    def reconfigure(self, params: BeamClassifierParams) -> None:
        """Use other parameters from the next scan on; what was learnt stays."""
        if (params.raycast_backend, params.raycast_threads) != (
            self._params.raycast_backend,
            self._params.raycast_threads,
        ):
            self.caster = RayCaster(self.caster.grid_map, params.raycast_backend, params.raycast_threads)
        self.glass_map.reconfigure(params.glass)
        before, self._params = self._params, params
        if params.vote.glass_max_thickness_m != before.vote.glass_max_thickness_m:
            self._opaque = self._thick_things()

    def redraw(self, grid_map: GridMap, panes: Sequence[Pane]) -> None:
        """Go on with the same map after panes were drawn in; what was learnt of other walls stays.

        Args:
            grid_map: the map with the panes.
            panes: that it has and the map has not.
        """
        rows, columns = changed_box(self.caster.grid_map, grid_map)
        self.caster.redraw(grid_map)
        wall_thickness.redraw(self.thickness_m, grid_map, rows, columns)
        self.glass_map.redraw(grid_map, [(drawn_panes.cells(grid_map, pane), pane.probability) for pane in panes])

    def classify(
        self, scan: Scan, map_from_base: np.ndarray, covariance: np.ndarray, for_weights: bool = True
    ) -> Tuple[BeamCases, ExpectedRanges]:
        """Cases of all beams, with the ranges that they were chosen from.

        Args:
            scan: one revolution of a lidar.
            map_from_base: (3,) pose that the preliminary samples surround.
            covariance: (3, 3) of that pose.
            for_weights: whether particles are weighed by the cases; if not, fewer samples vote, as around a pose that is
                known to within the least spread of the samples.
        """
        samples = preliminary_samples.around(map_from_base, covariance, self._samples(covariance, for_weights))
        behind_m = case_votes.reach_m(self.residuals, self._params.vote)
        if for_weights:  # the glass map learns from them, too
            behind_m = max(behind_m, glass_map.reach_m(self.residuals))
        expected = self._expected(scan, samples, behind_m)
        # Of the first surface, the second, and a mirrored one.
        glass = self.glass_map.chances(expected.cell[[0, 2, 1], 0])
        cases = case_votes.classify(
            scan.ranges_m,
            expected,
            self.residuals,
            self._params.vote,
            glass[:, :2],
            scan.range_max_m,
            self._at_ends(self.known_area.is_unmapped, scan, map_from_base),
            self._coatings,
            self._oblique_returns.of_surfaces(expected.cos_incidence[1, 0], glass[0, 2]),
        )
        return cases, expected

    def expected_at(self, scan: Scan, map_from_base: np.ndarray) -> ExpectedRanges:
        """Expected ranges of every beam at one pose (3,)."""
        return self._expected(scan, map_from_base[None], 0.0)

    def seen_from(self, cases: BeamCases, scan: Scan, expected: ExpectedRanges) -> BeamCases:
        """The cases with the ranges and residuals of the pose that `expected` is of."""
        return case_votes.as_seen_from(cases, scan.ranges_m, expected, self.residuals, self._params.vote)

    def learn(self, scan: Scan, expected: ExpectedRanges, map_from_base: np.ndarray) -> None:
        """Learn where beams end in walls, and which walls let them pass; `expected` is of a trusted pose (3,)."""
        with np.errstate(invalid="ignore"):
            across = (scan.ranges_m - expected.line_m[0]) * expected.cos_incidence[0, 0] + expected.face_m
        met = np.isfinite(across)
        self.residuals = self.residuals.learn(
            across[met], expected.thickness_m[0, 0][met], self._params.min_sigma_m, self._params.max_sigma_m
        )
        first_glass, mirrored_glass = self.glass_map.chances(expected.cell[:2, 0])[0]
        self._coatings = case_votes.learn_coatings(
            self._coatings,
            scan.ranges_m,
            expected,
            self.residuals,
            self._params.vote,
            scan.range_max_m,
            self._at_ends(self.known_area.is_unmapped, scan, map_from_base),
            self._oblique_returns.of_surfaces(expected.cos_incidence[1, 0], mirrored_glass),
        )
        self._oblique_returns = self._oblique_returns.learn(
            scan.ranges_m,
            expected.line_m[0],
            expected.pane_incidence[0],
            first_glass,
            case_votes.gate_m(self.residuals, self._params.vote),
        )
        self.glass_map.learn(*glass_map.crossings(scan.ranges_m, expected, self.residuals))

    def surfaces(self, scan: Scan, cases: BeamCases, expected: ExpectedRanges, trusted: bool) -> SurfaceScan:
        """The scan cut at glass; `expected` is of the reported pose, which is trusted or not."""
        first = surface_scan.standing(expected, self._is_gone)
        gate_m = case_votes.gate_m(self.residuals, self._params.vote) / np.maximum(first.cos_incidence, MIN_COS)
        return surface_scan.of(
            scan.ranges_m, cases.case, first, self.glass_map.chances(first.cell), gate_m, scan.range_max_m, trusted
        )

    def _thick_things(self) -> np.ndarray:
        """(K,) flat cells, ascending, of free-standing things that are too thick to be glass."""
        return np.flatnonzero(free_standing.walls(self._mapped, self.max_glass_thickness_m))

    def _is_gone(self, cell: np.ndarray, axis_rad: np.ndarray) -> np.ndarray:
        """(G,) bool, of cells (G,) with their axes (G,): the map shows what is no longer there."""
        at = np.searchsorted(self._opaque, cell)
        opaque = at < len(self._opaque)
        opaque[opaque] = self._opaque[at[opaque]] == cell[opaque]
        return self.glass_map.is_gone(cell, axis_rad, opaque)

    def evidence(
        self, scan: Scan, cases: BeamCases, expected: ExpectedRanges, map_from_base: np.ndarray
    ) -> BeamEvidence:
        """How much of the scan speaks for the pose (3,), of which `expected` is, and how much against it."""
        seen_through = self.glass_map.chances(expected.cell[0, 0])[0]
        known_end = self._at_ends(self.known_area.contains, scan, map_from_base)
        return beam_evidence.of(scan.ranges_m, cases.case, expected, seen_through, known_end)

    def left_through_surfaces(self, scan: Scan, beams: np.ndarray, map_from_base: np.ndarray) -> np.ndarray:
        """Which beams (B,) of a scan at a pose (3,) end where the map knows nothing, behind one of its surfaces.

        What stands there is not mapped. A beam that gets there through no surface contradicts the map.
        """
        left = ~self.known_area.ends(scan.points_in_base()[beams], map_from_base[None])[0]
        chosen = beams[left]
        if len(chosen):
            laser = se2.compose(map_from_base, scan.base_from_laser)[None]
            first_m = self.caster.cast(laser, scan.angles_rad[chosen], scan.range_max_m)[0]
            left[left] = scan.ranges_m[chosen] > first_m + _BEHIND_M
        return left

    @staticmethod
    def _at_ends(holds: Callable[[np.ndarray], np.ndarray], scan: Scan, map_from_base: np.ndarray) -> np.ndarray:
        """(B,) bool: the beam returned, and from a point where that holds."""
        ends = scan.answered.copy()
        ends[ends] = holds(se2.transform_points(map_from_base, scan.points_in_base()[ends]))
        return ends

    @property
    def max_glass_thickness_m(self) -> float:
        """A thicker run of occupied cells ends a beam."""
        return self._params.vote.glass_max_thickness_m

    @property
    def min_linearity(self) -> float:
        """Linearity of the cells around a surface below which the surface has no normal."""
        return self._params.vote.normal_min_linearity

    def _samples(self, covariance: np.ndarray, for_weights: bool) -> PreliminarySamples:
        samples = self._params.samples
        if self._params.vote.vote_mode == "paper" or (for_weights and samples.is_exceeded_by(covariance)):
            return samples
        return replace(samples, sample_count=-(-samples.sample_count // _FEWER_SAMPLES))

    def _expected(self, scan: Scan, samples: np.ndarray, behind_m: float) -> ExpectedRanges:
        vote = self._params.vote
        on_cells = vote.vote_mode == "paper"  # the document casts on the cells
        return expected_ranges.of(
            self.caster,
            self.thickness_m,
            samples,
            scan,
            self.max_glass_thickness_m,
            self.min_linearity,
            behind_m,
            gate_m=np.inf if on_cells else case_votes.gate_m(self.residuals, vote),
            depth_share=self.residuals.depth_share,
            mirrored_by_line=not on_cells,
        )
