"""Where the filter starts: poses that somebody gave, moved on by odometry to the scan that they meet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Tuple

import numpy as np
import rospy
import tf2_ros

from glass_nav.geometry import se2
from glass_nav.localization import saved_pose
from glass_nav.localization.localizer import Localizer
from glass_nav.ros import conversions
from glass_nav.ros.conversions import PoseGuess
from glass_nav.ros.localization.params import LocalizationParams
from glass_nav.world.grid_map import GridMap

GUESS_WAIT_S = 1.0  # how long an initialpose waits for a scan at or after its stamp


@dataclass(frozen=True)
class _Waiting:
    """A pose somebody gave, and when it came."""

    guess: PoseGuess
    arrival_s: float


class InitialPoses:
    """The last start that was asked for, until there is a scan to make it with."""

    def __init__(self, p: LocalizationParams, tf: tf2_ros.Buffer) -> None:
        self._p, self._tf = p, tf
        self._waiting: Optional[_Waiting] = None
        self._pose_file_waits = bool(p.pose_file.pose_file)
        self._default = p.start.pose, p.start.covariance
        self._home: Optional[Tuple[np.ndarray, np.ndarray]] = None if p.node.start_without_guess else self._default
        self._whose = "the pose of its parameters"

    def begin(self, localizer: Localizer) -> str:
        """Place the particles of a new filter; where, in words that go on a sentence."""
        if self._home is None:
            try:
                localizer.scatter()
            except ValueError as err:
                rospy.logwarn(f"no search of the whole map: {err}; starting at ~initial_pose_x, _y, _a")
            else:
                return "anywhere in the map"
        pose, covariance = self._default if self._home is None else self._home
        localizer.set_pose(pose, covariance)
        return f"at {self._whose}, x {pose[0]:.3f} m, y {pose[1]:.3f} m, yaw {pose[2]:.3f} rad"

    def give(self, guess: PoseGuess, now_s: float) -> None:
        """Somebody says where the robot is; it replaces what was said before, and what is in the file."""
        self._pose_file_waits = False
        self._waiting = _Waiting(guess, now_s)

    def forget(self) -> None:
        """What waits is out of date."""
        self._pose_file_waits = False
        self._waiting = None

    def begin_at(self, map_from_base: np.ndarray, covariance: np.ndarray) -> None:
        """Where begin() places the particles from now on: the last pose of a filter."""
        self._home, self._whose = (map_from_base, covariance), "its last pose"

    def apply(
        self, localizer: Localizer, grid_map: GridMap, scan_ns: int, odom_from_base: np.ndarray, now_s: float
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
            refuse_outside(guess, grid_map)
            localizer.set_pose(map_from_base, guess.covariance)
        except ValueError as err:
            rospy.logwarn(f"initialpose refused: {err}")
            return False
        self._home, self._whose = (guess.map_from_base, guess.covariance), "the last pose it was given"
        x, y, yaw = map_from_base
        rospy.loginfo(f"starting at x {x:.3f} m, y {y:.3f} m, yaw {yaw:.3f} rad")
        return True

    def _resume(self, localizer: Localizer, grid_map: GridMap, scan_ns: int, odom_from_base: np.ndarray) -> bool:
        """Start where the pose file says, or search the whole map if it is not to be believed; whether one was done."""
        limits = self._p.pose_file
        try:
            saved = saved_pose.load(limits.path)
            pose, covariance, why = saved_pose.resumed(saved, scan_ns, grid_map.digest, odom_from_base, limits)
            localizer.set_pose(pose, covariance)
        except FileNotFoundError:
            rospy.loginfo(f"no pose file {limits.path} yet")
            return False
        except ValueError as err:
            rospy.logwarn(f"the pose file {limits.path} is not used: {err}; the robot may be anywhere in the map")
            self._home = None
            self.begin(localizer)
            return True
        self.begin_at(pose, covariance)
        x, y, yaw = pose
        rospy.loginfo(f"starting at x {x:.3f} m, y {y:.3f} m, yaw {yaw:.3f} rad of the pose file, {why}")
        return True

    def _moved_on(self, guess: PoseGuess, odom_from_base: np.ndarray) -> np.ndarray:
        """The pose moved forward by the odometry from its stamp to now."""
        if guess.stamp_ns == 0:
            return guess.map_from_base
        try:
            odom_from_then = conversions.planar_from_transform(
                self._tf.lookup_transform(
                    self._p.node.odom_frame_id, self._p.node.base_frame_id, conversions.stamp_from_ns(guess.stamp_ns)
                ).transform
            )
        except (tf2_ros.TransformException, ValueError) as err:
            rospy.logwarn(
                f"initialpose of {guess.stamp_ns * 1e-9:.3f} s taken as of now: no odometry at its stamp ({err})"
            )
            return guess.map_from_base
        return se2.compose(guess.map_from_base, se2.compose(se2.inverse(odom_from_then), odom_from_base))


def refuse_outside(guess: PoseGuess, grid_map: GridMap) -> None:
    """ValueError if the pose is not on the map."""
    if not grid_map.contains(*grid_map.cells(guess.map_from_base[:2])):
        x, y = guess.map_from_base[:2]
        raise ValueError(f"the pose x {x:.3f} m, y {y:.3f} m lies outside the map")
