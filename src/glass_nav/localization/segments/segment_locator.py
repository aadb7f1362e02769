"""Corrects a rough pose by the beams of a scan that ended at walls: corrections and cases alternate.

Beams are classified at a pose (case_votes.py), and a pose is corrected by beams of known case (segment_correction.py),
so each needs the other. First all beams pull, from the rough pose and others around it, and the result with the most
points near walls is kept. Then only beams of case 1, 3 and 4 pull, reclassified at each corrected pose. A mirrored
(2) or uncertain beam (0) ends nowhere on the map and must not pull; one that passed panes pulls on the wall behind.
Unlike the particle filter, this does not learn where glass is. B beams.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Optional

import numpy as np

from glass_nav.geometry import angles
from glass_nav.localization.beam_classification import case_votes, expected_ranges, preliminary_samples
from glass_nav.localization.beam_classification.case_votes import CaseVote
from glass_nav.localization.beam_classification.glass_map import GlassEvidence, GlassMap
from glass_nav.localization.beam_classification.preliminary_samples import PreliminarySamples
from glass_nav.localization.beam_classification.range_residuals import RangeResiduals
from glass_nav.localization.particle_filter import importance_weights
from glass_nav.localization.particle_filter.importance_weights import BeamMixture
from glass_nav.localization.segments.segment_correction import (
    SegmentCorrection,
    SegmentCorrectionParams,
    SegmentCorrector,
    SegmentQuality,
)
from glass_nav.sensing.raycast import RayCaster
from glass_nav.sensing.scan import Scan
from glass_nav.sensing.wall_thickness import wall_thickness
from glass_nav.world import wall_segments
from glass_nav.world.grid_map import GridMap

_AROUND_M, _AROUND_RAD, _AROUND = 0.3, np.radians(4.0), 8  # initial poses around the rough one
_ROUNDS = 3  # of classification, then correction
_AGAIN = 0.5  # of the first neighbourhood: by then the pose is nearly right
_MIDDLE = 0.5  # of a wall: where beams end in it
_MIN_ENDS = 20  # beams of known case needed to correct a pose
MIN_SHARE = 0.4  # of the answering beams, that must end at walls
MAX_M, MAX_RAD = 1.0, np.radians(20.0)  # that a pose may move: from farther away a fit is chance
_SAME = np.array([1e-3, 1e-3, 1e-4])  # [m, m, rad] smaller moves count as none


@dataclass(frozen=True)
class Located:
    """A scan aligned with the walls of the map."""

    correction: SegmentCorrection  # before: at the rough pose; both qualities are of the beams that pulled last
    case: np.ndarray  # (B,) uint8 of each beam at the corrected pose
    used: np.ndarray  # (B,) bool: the beams that pulled last


class SegmentLocator:
    """Corrects poses on one map."""

    def __init__(self, grid_map: GridMap, params: SegmentCorrectionParams = SegmentCorrectionParams()) -> None:
        self.segments_m = wall_segments.extract(grid_map, wall_segments.FINE_TOLERANCE_CELLS).segments_m
        self._first = SegmentCorrector(self.segments_m, params)
        closer = replace(params, neighbourhood_m=_AGAIN * params.neighbourhood_m)
        self._again = SegmentCorrector(self.segments_m, closer)
        self._caster = RayCaster(grid_map)
        self._thickness_m = wall_thickness(grid_map)
        self._glass_map = GlassMap(grid_map, GlassEvidence())
        self._residuals = RangeResiduals(_MIDDLE, BeamMixture().laser_sigma_hit)

    def locate(self, scan: Scan, map_from_base: np.ndarray) -> Located:
        """Correct a rough pose (3,) by one scan.

        Raises:
            ValueError: the pose is not finite.
        """
        rough = np.array(map_from_base, float)
        points = scan.points_in_base()
        used = scan.answered
        starts = _starts(rough) if used.any() else rough[None]
        found = max(
            (self._first.correct(points[used], start) for start in starts),
            key=lambda each: each.after.classification_factor,
        )
        found = replace(found, map_from_base=_kept_where_free(found, rough))
        case = self._cases(scan, found.map_from_base)
        for _ in range(_ROUNDS):
            known = importance_weights.known_ends(case)
            if np.count_nonzero(known) < _MIN_ENDS:
                break
            pose, used = found.map_from_base, known
            found = self._again.correct(points[used], pose)
            case = self._cases(scan, found.map_from_base)
            if np.all(np.abs(found.map_from_base - pose) < _SAME):
                break
        pose = _kept_where_free(found, rough)
        before, after = (self._again.quality(points[used], each) for each in (rough, pose))
        return Located(replace(found, map_from_base=pose, before=before, after=after), case, used)

    def quality(self, scan: Scan, case: np.ndarray, map_from_base: np.ndarray) -> SegmentQuality:
        """How well the beams of a scan that ended at walls, by their cases (B,), lie on the segments at a pose (3,)."""
        return self._again.quality(scan.points_in_base()[importance_weights.known_ends(case)], map_from_base)

    def _cases(self, scan: Scan, map_from_base: np.ndarray) -> np.ndarray:
        vote = CaseVote()
        samples = preliminary_samples.around(map_from_base, np.zeros((3, 3)), PreliminarySamples())
        expected = expected_ranges.of(
            self._caster, self._thickness_m, samples, scan, vote.glass_max_thickness_m, vote.normal_min_linearity
        )
        glass = self._glass_map.chances(expected.cell[[0, 2], 0])
        return case_votes.classify(scan.ranges_m, expected, self._residuals, vote, glass, scan.range_max_m).case


def refusal(scan: Scan, located: Located, rough: np.ndarray) -> Optional[str]:
    """Why a corrected pose is not to be used: the scan does not fit, or fits so far from the rough pose (3,) that it is
    chance; None if it may be used.
    """
    at_walls = located.correction.after.inlier_share * np.count_nonzero(located.used)
    share = float(at_walls / max(np.count_nonzero(scan.answered), 1))
    if share < MIN_SHARE:
        return (
            f"the scan fits nowhere near the pose: {share:.0%} of its returned beams end at walls, "
            f"at least {MIN_SHARE:.0%} must"
        )
    moved = located.correction.map_from_base - rough
    distance_m, turn_rad = float(np.hypot(moved[0], moved[1])), float(abs(angles.wrap(moved[2])))
    if distance_m > MAX_M or turn_rad > MAX_RAD:
        return (
            f"the scan fits nowhere near the pose: the correction moved it by {distance_m:.2f} m and "
            f"{np.degrees(turn_rad):.0f} deg; beyond {MAX_M:g} m or "
            f"{np.degrees(MAX_RAD):.0f} deg a fit may be chance"
        )
    return None


def free_in_words(found: SegmentCorrection) -> str:
    """Which directions the walls do not constrain: the document's hallway effect."""
    if not len(found.free):
        return "none: the walls constrain x, y and yaw"
    if len(found.free) == 3:
        return "x, y and yaw: no wall constrains them"
    heading = found.free_heading_rad
    if heading is not None:
        return f"the direction {np.degrees(heading):.0f} deg of the map: not corrected"
    names = [name for name, weight in zip(("x", "y", "yaw"), np.linalg.norm(found.free, axis=0)) if weight > 0.3]
    return f"{len(found.free)} of 3 directions, of {', '.join(names)}: not corrected"


def _kept_where_free(found: SegmentCorrection, rough: np.ndarray) -> np.ndarray:
    """(3,) the corrected pose, moved back to the rough one along directions that no segment constrains."""
    if not len(found.free) or not found.lever_m:
        return found.map_from_base
    lever = np.array([1.0, 1.0, found.lever_m])
    moved = found.map_from_base - rough
    moved[2] = angles.wrap(moved[2])
    pose = found.map_from_base - (found.free.T @ (found.free @ (moved * lever))) / lever
    pose[2] = angles.wrap(pose[2])
    return pose


def _starts(rough: np.ndarray) -> np.ndarray:
    """(S, 3) the rough pose and a ring around it, turned to either side in turn; the rough one is the first."""
    bearing = 2.0 * np.pi * np.arange(_AROUND) / _AROUND
    turn = np.where(np.arange(_AROUND) % 2, -_AROUND_RAD, _AROUND_RAD)
    ring = rough + np.column_stack([_AROUND_M * np.cos(bearing), _AROUND_M * np.sin(bearing), turn])
    return np.vstack([rough, ring])
