"""Finds glass that the map lacks, and mapped walls that are gone, by tracking the robot through the map.

The robot is looked for in the whole map, and followed where it is found. B beams.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Iterator, List, Optional, Sequence, Tuple

import numpy as np
from scipy import ndimage

from glass_nav.checkup.finding import Finding
from glass_nav.geometry import se2
from glass_nav.hypotheses import scan_alignment
from glass_nav.hypotheses.global_search import GlobalSearch, SearchParams
from glass_nav.hypotheses.scan_matcher import ScanMatcher
from glass_nav.panes.pane_finder import PaneFinder
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.raycast import RayCaster
from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import GridMap
from glass_nav.world.pane import Pane

_MAX_SCANS = 300
_STEP_M, _STEP_RAD = 0.15, 0.2  # between scans that are followed
_MIN_POINTS, _MAX_POINTS = 20, 150
_LOST_FIT, _LOST_SCANS = 0.6, 10  # a pose that fits less is not trusted, and after so many scans searched for again
_COVARIANCE = np.diag([0.03**2, 0.03**2, 0.01**2])  # of a pose that fits
_GLASS_PROBABILITY = 0.9  # of a pane that is named
_MAX_DOUBT = 0.01  # probability that none of the panes is real, above which none is named
_MIN_LENGTH_M = 1.5  # of panes, or of a wall that is gone: an open door is shorter
_LEAST_PASSES, _LEAST_HEAD_ON = 3, 8  # beams through a cell of a wall that is gone, and along the normal of all of it
_MOST_RETURNS = 0.1  # of a wall that is gone, over the beams that pass
_HEAD_ON_COS = np.cos(np.radians(3.0))
_BEHIND_M, _AT_WALL_M, _MIN_COS, _MIN_LINEARITY = 0.3, 0.15, 0.3, 0.9
_NAMED = 3  # places in a finding


@dataclass(frozen=True)
class Followed:
    """Scans at poses in the map."""

    scans: List[Scan]
    map_from_base: np.ndarray  # (N, 3)


def check(grid_map: GridMap, scans: Sequence[Scan], odom_from_base: np.ndarray) -> Iterator[Finding]:
    """Findings on what the map lacks and what it should not have.

    Args:
        grid_map: that the scans fit.
        scans: of one lidar, in order.
        odom_from_base: (N, 3) at their stamps.
    """
    followed = follow(grid_map, scans, odom_from_base)
    if not followed.scans:
        return
    finder = PaneFinder(grid_map)
    for scan, pose in zip(followed.scans, followed.map_from_base):
        finder.observe(scan, pose, _COVARIANCE)
    panes = [pane for pane in finder.panes() if pane.probability >= _GLASS_PROBABILITY]
    length_m = sum(pane.length_m for pane in panes)
    if length_m >= _MIN_LENGTH_M and np.prod([1.0 - pane.probability for pane in panes]) <= _MAX_DOUBT:
        yield _glass_not_mapped(panes, length_m)
    gone = _gone_walls(grid_map, followed)
    if gone:
        yield _wall_is_gone(gone)


def follow(grid_map: GridMap, scans: Sequence[Scan], odom_from_base: np.ndarray) -> Followed:
    """The scans a step apart whose poses are certain: found among all places of the map, then aligned one by one, back to
    the first and on to the last.
    """
    field = DistanceField(grid_map)
    matcher = ScanMatcher(grid_map, field)
    chosen = _spread(odom_from_base)
    scans, odom_from_base = [scans[index] for index in chosen], odom_from_base[chosen]
    poses = np.full((len(scans), 3), np.nan)
    begin = 0
    while begin < len(scans):
        found = _found(matcher, field, scans, odom_from_base, begin)
        if found is None:
            break
        at, poses[at] = found
        for order in (range(at, begin - 1, -1), range(at, len(scans))):
            _align(field, scans, odom_from_base, poses, order)
        begin = int(np.flatnonzero(np.isfinite(poses[:, 0]))[-1]) + 1 + _LOST_SCANS
    kept = np.isfinite(poses[:, 0])
    return Followed([scan for scan, keep in zip(scans, kept) if keep], poses[kept])


def _found(
    matcher: ScanMatcher, field: DistanceField, scans: Sequence[Scan], odom_from_base: np.ndarray, begin: int
) -> Optional[Tuple[int, np.ndarray]]:
    """The first scan from `begin` on that determines the pose, with that pose (3,); None if no scan does."""
    search = GlobalSearch(matcher, field, SearchParams())
    for index in range(begin, len(scans)):
        candidates = search.update(scans[index], odom_from_base[index])
        if candidates.found and candidates.fit >= _LOST_FIT:
            return index, candidates.poses[0]
    return None


def _align(
    field: DistanceField, scans: Sequence[Scan], odom_from_base: np.ndarray, poses: np.ndarray, order: range
) -> None:
    """Fill in the poses (N, 3) of scans in the given order, from a known pose on, until too many do not fit."""
    pose, before, lost = poses[order[0]], odom_from_base[order[0]], 0
    for index in order[1:]:
        pose = se2.compose(pose, se2.compose(se2.inverse(before), odom_from_base[index]))
        before, points = odom_from_base[index], _points(scans[index])
        if len(points) < _MIN_POINTS:
            continue
        aligned = scan_alignment.align(field, points, pose[None])
        lost = 0 if aligned.fit[0] >= _LOST_FIT else lost + 1
        if lost > _LOST_SCANS:
            return
        if not lost:
            pose = poses[index] = aligned.poses[0]


def _spread(odom_from_base: np.ndarray) -> np.ndarray:
    """Indices of scans that are at least a step of odometry apart, beginning with the first."""
    chosen = [0]
    for index in range(1, len(odom_from_base)):
        step = se2.compose(se2.inverse(odom_from_base[chosen[-1]]), odom_from_base[index])
        if np.hypot(step[0], step[1]) >= _STEP_M or abs(step[2]) >= _STEP_RAD:
            chosen.append(index)
        if len(chosen) == _MAX_SCANS:
            break
    return np.array(chosen)


def _points(scan: Scan) -> np.ndarray:
    """(B, 2) finite end points in the robot's frame, not too many."""
    points = scan.points_in_base()
    points = points[np.isfinite(points).all(axis=1)]
    return points[:: max(1, -(-len(points) // _MAX_POINTS))]


def _gone_walls(grid_map: GridMap, followed: Followed) -> List[Tuple[np.ndarray, float]]:
    """Middle (2,) and length [m] of walls of the map that beams pass in all directions, the longest first.

    A pane returns nearly all beams that come along its normal: a wall that lets those pass as well is not there.
    """
    passes, returns, head_on_passes, head_on_returns = _crossings(grid_map, followed)
    gone = (passes >= _LEAST_PASSES) & (returns <= _MOST_RETURNS * passes)
    parts, count = ndimage.label(ndimage.binary_dilation(gone, np.ones((3, 3), bool)), np.ones((3, 3), bool))
    walls = []
    for number in range(1, count + 1):
        cells = gone & (parts == number)
        points = grid_map.centres(*np.nonzero(cells))
        length_m = float(np.hypot(*np.ptp(points, axis=0))) + grid_map.resolution_m
        let_pass = int(head_on_passes[cells].sum())
        answers_nowhere = head_on_returns[cells].sum() <= _MOST_RETURNS * let_pass
        if length_m >= _MIN_LENGTH_M and let_pass >= _LEAST_HEAD_ON and answers_nowhere:
            walls.append((points.mean(axis=0), length_m))
    return sorted(walls, key=lambda wall: -wall[1])


def _crossings(grid_map: GridMap, followed: Followed) -> np.ndarray:
    """(4, H, W) beams that passed or ended at each wall cell, and those of them that came along its normal."""
    caster = RayCaster(grid_map)
    cells: List[List[np.ndarray]] = [[], [], [], []]
    for scan, pose in zip(followed.scans, followed.map_from_base):
        from_laser = se2.compose(pose, scan.base_from_laser)
        hits = caster.cast_surfaces(from_laser[None], scan.angles_rad, scan.range_max_m)
        cell, first_m = hits.first_cell[0], hits.first_m[0]
        cos = np.abs(np.cos(from_laser[2] + scan.angles_rad - hits.normal_rad[0]))
        with np.errstate(invalid="ignore"):
            across_m = (scan.ranges_m - first_m) * cos
            met = np.isfinite(across_m) & (hits.linearity[0] >= _MIN_LINEARITY) & (cos >= _MIN_COS)
            passed, ended = met & (across_m > _BEHIND_M), met & (np.abs(across_m) <= _AT_WALL_M)
            head_on = cos >= _HEAD_ON_COS
        passed[1:-1] &= passed[:-2] & passed[2:]  # not by its edge
        for kind, beams in zip(cells, (passed, ended, passed & head_on, ended & head_on)):
            kind.append(cell[beams])
    counts = [np.bincount(np.concatenate(kind), minlength=grid_map.occupancy.size) for kind in cells]
    return np.array(counts).reshape(4, *grid_map.occupancy.shape)


def _glass_not_mapped(panes: Sequence[Pane], length_m: float) -> Finding:
    longest = sorted(panes, key=lambda pane: -pane.length_m)
    return Finding(
        "glass-not-mapped",
        f"the map lacks {length_m:.1f} m of glass, in {_count(len(panes), 'pane')}: "
        + _places([(0.5 * (pane.start_m + pane.end_m), pane.length_m) for pane in longest]),
        "draw it in: glass_nav map panes BAG --map MAP.yaml --out DIR, and look at DIR/panes.png; until then the pose "
        "holds, but what is behind these panes counts as unexplained and costmaps do not see them",
    )


def _wall_is_gone(walls: Sequence[Tuple[np.ndarray, float]]) -> Finding:
    length_m = sum(length_m for _, length_m in walls)
    return Finding(
        "wall-is-gone",
        f"beams pass {length_m:.1f} m of walls of the map in all directions, in {_count(len(walls), 'piece')}: "
        + _places(walls),
        "erase them from the image of the map, or map anew if much was rebuilt",
    )


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def _places(lengths: Sequence[Tuple[np.ndarray, float]]) -> str:
    named = ", ".join(
        f"{length_m:.1f} m at x {middle[0]:.1f} m, y {middle[1]:.1f} m" for middle, length_m in lengths[:_NAMED]
    )
    return named if len(lengths) <= _NAMED else f"{named} and others"
