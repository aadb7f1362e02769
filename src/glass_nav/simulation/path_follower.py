"""Follows waypoints by pure pursuit: steers for a point a short distance ahead on the path.

The point ahead continues beyond the end, so that steering stays calm there; an omnidirectional base drives to it
directly.
W waypoints; poses, velocities as in robot.py.
"""

from __future__ import annotations

import difflib
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, List, Tuple

import numpy as np

from glass_nav.geometry import polyline, pure_pursuit
from glass_nav.geometry.polyline import Polyline
from glass_nav.simulation.building import Building
from glass_nav.simulation.robot import RobotParams

TURN_ON_THE_SPOT_RAD = 1.0  # the base first turns towards a point farther off to the side
FIRST = "first"  # the name that stands for a building's first path
CREEP_M_S = 0.02  # so that it arrives despite braking


class PathError(ValueError):
    """A path that cannot be driven; one line."""


@dataclass(frozen=True)
class PathFollowerParams:
    """How a path is driven."""

    speed_m_s: float = 0.6
    lookahead_m: float = 0.5  # corners are cut by about a quarter of it
    lateral_acceleration_m_s2: float = 0.4  # slower in bends

    def __post_init__(self) -> None:
        for name, unit in (("speed_m_s", "m/s"), ("lookahead_m", "m"), ("lateral_acceleration_m_s2", "m/s^2")):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(
                    f"{name} of the path follower must be > 0 {unit} and finite, got {getattr(self, name)}"
                )


class PathFollower:
    """Commands a base along a path from start to end, then stops it."""

    def __init__(
        self, waypoints_m: np.ndarray, robot: RobotParams, p: PathFollowerParams = PathFollowerParams()
    ) -> None:
        """
        Args:
            waypoints_m: (W, 2) in the frame map; repeated points are dropped.

        Raises:
            PathError: fewer than two different points, or one that is not finite.
        """
        self._p, self._robot = p, robot
        self._line = Polyline(_distinct(waypoints_m))
        self.length_m = self._line.length
        self.progress_m = 0.0
        self.done = False

    @property
    def start(self) -> np.ndarray:
        """(3,) pose at the first point, facing the second."""
        x, y = self._line.direction(0.0)
        return np.array([*self._line.points[0], math.atan2(y, x)])

    def back(self) -> "PathFollower":
        """A follower for the same path backwards."""
        return PathFollower(self._line.points[::-1], self._robot, self._p)

    def command(self, map_from_base: np.ndarray) -> np.ndarray:
        """(3,) velocity that moves a base at that pose along the path; zero at its end."""
        self.progress_m = self._line.nearest(
            np.asarray(map_from_base[:2], float), self.progress_m, 2.0 * self._p.lookahead_m
        )
        remaining_m = self.length_m - self.progress_m
        self.done = self.done or remaining_m < 0.01
        if self.done:
            return np.zeros(3)
        to_point = self._line.at(self.progress_m + self._p.lookahead_m) - map_from_base[:2]
        distance_m = float(np.linalg.norm(to_point))
        bearing = math.remainder(math.atan2(to_point[1], to_point[0]) - float(map_from_base[2]), 2.0 * math.pi)
        braking = pure_pursuit.braking_speed(remaining_m, self._robot.max_acceleration_m_s2) + CREEP_M_S
        speed = min(self._p.speed_m_s, self._robot.max_speed_m_s, braking)
        if self._robot.kind == "omni":
            return self._sliding(bearing, speed)
        return self._steering(bearing, distance_m, speed)

    def _steering(self, bearing: float, distance_m: float, speed: float) -> np.ndarray:
        """Velocity along the arc through the point, after a turn on the spot if the point is not ahead."""
        if abs(bearing) > TURN_ON_THE_SPOT_RAD:
            return pure_pursuit.on_the_spot(bearing, self._robot)
        curvature = pure_pursuit.curvature_towards(bearing, distance_m)
        return pure_pursuit.along_arc(curvature, self._robot, speed, self._p.lateral_acceleration_m_s2)

    def _sliding(self, bearing: float, speed: float) -> np.ndarray:
        """Velocity straight to the point while turning towards it."""
        x, y = self._line.direction(self.progress_m)
        ahead = self._line.direction(self.progress_m + self._p.lookahead_m)
        turn = float(pure_pursuit.on_the_spot(bearing, self._robot)[2])
        speed *= max(0.3, float(x * ahead[0] + y * ahead[1]))  # slower before a corner
        return np.array([speed * math.cos(bearing), speed * math.sin(bearing), 0.5 * turn])


