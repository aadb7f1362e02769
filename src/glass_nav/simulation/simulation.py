"""Simulates a driving robot with lidar and odometry, and records the ground truth.

One seed determines everything: the moved furniture, the lidar's noise, the robot's wheels. The same seed gives the same
bytes, and the noise of one part does not depend on the draws of another. Times are simulated; nothing waits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Iterator, List, Optional, Tuple, Union

import numpy as np

from glass_nav.geometry import se2
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.sensing.scan import Scan, scan_from_fields
from glass_nav.simulation import lidar, path_follower, turning
from glass_nav.simulation.building import Building
from glass_nav.simulation.landmark_scanner import LandmarkScanner, ScannerModel, Turn
from glass_nav.simulation.lidar import LidarModel, TrueScan
from glass_nav.simulation.odometry import WHEEL_RADIUS_M, Odometry, OdometryParams
from glass_nav.simulation.path_follower import PathFollower, PathFollowerParams
from glass_nav.simulation.robot import Obstacles, Robot, RobotParams

START_NS = 1_600_000_000 * 10**9  # of every run: a plausible stamp, independent of when it was made
CONTROL_S = 0.02  # longest time between commands to the base and readings of its wheels
STUCK_S = 5.0  # a follower without progress for this long gives up; a turn in place takes 3 s
LASER = (0.12, 0.0, 0.0)  # in front of the robot's centre
EMITTER = (0.0, 0.0, 0.0)  # of the landmark scanner


class SimulationError(ValueError):
    """A run that cannot continue; one line."""


@dataclass(frozen=True)
class OdometrySample:
    """A reading of the wheels."""

    stamp_ns: int
    odom_from_base: np.ndarray  # (3,)
    velocity: np.ndarray  # (3,) forward, left [m/s], turn [rad/s]
    wheels_rad: Optional[np.ndarray] = None  # (2,) how far the left and the right wheel turned; None: it has others


@dataclass(frozen=True)
class Frame:
    """One sweep of the lidar, and the true pose of the robot."""

    stamp_ns: int  # of the first beam
    map_from_base: np.ndarray  # (3,) truth at the stamp
    odom_from_base: np.ndarray  # (3,) at the stamp
    scan: Scan
    truth: TrueScan
    odometry: Tuple[OdometrySample, ...]  # all readings since the previous frame, the last one at the last beam
    blocked: bool  # an obstacle stopped the robot since then


@dataclass(frozen=True)
class _Moment:
    """A true pose, and what odometry reported."""

    stamp_ns: int
    map_from_base: np.ndarray  # (3,)
    odom_from_base: np.ndarray  # (3,)


class Simulation:
    """A robot in a building: give it commands, or let it follow a path."""

    def __init__(
        self,
        building: Building,
        lidar_model: LidarModel,
        robot: RobotParams = RobotParams(),
        odometry: OdometryParams = OdometryParams(),
        base_from_laser: "Union[Tuple[float, float, float], np.ndarray]" = LASER,
        seed: int = 0,
        scan_rate_hz: float = 10.0,
        changed_share: float = 0.0,
        start: Optional[np.ndarray] = None,
        turn_time_s: float = 0.0,
        scanner: Optional[ScannerModel] = None,
        base_from_emitter: "Union[Tuple[float, float, float], np.ndarray]" = EMITTER,
    ) -> None:
        """
        Args:
            base_from_laser: (3,) where the laser sits.
            seed: >= 0.
            changed_share: of the movable things that were moved since the map was drawn.
            start: (3,) map_from_base; by default the building's own; drive() then begins at the start of its path.
            turn_time_s: from the first beam of a sweep to the last; 0: all at one moment.
            scanner: searches for the building's tags, if given.
            base_from_emitter: (3,) where the scanner sits.

        Raises:
            ValueError: a value out of its range, or no room for the robot at the start.
        """
        if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or seed < 0:
            raise ValueError(f"seed must be a whole number >= 0, got {seed!r}")
        if not 0.1 <= scan_rate_hz <= 1000.0:
            raise ValueError(f"scan rate must be 0.1 to 1000 Hz, got {scan_rate_hz}")
        if not 0.0 <= turn_time_s * scan_rate_hz <= 1.0:
            raise ValueError(
                f"a turn of the lidar must take >= 0 s and no longer than the scan period of "
                f"{1.0 / scan_rate_hz:g} s, got {turn_time_s}"
            )
        if np.shape(base_from_laser) != (3,) or not np.all(np.isfinite(base_from_laser)):
            raise ValueError(f"the laser's pose on the robot must be finite x, y, yaw, got {base_from_laser}")
        if np.shape(base_from_emitter) != (3,) or not np.all(np.isfinite(base_from_emitter)):
            raise ValueError(f"the emitter's pose on the robot must be finite x, y, yaw, got {base_from_emitter}")
        furniture, wheels, light = np.random.SeedSequence(seed).spawn(3)
        self.building = building.changed(changed_share, np.random.default_rng(furniture))
        self.lidar_model, self.scan_period_s = lidar_model, 1.0 / scan_rate_hz
        self._turn_ns = round(turn_time_s * 1e9)
        self.base_from_laser = np.array(base_from_laser, float)
        self._lidar_rng = np.random.default_rng(light)
        surfaces = self.building.surfaces
        self._obstacles = Obstacles(np.stack([surfaces.from_m, surfaces.to_m], axis=1)[surfaces.present])
        self._robot_params = robot
        self._wheels = Odometry(odometry, robot.kind, np.random.default_rng(wheels))
        self._time_ns = 0  # since the start
        self._blocked = False
        self._robot = self._robot_at(building.start if start is None else np.asarray(start, float))
        self._start_given = start is not None
        self._readings: List[OdometrySample] = [self.reading]
        self._track: List[_Moment] = [self._moment]  # of the last sweep of the lidar
        self.base_from_emitter = np.array(base_from_emitter, float)
        self._scanner = None if scanner is None else LandmarkScanner(scanner, self.building)

    @property
    def stamp_ns(self) -> int:
        return START_NS + self._time_ns

    @property
    def map_from_base(self) -> np.ndarray:
        """(3,) truth, now."""
        return self._robot.map_from_base

    @property
    def reading(self) -> OdometrySample:
        """The present reading of the wheels."""
        rolled_m = self._wheels.rolled_m
        wheels_rad = None if rolled_m is None else rolled_m / WHEEL_RADIUS_M
        return OdometrySample(self.stamp_ns, self._wheels.odom_from_base, self._wheels.velocity, wheels_rad)

    @property
    def blocked(self) -> bool:
        """Whether an obstacle blocks the robot now."""
        return self._robot.blocked

    def step(self, dt_s: float, command: np.ndarray) -> Frame:
        """Move for a time and take a scan: move() and look()."""
        self.move(dt_s, command)
        return self.look()

    def move(self, dt_s: float, command: np.ndarray) -> None:
        """Move for a time without a scan.

        Args:
            dt_s: >= 1e-6.
            command: (3,) velocity: forward, left [m/s], turn [rad/s].
        """
        if not 1e-6 <= dt_s < math.inf:
            raise ValueError(f"a step must take >= 1e-6 s, got {dt_s}")
        for end_ns in self._control_times(round(dt_s * 1e9)):
            self._control(end_ns, command)

    def take_turns(self) -> List[Turn]:
        """Sweeps of the landmark scanner that ended since the last call."""
        if self._scanner is None:
            return []
        return [
            Turn(
                START_NS + turn.stamp_ns,
                tuple(replace(bearing, stamp_ns=START_NS + bearing.stamp_ns) for bearing in turn.bearings),
            )
            for turn in self._scanner.take_turns()
        ]

    def look(self) -> Frame:
        """Simulates a sweep that ends now. If no sweep fits into the time so far, it is instantaneous."""
        model = self.lidar_model
        turn_ns = self._turn_ns if self._turn_ns <= self._time_ns else 0
        stamp_ns = self.stamp_ns - turn_ns
        track = Trajectory(
            np.array([moment.stamp_ns for moment in self._track], np.int64),
            np.array([moment.map_from_base for moment in self._track]),
        )
        map_from_base = track.at(np.int64(stamp_ns))
        if turn_ns:
            knots_ns = np.append(stamp_ns, track.stamps_ns[track.stamps_ns > stamp_ns])
            map_from_laser = Trajectory(knots_ns, se2.compose(track.at(knots_ns), self.base_from_laser))
            truth = turning.scan(model, self.building, map_from_laser, turn_ns, START_NS, self._lidar_rng)
        else:
            truth = lidar.scan(
                model,
                self.building,
                se2.compose(map_from_base, self.base_from_laser),
                self._time_ns * 1e-9,
                self._lidar_rng,
            )
        angles_rad = model.angles_rad
        ranges_m = truth.ranges_m.astype(np.float32)  # the precision of a LaserScan
        scan = scan_from_fields(
            stamp_ns,
            ranges_m,
            float(angles_rad[0]),
            float(angles_rad[1] - angles_rad[0]),
            model.range_min_m,
            model.range_max_m,
            self.base_from_laser,
            time_increment_s=turn_ns * 1e-9 / (model.beams - 1),
            intensities=truth.intensity.astype(np.float32),
        )
        odom_from_base = Trajectory(track.stamps_ns, np.array([moment.odom_from_base for moment in self._track])).at(
            np.int64(stamp_ns)
        )
        readings, self._readings = tuple(self._readings), []
        blocked, self._blocked = self._blocked, False
        return Frame(stamp_ns, map_from_base, odom_from_base, scan, truth, readings or (self.reading,), blocked)

    def follower(self, path: "Union[str, np.ndarray]", p: PathFollowerParams = PathFollowerParams()) -> PathFollower:
        """For a path by name or file, see path_follower.find(), or waypoints (W, 2). A robot that has not moved yet
        is put at its start.

        Raises:
            PathError: no such path, or none that can be driven.
        """
        if isinstance(path, str):
            path = path_follower.find(path, self.building)
        follower = PathFollower(path, self._robot_params, p)
        if self._time_ns == 0 and not self._start_given:
            self._robot = self._robot_at(follower.start)
            self._track = [self._moment]
        return follower

    def drive(self, path: "Union[str, np.ndarray]", p: PathFollowerParams = PathFollowerParams()) -> Iterator[Frame]:
        """Follow a path; yields a frame at once and one at every sweep, until the robot stands at the end.

        Raises:
            PathError: no such path.
            SimulationError: something blocks the path.
        """
        follower = self.follower(path, p)
        yield self.look()
        best_m, still_s = 0.0, 0.0
        while not (follower.done and self._robot.standing):
            yield self.follow(follower)
            still_s = 0.0 if follower.progress_m > best_m + 1e-3 or follower.done else still_s + self.scan_period_s
            best_m = max(best_m, follower.progress_m)
            if still_s > STUCK_S:
                x, y, _ = self.map_from_base
                raise SimulationError(
                    f"{self.building.name}: the robot is stuck at x {x:.2f} m, y {y:.2f} m after "
                    f"{follower.progress_m:.1f} of {follower.length_m:.1f} m: something stands in "
                    "the way of the path"
                )

    def follow(self, follower: PathFollower) -> Frame:
        """Drive along the path until the next sweep."""
        for end_ns in self._control_times(round(self.scan_period_s * 1e9)):
            self._control(end_ns, follower.command(self.map_from_base))
        return self.look()

    def _control_times(self, whole_ns: int) -> List[int]:
        """Ends of the control steps of a period, which are about equally long."""
        parts = -(-whole_ns // round(CONTROL_S * 1e9))
        return [self._time_ns + whole_ns * part // parts for part in range(1, parts + 1)]

    def _control(self, end_ns: int, command: np.ndarray) -> None:
        """Send the base a command and, at the end of the step, read its wheels."""
        part_s = (end_ns - self._time_ns) * 1e-9
        self._wheels.step(self._robot.step(command, part_s), part_s)
        self._time_ns = end_ns
        if self._scanner is not None:
            self._scanner.step(end_ns, se2.compose(self.map_from_base, self.base_from_emitter))
        self._blocked = self._blocked or self._robot.blocked
        self._readings.append(self.reading)
        self._track.append(self._moment)
        while len(self._track) > 2 and self._track[1].stamp_ns <= self.stamp_ns - self._turn_ns:
            del self._track[0]

    @property
    def _moment(self) -> "_Moment":
        return _Moment(self.stamp_ns, self.map_from_base, self._wheels.odom_from_base)

    def _robot_at(self, map_from_base: np.ndarray) -> Robot:
        if map_from_base.shape != (3,) or not np.all(np.isfinite(map_from_base)):
            raise ValueError(f"the robot's start must be finite x, y, yaw, got {map_from_base.tolist()}")
        gap_m, radius_m = self._obstacles.clearance(map_from_base[:2]), self._robot_params.radius_m
        if gap_m < radius_m:
            x, y, _ = map_from_base
            raise SimulationError(
                f"{self.building.name}: no room for the robot at x {x:.2f} m, y {y:.2f} m: its "
                f"radius is {radius_m:g} m, the nearest obstacle {gap_m:.2f} m away"
            )
        return Robot(self._robot_params, map_from_base, self._obstacles)
