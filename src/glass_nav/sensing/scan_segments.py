"""Line segments in a scan, with the accuracy of each line.

Split and merge (geometry/segments.py) over the end points in their order around the robot, cut where neighbours are far
apart; then each line is fitted once more, every point weighing by how well a beam that meets a wall at that angle gives
the wall's place. After Arras and Siegwart (1997) and Diosi and Kleeman (2003). B beams, S segments.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import List, Optional

import numpy as np

from glass_nav.geometry import segments
from glass_nav.geometry.segments import NO_SEGMENT
from glass_nav.sensing.scan import Scan

_ALL_ROUND = 1.5  # steps between the last beam and the first


@dataclass(frozen=True)
class ScanSegmentParams:
    """Limits of the segments of a scan."""

    range_sigma_m: float = 0.02  # of a range
    bearing_sigma_rad: float = 0.004  # of a beam's direction: half a step of half a degree
    tolerance_m: float = 0.06  # no point of a segment lies further from its line
    gap_m: float = 0.5  # neighbours that are further apart are of two surfaces
    least_length_m: float = 0.3
    least_points: int = 6

    def __post_init__(self) -> None:
        for name in ("range_sigma_m", "tolerance_m", "gap_m", "least_length_m"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise ValueError(f"{name} must be finite and > 0 m, got {getattr(self, name)}")
        if not 0.0 <= self.bearing_sigma_rad < np.inf:
            raise ValueError(f"bearing_sigma_rad must be finite and >= 0, got {self.bearing_sigma_rad}")
        if not self.least_points >= 3:
            raise ValueError(f"least_points must be >= 3, got {self.least_points}")


@dataclass(frozen=True)
class ScanSegments:
    """Segments in the robot's frame; each has the lidar to its left."""

    segments_m: np.ndarray  # (S, 4) x1 y1 x2 y2
    covariance: np.ndarray  # (S, 2, 2) of heading [rad] and offset along the normal to the left [m] of their lines
    beam_segment: np.ndarray  # (B,) int: the segment of each beam, segments.NO_SEGMENT for none

    def __len__(self) -> int:
        return len(self.segments_m)


def extract(
    scan: Scan, params: ScanSegmentParams = ScanSegmentParams(), used: Optional[np.ndarray] = None
) -> ScanSegments:
    """Fits all segments of a scan.

    Args:
        scan: one sweep of a lidar, its beams in either direction.
        params: what makes a segment.
        used: (B,) bool: the beams to look at, of those that answered; None: all. Mirrored ones draw walls that are not
            there.
    """
    points = scan.points_in_base()
    chosen = scan.answered if used is None else scan.answered & used
    label = np.full(len(scan), NO_SEGMENT)
    rows: List[np.ndarray] = []
    covariances: List[np.ndarray] = []
    for chain in _chains(scan, points, chosen, params.gap_m):
        found, its = segments.split_and_merge(points[chain], params.tolerance_m, params.least_length_m)
        for number in range(len(found)):
            beams = chain[its == number]
            if len(beams) < params.least_points:
                continue
            row, covariance = _fitted(points[beams], found[number], scan.base_from_laser[:2], params)
            label[beams] = len(rows)
            rows.append(row)
            covariances.append(covariance)
    return ScanSegments(np.array(rows).reshape(-1, 4), np.array(covariances).reshape(-1, 2, 2), label)


def _chains(scan: Scan, points: np.ndarray, chosen: np.ndarray, gap_m: float) -> List[np.ndarray]:
    """Beams in their order counterclockwise, cut where neighbours are far apart; an all-round scan is a ring."""
    order = np.argsort(scan.angles_rad, kind="stable")
    beams = order[chosen[order]]
    if len(beams) < 2:
        return []
    step = np.median(np.diff(scan.angles_rad[order]))
    open_rad = 2.0 * np.pi - (scan.angles_rad[order[-1]] - scan.angles_rad[order[0]])
    apart_m = np.hypot(*(points[np.roll(beams, -1)] - points[beams]).T)
    cut = apart_m > gap_m
    if open_rad > _ALL_ROUND * step:
        cut[-1] = True
    cuts = np.flatnonzero(cut)
    if not len(cuts):  # a ring begins at its farthest point, which is a corner
        return [np.roll(beams, -int(np.argmax(scan.ranges_m[beams])))]
    begin = int(cuts[-1]) + 1
    return np.split(np.roll(beams, -begin), np.mod(cuts[:-1] + 1 - begin, len(beams)))


def _fitted(
    points: np.ndarray, segment: np.ndarray, laser_m: np.ndarray, params: ScanSegmentParams
) -> "tuple[np.ndarray, np.ndarray]":
    """The segment (4,) once more by the weights that its first line gives, and its covariance (2, 2)."""
    along = (segment[2:] - segment[:2]) / np.hypot(*(segment[2:] - segment[:2]))
    beam = points - laser_m
    range_m = np.hypot(*beam.T)
    cos = np.abs(beam[:, 1] * along[0] - beam[:, 0] * along[1]) / np.maximum(range_m, 1e-9)  # of incidence
    sin_squared = np.maximum(1.0 - cos**2, 0.0)
    variance = (params.range_sigma_m * cos) ** 2 + (params.bearing_sigma_rad * range_m) ** 2 * sin_squared
    return segments.weighted_fit(points, np.maximum(variance, 1e-12))
