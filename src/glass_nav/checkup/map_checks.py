"""Checks that scans and map belong together: scans are matched everywhere, as they are, mirrored and scaled."""

from __future__ import annotations

from typing import Iterator, Sequence, Tuple

import numpy as np

from glass_nav.checkup.finding import Finding
from glass_nav.hypotheses import scan_alignment
from glass_nav.hypotheses.scan_matcher import ScanMatcher
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.world.grid_map import GridMap

MISMATCH = "map-mismatch"
SCANS = 16  # that are looked for, spread over the log
_MIN_SCANS, _MIN_POINTS = 5, 20
_MAX_POINTS, _COARSE = 150, 60
_FOUND, _REFINED = 100, 40  # places of a scan that are compared by more of its points, and those that are aligned
_MAX_BEHIND = 0.15  # of the scores of these places behind the best one
_MIN_FIT = 0.72  # median over the scans; own maps give 0.75 to 0.99, others 0.44 to 0.71
_GOOD_FIT, _FAIR_FIT = 0.9, 0.85  # mirrored and scaled ones are not tried then
_SCALED_FIT = 0.75  # of scans that fit a map but for its scale
_BETTER = 0.06  # another hypothesis fits so much better
_SCALES = (0.5, *1.05 ** np.arange(-6, 7), 2.0)
_FINE = 1.05 ** np.array([-0.5, -0.25, 0.0, 0.25, 0.5])
_MIRROR = np.array([1.0, -1.0])


class ScansOnMap:
    """Scans of one lidar, looked for in one map."""

    def __init__(self, grid_map: GridMap, points_m: Sequence[np.ndarray]) -> None:
        """
        Args:
            grid_map: with free and occupied cells.
            points_m: of each scan, (B, 2) finite end points in the robot's frame.
        """
        usable = [points for points in points_m if len(points) >= _MIN_POINTS]
        chosen = np.unique(np.linspace(0, len(usable) - 1, SCANS).astype(int)) if usable else []
        self._points = [usable[index][:: max(1, -(-len(usable[index]) // _MAX_POINTS))] for index in chosen]
        self._field = DistanceField(grid_map)
        self._matcher = ScanMatcher(grid_map, self._field)

    def __len__(self) -> int:
        return len(self._points)

    def fits(self, factor: np.ndarray, every: int = 1) -> np.ndarray:
        """How well each scan fits at its best place, 0..1.

        Args:
            factor: (2,) or (), on the points of the scans.
            every: 2: only each second scan.
        """
        return np.array([self._best(points * factor) for points in self._points[::every]])

    def _best(self, points: np.ndarray) -> float:
        places = self._matcher.search(points[:: max(1, len(points) // _COARSE)], _FOUND, _MAX_BEHIND)
        if not len(places.poses):
            return 0.0
        near = scan_alignment.fit(self._field, points, places.poses, scale_m=0.15)
        starts = places.poses[np.argsort(-near)[:_REFINED]]
        return float(scan_alignment.align(self._field, points, starts).fit.max())


def check_map(grid_map: GridMap) -> Iterator[Finding]:
    """Findings on the map alone."""
    free, occupied = float(grid_map.free.mean()), float(grid_map.occupied.mean())
    if not (grid_map.free.any() and grid_map.occupied.any()):
        yield Finding(
            "map-empty",
            f"the map has {100 * free:.1f} % free and {100 * occupied:.1f} % occupied cells",
            "look at negate, occupied_thresh and free_thresh in its yaml, and at the image",
        )
    elif occupied > 0.5 and occupied > 3.0 * free:
        yield Finding(
            "map-inverted",
            f"the map has {100 * occupied:.0f} % occupied and {100 * free:.1f} % free cells",
            "negate in its yaml is wrong, or the image has white walls",
        )


def check(scans: ScansOnMap, turns_opposite: bool) -> Iterator[Finding]:
    """Findings on scans and map together.

    Args:
        scans: of one lidar.
        turns_opposite: the scans turn the other way than odometry.
    """
    if len(scans) < _MIN_SCANS:
        return
    own = scans.fits(np.ones(2))
    fit = float(np.median(own))
    if fit >= _GOOD_FIT:
        return
    mirrored = scans.fits(_MIRROR)
    if np.median(mirrored) > fit + _BETTER and np.median(mirrored - own) > 0.5 * _BETTER:
        yield _mirrored(turns_opposite, fit, float(np.median(mirrored)))
        return
    if fit >= _FAIR_FIT:
        return
    factor, scaled = _best_factor(scans)
    if scaled > fit + 2.0 * _BETTER and scaled > _SCALED_FIT:
        scale = 1.0 / factor
        yield Finding(
            "map-scale",
            f"the scans fit the map by {fit:.2f} of 1 as it is, and by {scaled:.2f} were the map "
            f"{scale:.2f} times as large",
            f"the resolution in its yaml, times about {scale:.2f}, is right; or the lidar's ranges are scaled",
        )
    elif fit < _MIN_FIT:
        yield Finding(
            MISMATCH,
            f"the scans fit the map nowhere: by {fit:.2f} of 1 at their best places",
            "is it the map of this building and floor, and is it of this height above the floor? Look at "
            "scans and map in rviz; map anew if much was rebuilt",
        )


def _best_factor(scans: ScansOnMap) -> Tuple[float, float]:
    """The scale factor with which the scans fit the map best, and how well they then fit."""
    best = _best_of(scans, np.array(_SCALES), every=4)[0]
    return _best_of(scans, best * _FINE, every=2)


def _best_of(scans: ScansOnMap, factors: np.ndarray, every: int) -> Tuple[float, float]:
    fits = [float(np.median(scans.fits(factor, every))) for factor in factors]
    return float(factors[int(np.argmax(fits))]), max(fits)


def _mirrored(turns_opposite: bool, fit: float, mirrored: float) -> Finding:
    figures = f"by {fit:.2f} of 1 as they are, and by {mirrored:.2f} mirrored"
    if turns_opposite:
        return Finding(
            "lidar-mirrored",
            f"the scans fit the map {figures}, and turn the other way than odometry",
            "the lidar is mounted upside down: add roll 180 deg to its frame in the URDF or "
            "static_transform_publisher, or set the driver's option for it (inverted, reversed)",
        )
    return Finding(
        "map-mirrored",
        f"the scans fit the map {figures}, while their turns agree with odometry",
        "the image of the map is mirrored: flip it, and correct the origin in its yaml",
    )
