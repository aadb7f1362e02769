"""The share of the beams of a scan that the map explains, glass included, at each of many poses.

A beam is explained if it ended at one of the ranges of the five cases: at the first surface, at a later one if the
walls before are thin enough for glass, or at the mirrored range (seed document glass_localization.txt). So beams that
passed panes do not rule a pose out, and a wall at another distance does not support it. A beam that ended in unmapped
space is no evidence, unless it crossed a wall too thick for glass. The mapper did not see the back of walls either,
so a beam that reaches one from behind may end before the face that is drawn. Each pose may first be registered to the
scan, since it is known to about a decimetre.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.hypotheses import scan_alignment
from glass_nav.hypotheses.place_search import PlaceSearch
from glass_nav.hypotheses.scan_matcher import ScanMatcher
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.known_area import KnownArea
from glass_nav.sensing.raycast import RayCaster, SurfaceHits
from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import GridMap

_BEAMS = 120  # of a scan that are used
_NEAR_CELLS = 3.0  # a beam that ends this close to an expected range is explained
_MAX_THICK_M = 0.3  # a thicker wall is no glass
_FAR_M = 0.3  # from a wall: not where it was drawn a little otherwise
_TURNED = 0.01  # rad by which a pose may be off
_DEEP_M = 0.08  # in a thing: not where its outline was drawn a cell off
_THING_M = 1.5  # depth of furniture, at most
_INSIDE_M = 0.25  # behind the face of a thing, where only its outline is drawn: the rest of it is unknown
_BACK_M = 0.5  # from the back of a wall, which was not seen, to the face that was
_SLIDES_M, _SLIDES_RAD = 0.5, np.radians(15.0)  # a pose that would slide further stays where it was given
_AT_ONCE = 64  # poses
_MIN_BEAMS = 10
_SEES_M = 25.0  # a simulated scan
_MIN_KNOWN = 0.25  # of the beams that returned; where the map knows fewer of them it cannot judge


@dataclass(frozen=True)
class BeamsExplained:
    """How the map explains the B beams of a scan, from P poses."""

    poses: np.ndarray  # (P, 3) where the scan fits best
    ends_m: np.ndarray  # (B, 2) of the beams, in the robot's frame
    explained: np.ndarray  # (P, B) bool: the map explains the beam
    known: np.ndarray  # (P, B) bool: the beam is evidence; it did not end where the map knows nothing
    contradicted_at: np.ndarray  # (P, B) where along it the map contradicts it, 1: at its end; NaN: it does not

    @property
    def contradicted(self) -> np.ndarray:
        """(P, B) bool: the beam is evidence, and went through a wall of the map or ended far from all walls."""
        return ~np.isnan(self.contradicted_at)


class ScanExplanation:
    """Explains scans by one map."""

    def __init__(self, grid_map: GridMap) -> None:
        self._grid_map = grid_map
        self._caster = RayCaster(grid_map)
        self._field = DistanceField(grid_map)
        self._matcher: Optional[ScanMatcher] = None  # made at its first use: on a large map that takes time
        self._near_m = _NEAR_CELLS * grid_map.resolution_m
        self._known_area = KnownArea(grid_map)

    def prepare(self) -> None:
        """Make now what the first scan would wait for, 0.4 s on a map of two million cells: normals of walls, matcher."""
        self._caster.cast_surfaces(np.zeros((1, 3)), np.zeros(1), self._near_m)
        if self._matcher is None:
            self._matcher = ScanMatcher(self._grid_map, self._field)

    def shares(self, scan: Scan, map_from_base: np.ndarray) -> np.ndarray:
        """Share of the beams that the map explains, of those that returned from mapped space.

        Args:
            scan: as it was measured.
            map_from_base: (C, 3) poses.

        Returns:
            (C,) shares in [0, 1]; NaN if too few did.
        """
        return self.fitted(scan, map_from_base, _SLIDES_M, _SLIDES_RAD)[1]

    def fitted(
        self, scan: Scan, map_from_base: np.ndarray, most_m: float, most_rad: float
    ) -> Tuple[np.ndarray, np.ndarray]:
        """The poses where the scan fits best, and how much of it the map explains there.

        Args:
            scan: as it was measured.
            map_from_base: (C, 3) poses.
            most_m, most_rad: a pose that would slide further stays where it was given.

        Returns:
            (C, 3) poses, and (C,) shares in [0, 1] as of shares(); poses as given and NaN if hardly any beam returned.
        """
        beams = self.beams(scan, map_from_base, most_m, most_rad)
        if beams is None:
            return np.array(map_from_base, float), np.full(len(map_from_base), np.nan)
        count = beams.known.sum(axis=1)
        few = count < max(_MIN_BEAMS, _MIN_KNOWN * len(beams.ends_m))
        return beams.poses, np.where(few, np.nan, beams.explained.sum(axis=1) / np.maximum(count, 1))

    def beams(self, scan: Scan, map_from_base: np.ndarray, most_m: float, most_rad: float) -> Optional[BeamsExplained]:
        """As fitted(), but for each beam; None if hardly any beam returned."""
        used = _used_beams(scan)
        if used is None:
            return None
        points = scan.points_in_base()[used]
        poses = [np.zeros((0, 3))]
        explained, known = ([np.zeros((0, len(used)), bool)] for _ in range(2))
        contradicted_at = [np.zeros((0, len(used)))]
        for first in range(0, len(map_from_base), _AT_ONCE):
            slid = self._slid(points, map_from_base[first : first + _AT_ONCE], most_m, most_rad)
            poses.append(slid)
            of_pose = self._explained(scan, used, points, slid)
            explained.append(of_pose[0])
            known.append(of_pose[1])
            contradicted_at.append(of_pose[2])
        return BeamsExplained(np.concatenate(poses), points, *map(np.concatenate, (explained, known, contradicted_at)))

    def search(self, scan: Scan, odom_from_base: np.ndarray) -> Optional[PlaceSearch]:
        """A search of the whole map for poses from which the scan may have been taken; None if hardly any beam
        returned.
        """
        used = _used_beams(scan)
        if used is None:
            return None
        if self._matcher is None:
            self._matcher = ScanMatcher(self._grid_map, self._field)
        return PlaceSearch(self._matcher, self._field, scan.points_in_base()[used], odom_from_base)

    def seen_from(self, map_from_base: np.ndarray) -> Scan:
        """The scan that a robot at a pose (3,) would see if the map were right: the first surface along each beam."""
        directions = np.arange(_BEAMS) * (2.0 * np.pi / _BEAMS) - np.pi
        first_m = self._caster.cast(map_from_base[None], directions, _SEES_M)[0]
        return Scan(0, first_m, directions, 0.0, _SEES_M, np.zeros(3))

    def is_free(self, points_m: np.ndarray) -> np.ndarray:
        """(...) bool: by the map a robot may stand at points (..., 2) [m]."""
        return self._known_area.is_free(points_m)

    def _slid(self, points_m: np.ndarray, poses: np.ndarray, most_m: float, most_rad: float) -> np.ndarray:
        slid = scan_alignment.align(self._field, points_m, poses, last_scale_m=0.1).poses
        off = slid - poses
        kept = (np.hypot(off[:, 0], off[:, 1]) < most_m) & (np.abs(angles.wrap(off[:, 2])) < most_rad)
        return np.where(kept[:, None], slid, poses)

    def _explained(
        self, scan: Scan, beams: np.ndarray, points_m: np.ndarray, poses: np.ndarray
    ) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(P, B) each: explained, bool; known, bool; where along the beam it is contradicted, NaN where it is not."""
        hits = self._caster.cast_surfaces(
            se2.compose(poses, scan.base_from_laser),
            scan.angles_rad[beams],
            scan.range_max_m,
            max_thickness_m=_MAX_THICK_M,
        )
        measured = scan.ranges_m[beams]
        offered = np.stack([hits.first_m, hits.second_m, hits.third_m, hits.mirrored_m])  # (4, P, B)
        stopped = (hits.first_m < measured) & (hits.first_thickness_m > _MAX_THICK_M)  # it went through no glass
        ends = se2.transform_points(poses[:, None], points_m)
        through = _beside_another(self._crossed(poses, scan, ends, hits, stopped))
        explained = (np.abs(offered - measured) <= self._near_m).any(axis=0)
        ahead_m = offered[:3] - measured
        near = np.abs(ahead_m) < _BACK_M
        back = (near & (ahead_m > 0.0)).any(axis=0) & ~(near & (ahead_m <= 0.0)).any(axis=0)
        back &= self._known_area.is_unmapped(ends)
        unseen = (hits.first_m > measured) & self._known_area.is_beside_unmapped(ends)
        known = explained | stopped | (self._known_area.contains(ends) & ~back & ~unseen)
        far = known & ~explained & (self._field.distance(ends[..., 0], ends[..., 1]) > _FAR_M + _TURNED * measured)
        at = np.where(_beside_another(far), 1.0, np.nan)
        return explained, known, np.where(through & known, hits.first_m / measured, at)

    def _crossed(
        self,
        poses: np.ndarray,
        scan: Scan,
        ends_m: np.ndarray,
        hits: SurfaceHits,
        stopped: np.ndarray,
    ) -> np.ndarray:
        """(P, B) bool: beams that went into something solid, and ended where the map knows something.

        Behind a pane there is free space, or a yard that the mapper did not see. Of a cupboard only the outline is
        drawn, and the inside is unknown. A beam that grazes a wall, or cuts a corner, is never far from the outline.
        """
        origin_m = se2.transform_points(poses, scan.base_from_laser[:2])[:, None]
        measured_m = np.hypot(*np.moveaxis(ends_m - origin_m, -1, 0))
        in_wall_m = np.minimum(hits.second_m, measured_m) - hits.first_m
        crossed = (hits.first_m < measured_m - _FAR_M - _INSIDE_M) & (in_wall_m < _THING_M)
        pose, beam = np.nonzero(crossed)
        first_m = hits.first_m[pose, beam]
        along = (ends_m - origin_m)[pose, beam] / measured_m[pose, beam, None]
        inside = origin_m[pose, 0] + (first_m + _INSIDE_M)[:, None] * along
        solid = stopped[pose, beam] | self._known_area.is_unmapped(inside)
        deep = self._field.distance(inside[:, 0], inside[:, 1]) > _DEEP_M + _TURNED * first_m
        crossed[pose, beam] = solid & deep
        return crossed & self._known_area.contains(ends_m)


def _beside_another(beams: np.ndarray) -> np.ndarray:
    """(P, B) bool: those beams that have a neighbour among them; one alone may have just missed a corner."""
    beside = np.zeros_like(beams)
    beside[:, 1:] |= beams[:, :-1]
    beside[:, :-1] |= beams[:, 1:]
    return beams & beside


def _used_beams(scan: Scan) -> Optional[np.ndarray]:
    """(B,) indices of the beams that are used; None: too few returned."""
    answered = np.flatnonzero(scan.answered)
    if len(answered) < _MIN_BEAMS:
        return None
    return answered[np.linspace(0, len(answered) - 1, min(_BEAMS, len(answered))).astype(int)]
