"""Buildings of straight walls and panes, worked out as lines: what a lidar in them measures, and their maps.

Independent of the ray caster, which knows cells only. The lines run along the centres of the map's cells.
W walls, B beams.
"""

from __future__ import annotations

from typing import List, Optional, Sequence, Tuple

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import GridMap

CELL_M = 0.05
BORDER_CELLS = 10
BASE_FROM_LASER = np.array([0.1, 0.05, 0.2])
RANGE_MAX_M = 12.0
SECOND_NS = 1_000_000_000


class Building:
    """Walls along x or y, with corners at multiples of CELL_M; some of them glass."""

    def __init__(
        self,
        outline: Sequence[Tuple[float, float]],
        panes: Sequence[Tuple[float, ...]] = (),
        walls: Sequence[Tuple[float, ...]] = (),
    ) -> None:
        """
        Args:
            outline: corners of the outer wall, in order.
            panes, walls: x0, y0, x1, y1 of what stands inside.
        """
        corners = np.array(outline, float)
        outer = np.hstack([corners, np.roll(corners, -1, axis=0)])
        self.lines_m = np.vstack([outer, np.reshape(walls, (-1, 4)), np.reshape(panes, (-1, 4))])
        self.is_pane = np.arange(len(self.lines_m)) >= len(outer) + len(walls)

    def grid_map(self) -> GridMap:
        """All lines, glass or not, one cell thick."""
        cells = np.rint(self.lines_m / CELL_M).astype(int).reshape(-1, 2)
        first = cells.min(axis=0) - BORDER_CELLS
        columns, rows = cells.max(axis=0) + BORDER_CELLS - first
        occupancy = np.zeros((rows, columns), np.int8)
        for x0, y0, x1, y1 in (cells - first).reshape(-1, 4):
            occupancy[min(y0, y1) : max(y0, y1) + 1, min(x0, x1) : max(x0, x1) + 1] = 100
        return GridMap(occupancy, CELL_M, np.append((first - 0.5) * CELL_M, 0.0))

    def crossings(self, map_from_laser: np.ndarray, angles_rad: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Ranges at which each beam crosses a line, ascending, and whether that is glass; (B, W), inf: no more."""
        ray = np.stack([np.cos(angles_rad + map_from_laser[2]), np.sin(angles_rad + map_from_laser[2])], -1)[:, None]
        line = self.lines_m[:, 2:] - self.lines_m[:, :2]
        to_line = self.lines_m[:, :2] - map_from_laser[:2]
        with np.errstate(divide="ignore", invalid="ignore"):
            cross = ray[..., 0] * line[:, 1] - ray[..., 1] * line[:, 0]
            along_ray = (to_line[:, 0] * line[:, 1] - to_line[:, 1] * line[:, 0]) / cross
            along_line = (to_line[:, 0] * ray[..., 1] - to_line[:, 1] * ray[..., 0]) / cross
            met = (along_ray > 0.0) & (along_line >= -1e-9) & (along_line <= 1.0 + 1e-9)
        ranges_m = np.where(met, along_ray, np.inf)
        order = np.argsort(ranges_m, axis=1)
        return np.take_along_axis(ranges_m, order, axis=1), self.is_pane[order] & np.isfinite(
            np.take_along_axis(ranges_m, order, axis=1)
        )

    def measured(
        self, map_from_laser: np.ndarray, angles_rad: np.ndarray, passes: Optional[np.ndarray] = None
    ) -> Tuple[np.ndarray, np.ndarray]:
        """Ranges and true cases (B,): beams that pass go through all glass, the others end at the first line."""
        ranges_m, glass = self.crossings(map_from_laser, angles_rad)
        passed = np.zeros(len(angles_rad), int)
        if passes is not None:
            passed = np.where(passes, np.argmin(glass, axis=1), 0)
        return ranges_m[np.arange(len(passed)), passed], np.choose(np.minimum(passed, 3), [1, 3, 4, 0])

    def scan(
        self,
        map_from_base: np.ndarray,
        stamp_ns: int = 0,
        rng: Optional[np.random.Generator] = None,
        noise_m: float = 0.01,
        beams: int = 180,
        glass_share: float = 0.0,
    ) -> Scan:
        """All round; without rng exact, and no beam passes glass."""
        angles_rad = np.linspace(-np.pi, np.pi, beams, endpoint=False)
        passes = None if rng is None else rng.random(beams) < glass_share
        ranges_m, _ = self.measured(se2.compose(map_from_base, BASE_FROM_LASER), angles_rad, passes)
        if rng is not None:
            ranges_m = ranges_m + rng.normal(0.0, noise_m, beams)
        return Scan(stamp_ns, ranges_m, angles_rad, 0.05, RANGE_MAX_M, BASE_FROM_LASER)


L_ROOM = Building([(0, 0), (6, 0), (6, 2.8), (4.6, 2.8), (4.6, 4), (0, 4)])
# Two rooms with a pane between them at x = 6 m; neither looks the same from two places.
GLASS_ROOM = Building(
    [(0, 0), (9, 0), (9, 3.2), (7.4, 3.2), (7.4, 4), (1.4, 4), (1.4, 2.8), (0, 2.8)], panes=[(6, 0, 6, 4)]
)
CORRIDOR = Building([(0, 0), (60, 0), (60, 2), (0, 2)])


def loop_drive(
    steps: int,
    centre: Tuple[float, float] = (2.6, 1.6),
    radii: Tuple[float, float] = (1.2, 0.7),
    step_rad: float = 0.16,
) -> List[np.ndarray]:
    """Poses of a robot that drives round an ellipse; each step turns and drives enough for an update."""
    at = step_rad * np.arange(steps)
    yaw = np.arctan2(radii[1] * np.cos(at), -radii[0] * np.sin(at))
    return list(np.stack([centre[0] + radii[0] * np.cos(at), centre[1] + radii[1] * np.sin(at), yaw], axis=-1))


def odometry(
    true: Sequence[np.ndarray], rng: np.random.Generator, way_share: float = 0.05, turn_share: float = 0.05
) -> List[np.ndarray]:
    """Odometry of a drive, each step wrong by a random share of its way and of its turn; starts at (5, -3, 1)."""
    poses = [np.array([5.0, -3.0, 1.0])]
    for before, after in zip(true[:-1], true[1:]):
        step = se2.compose(se2.inverse(before), after)
        step[:2] *= 1.0 + way_share * rng.standard_normal()
        step[2] *= 1.0 + turn_share * rng.standard_normal()
        poses.append(se2.compose(poses[-1], step))
    return poses


def off(pose: np.ndarray, true: np.ndarray) -> Tuple[float, float]:
    """Distance [m] and turn [rad] between two poses."""
    return float(np.hypot(*(pose - true)[:2])), float(abs(angles.wrap(pose[2] - true[2])))
