"""Chooses the initial pose: the one given last, the one of the pose file, or the default."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Callable, Optional, Tuple

import numpy as np

from glass_nav.geometry import se2
from glass_nav.localization import initial_pose, saved_pose
from glass_nav.localization.initial_pose import PoseGuess, StartPose
from glass_nav.localization.method import PoseFilter
from glass_nav.localization.saved_pose import PoseFile
from glass_nav.world.grid_map import GridMap

GUESS_WAIT_S = 1.0  # how long a given pose waits for a scan at or after its stamp

OdometryAt = Callable[[int], np.ndarray]  # stamp [ns] -> odom_from_base (3,); ValueError if it is not known

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Waiting:
    """A given pose, and when it came."""

    guess: PoseGuess
    arrival_s: float


class InitialPoses:
    """The start that was asked for last, until there is a scan to make it with."""

    def __init__(self, default: StartPose, start_without_guess: bool, file: PoseFile, odometry_at: OdometryAt) -> None:
        """
        Args:
            default: where to start if nothing else is known.
            start_without_guess: search the whole map then instead.
            file: the pose of the last run.
            odometry_at: moves a given pose forward to the scan that it meets.
        """
        self._file, self._odometry_at = file, odometry_at
        self._waiting: Optional[_Waiting] = None
        self._pose_file_waits = bool(file.pose_file)
        self._default = default.pose, default.covariance
        self._home: Optional[Tuple[np.ndarray, np.ndarray]] = None if start_without_guess else self._default
        self._whose = "the pose of its parameters"

    def begin(self, localizer: PoseFilter) -> str:
        """Place the particles of a new localizer; where, in words that go on a sentence."""
        if self._home is None:
            try:
                localizer.scatter()
            except ValueError as err:
                _log.warning(f"no search of the whole map: {err}; starting at ~initial_pose_x, _y, _a")
            else:
                return "anywhere in the map"
        pose, covariance = self._default if self._home is None else self._home
        localizer.set_pose(pose, covariance)
        return f"at {self._whose}, {_words(pose)}"

    def give(self, guess: PoseGuess, now_s: float) -> None:
        """A pose from outside; it replaces the one before it, and the one in the file."""
        self._pose_file_waits = False
        self._waiting = _Waiting(guess, now_s)

    def forget(self) -> None:
        """Drop what waits: it is out of date."""
        self._pose_file_waits = False
        self._waiting = None

    def begin_at(self, map_from_base: np.ndarray, covariance: np.ndarray) -> None:
        """Let begin() place the particles at the last pose of a localizer from now on."""
        self._home, self._whose = (map_from_base, covariance), "its last pose"

    def apply(
        self, localizer: PoseFilter, grid_map: GridMap, scan_ns: int, odom_from_base: np.ndarray, now_s: float
    ) -> bool:
        """Start over at the pose that waits, if one does and it is its time; whether it was done."""
        if self._pose_file_waits:
            self._pose_file_waits = False
            return self._resume(localizer, grid_map, scan_ns, odom_from_base)
        if self._waiting is None:
            return False
        guess = self._waiting.guess
        overdue = now_s - self._waiting.arrival_s > GUESS_WAIT_S
        if guess.stamp_ns > scan_ns and not overdue:
            return False  # a scan at or after its stamp is on its way
        self._waiting = None
        map_from_base = self._moved_on(guess, odom_from_base)
        try:
            initial_pose.refuse_outside(guess, grid_map)
            localizer.set_pose(map_from_base, guess.covariance)
        except ValueError as err:
            _log.warning(f"initialpose refused: {err}")
            return False
        self._home, self._whose = (guess.map_from_base, guess.covariance), "the last pose it was given"
        _log.info(f"starting at {_words(map_from_base)}")
        return True

    def _resume(self, localizer: PoseFilter, grid_map: GridMap, scan_ns: int, odom_from_base: np.ndarray) -> bool:
        """Start at the pose of the file, or search the whole map if it is not valid; whether one was done."""
        try:
            saved = saved_pose.load(self._file.path)
            pose, covariance, why = saved_pose.resumed(saved, scan_ns, grid_map.digest, odom_from_base, self._file)
            localizer.set_pose(pose, covariance)
        except FileNotFoundError:
            _log.info(f"no pose file {self._file.path} yet")
            return False
        except ValueError as err:
            _log.warning(f"the pose file {self._file.path} is not used: {err}; the robot may be anywhere in the map")
            self._home = None
            self.begin(localizer)
            return True
        self.begin_at(pose, covariance)
        _log.info(f"starting at {_words(pose)} of the pose file, {why}")
        return True

    def _moved_on(self, guess: PoseGuess, odom_from_base: np.ndarray) -> np.ndarray:
        """The pose moved forward by the odometry from its stamp to now."""
        if guess.stamp_ns == 0:
            return guess.map_from_base
        try:
            odom_from_then = self._odometry_at(guess.stamp_ns)
        except ValueError as err:
            _log.warning(
                f"initialpose of {guess.stamp_ns * 1e-9:.3f} s taken as of now: no odometry at its stamp ({err})"
            )
            return guess.map_from_base
        return se2.compose(guess.map_from_base, se2.compose(se2.inverse(odom_from_then), odom_from_base))


def _words(pose: np.ndarray) -> str:
    x, y, yaw = pose
    return f"x {x:.3f} m, y {y:.3f} m, yaw {yaw:.3f} rad"
