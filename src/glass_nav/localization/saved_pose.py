"""The file with the last pose of a robot, and the check whether it is still valid at the next start.

The pose is valid if the map is the same, it is not too old, and odometry either continues from it or started from
zero when the robot was switched on.
"""

from __future__ import annotations

import math
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, Tuple

import numpy as np
import yaml

from glass_nav.geometry import se2
from glass_nav.vocabulary import LocalizationState

_MIN_DEVIATION = np.array([0.1, 0.1, 0.05])  # [m, m, rad] of a start: the robot may have been touched
_DEVIATION_PER_M = np.array([0.1, 0.1, 0.05])  # of odometry while the node did not run
_AT_ORIGIN_M, _AT_ORIGIN_RAD = 0.3, 0.3  # odometry that began anew and has hardly moved
_SLACK_M = 0.1  # of odometry over any time
_CLOCK_SLACK_S = 1.0


class SavedPoseError(ValueError):
    """A pose file that cannot be used; the text says why."""


@dataclass(frozen=True)
class PoseFile:
    """The file for the pose, and how long it is valid."""

    pose_file: str = ""  # "": none
    pose_file_max_age_s: float = 604800.0  # [s] a week
    pose_file_max_speed_m_s: float = 2.0  # [m/s] odometry that went farther since is not that robot's

    def __post_init__(self) -> None:
        for name in ("pose_file_max_age_s", "pose_file_max_speed_m_s"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"~{name} must be > 0 and finite, got {getattr(self, name)}")
        if self.pose_file and not self.path.parent.is_dir():
            raise ValueError(f"~pose_file must lie in a folder that exists, got {self.pose_file!r}")

    @property
    def path(self) -> Path:
        """The file; ~ is the user's home."""
        return Path(os.path.expanduser(self.pose_file))


@dataclass(frozen=True)
class SavedPose:
    """A pose, and what decides whether it is still valid later."""

    stamp_ns: int  # of the scan that it was estimated from
    map_from_base: np.ndarray  # (3,)
    covariance: np.ndarray  # (3, 3) of x [m], y [m], yaw [rad]
    odom_from_base: np.ndarray  # (3,) of odometry then
    map_digest: str  # GridMap.digest
    state: str  # of the filter


def save(path: Path, saved: SavedPose) -> None:
    """Write the file, atomically: a robot that is switched off meanwhile still has the previous one.

    Raises:
        OSError: it cannot be written.
    """
    text = yaml.safe_dump(
        {
            "stamp_ns": int(saved.stamp_ns),
            "state": str(saved.state),
            "map": saved.map_digest,
            "map_from_base": _numbers(saved.map_from_base),
            "covariance": [_numbers(row) for row in saved.covariance],
            "odom_from_base": _numbers(saved.odom_from_base),
        },
        sort_keys=False,
    )
    handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with open(handle, "w", encoding="utf-8") as file:
            file.write("# The last pose of a robot, for its next start: x [m], y [m], yaw [rad].\n" + text)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError:
        os.unlink(temporary)
        raise


def load(path: Path) -> SavedPose:
    """Read the file that save() wrote.

    Raises:
        FileNotFoundError: there is no file.
        SavedPoseError: it cannot be read, or is no pose.
    """
    try:
        content: Any = yaml.safe_load(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as err:
        raise SavedPoseError(f"it cannot be read: {' '.join(str(err).split())}") from err
    if not isinstance(content, dict):
        raise SavedPoseError(f"it must hold names and values, got {type(content).__name__}")
    stamp_ns, state, digest = (
        _entry(content, name, kind) for name, kind in (("stamp_ns", int), ("state", str), ("map", str))
    )
    covariance = _array(content, "covariance", (3, 3))
    if np.abs(covariance - covariance.T).max() > 1e-9 or np.linalg.eigvalsh(covariance).min() < -1e-9:
        raise SavedPoseError(f"its covariance must be symmetric and not negative, got {covariance.tolist()}")
    return SavedPose(
        stamp_ns,
        _array(content, "map_from_base", (3,)),
        covariance,
        _array(content, "odom_from_base", (3,)),
        digest,
        state,
    )


def resumed(
    saved: SavedPose, now_ns: int, map_digest: str, odom_from_base: np.ndarray, limits: PoseFile
) -> Tuple[np.ndarray, np.ndarray, str]:
    """The present pose (3,), its covariance (3, 3), and in words why it is valid.

    Args:
        saved: what was written.
        now_ns: stamp of the first scan.
        map_digest: of the map that is in use.
        odom_from_base: (3,) odometry at that stamp.
        limits: how long and how far a pose holds.

    Raises:
        SavedPoseError: it is not valid.
    """
    age_s = (now_ns - saved.stamp_ns) * 1e-9
    if saved.state not in (LocalizationState.LOCALIZED, LocalizationState.UNCERTAIN):
        raise SavedPoseError(f"the robot was {saved.state} when it was written")
    if saved.map_digest != map_digest:
        raise SavedPoseError(f"it is of map {saved.map_digest}, the map in use is {map_digest}")
    if age_s < -_CLOCK_SLACK_S:
        raise SavedPoseError(f"it is of {-age_s:.0f} s after the first scan")
    if age_s > limits.pose_file_max_age_s:
        raise SavedPoseError(f"it is {age_s:.0f} s old, ~pose_file_max_age_s is {limits.pose_file_max_age_s:g} s")
    moved = se2.compose(se2.inverse(saved.odom_from_base), odom_from_base)
    way_m = se2.travelled(moved)[0]
    if _is_new(odom_from_base) and not _is_new(saved.odom_from_base):
        moved, why = odom_from_base, "odometry restarted; the robot is assumed not to have moved"
    elif way_m <= limits.pose_file_max_speed_m_s * max(age_s, 0.0) + _SLACK_M:
        why = f"odometry says that it moved by {way_m:.2f} m since"
    else:
        raise SavedPoseError(
            f"odometry is {way_m:.2f} m away from where it was {age_s:.1f} s before, more than "
            f"~pose_file_max_speed_m_s = {limits.pose_file_max_speed_m_s:g} m/s allows"
        )
    deviation = _MIN_DEVIATION + _DEVIATION_PER_M * se2.travelled(moved)[0]
    return (
        se2.compose(saved.map_from_base, moved),
        saved.covariance + np.diag(deviation**2),
        f"{age_s:.0f} s old; {why}",
    )


def _is_new(odom_from_base: np.ndarray) -> bool:
    way_m, turn_rad = se2.travelled(odom_from_base)
    return bool(way_m <= _AT_ORIGIN_M and turn_rad <= _AT_ORIGIN_RAD)


def _numbers(values: np.ndarray) -> "list[float]":
    return [float(value) for value in values]


def _entry(content: Dict[str, Any], name: str, kind: type) -> Any:
    value = content.get(name)
    if type(value) is not kind:
        raise SavedPoseError(f"its {name} must be {kind.__name__}, got {value!r}")
    return value


def _array(content: Dict[str, Any], name: str, shape: Tuple[int, ...]) -> np.ndarray:
    try:
        values = np.array(content.get(name), dtype=float)
    except (TypeError, ValueError):
        values = np.zeros(0)
    if values.shape != shape or not np.all(np.isfinite(values)):
        raise SavedPoseError(f"its {name} must be finite numbers {shape}, got {content.get(name)!r}")
    return values