def find(wanted: str, building: Building) -> np.ndarray:
    """Waypoints (W, 2) [m] of a path.

    Args:
        wanted: the name of a path of the building, "first" for its first one, or a file; see load().

    Raises:
        PathError: none of these.
    """
    paths = building.paths
    if wanted in paths:
        return paths[wanted]
    if wanted == FIRST:
        if not paths:
            raise PathError(f"{building.name}: has no path; give a file of waypoints")
        return next(iter(paths.values()))
    if Path(wanted).suffix or Path(wanted).is_file():
        return load(Path(wanted))
    near = difflib.get_close_matches(wanted, list(paths), n=1)
    hint = f"; did you mean {near[0]}?" if near else ""
    raise PathError(f"{building.name}: no path {wanted!r}, it has {', '.join(paths) or 'none'}{hint}")


def load(path: Path) -> np.ndarray:
    """Waypoints (W, 2) [m] of a file: yaml, a list of [x, y]; or lines of x and y, with a comma or a blank between.

    Raises:
        PathError: no such file, or it does not hold waypoints.
    """
    try:
        text = path.read_text()
    except (OSError, UnicodeDecodeError) as err:
        reason = err.strerror if isinstance(err, OSError) and err.strerror else str(err)
        raise PathError(f"{path}: cannot be read: {reason}") from err
    rows = _yaml_rows(path, text) if path.suffix in (".yaml", ".yml") else _lines(text)
    points: List[Tuple[float, float]] = []
    for number, row in rows:
        try:
            x, y = (float(value) for value in row)
        except (TypeError, ValueError) as err:
            raise PathError(f"{path}: waypoint {number} must be x and y in m, got {row!r}") from err
        points.append((x, y))
    try:
        return _distinct(np.array(points).reshape(-1, 2))
    except PathError as err:
        raise PathError(f"{path}: {err}") from err


def _yaml_rows(path: Path, text: str) -> "List[Tuple[int, Any]]":
    import yaml

    try:
        rows = yaml.safe_load(text)
    except yaml.YAMLError as err:
        raise PathError(f"{path}: is not yaml: {' '.join(str(err).split())}") from err
    if not isinstance(rows, list):
        raise PathError(f"{path}: must be a list of waypoints [x, y] in m, got {type(rows).__name__}")
    return list(enumerate(rows, 1))


def _lines(text: str) -> "List[Tuple[int, Any]]":
    lines = [line.partition("#")[0].replace(",", " ").split() for line in text.splitlines()]
    return [(number, words) for number, words in enumerate(filter(None, lines), 1)]


def _distinct(waypoints_m: np.ndarray) -> np.ndarray:
    points = np.asarray(waypoints_m, float)
    if points.ndim != 2 or points.shape[1] != 2:
        raise PathError(f"a path needs waypoints (W, 2), got {points.shape}")
    if not np.all(np.isfinite(points)):
        bad = int(np.nonzero(~np.isfinite(points).all(axis=1))[0][0])
        raise PathError(f"waypoint {bad + 1} of the path is not finite: {points[bad].tolist()}")
    points = polyline.distinct(points)
    if len(points) < 2:
        raise PathError(f"a path needs 2 different waypoints, got {len(points)}")
    return points
