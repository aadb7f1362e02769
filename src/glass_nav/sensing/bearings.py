"""Directions in which landmarks were seen, N of them, and where on the path each was measured."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Optional, Sequence, Tuple

import numpy as np

from glass_nav.geometry import angles, se2


@dataclass(frozen=True)
class LandmarkBearing:
    """A landmark, seen in one direction."""

    stamp_ns: int
    landmark_id: str
    angle_rad: float  # counter-clockwise from the sensor's x axis
    sigma_rad: float  # standard deviation of the angle

    def __post_init__(self) -> None:
        if not self.landmark_id:
            raise ValueError("a bearing needs the id of its landmark, got ''")
        if not np.isfinite(self.angle_rad):
            raise ValueError(f"bearing of {self.landmark_id!r}: angle must be finite, got {self.angle_rad} rad")
        if not (np.isfinite(self.sigma_rad) and self.sigma_rad > 0.0):
            raise ValueError(f"bearing of {self.landmark_id!r}: sigma must be > 0 rad, got {self.sigma_rad}")


@dataclass(frozen=True, eq=False)
class LandmarkBearings:
    """Bearings to different landmarks, all relative to one pose of the robot: base at stamp_ns.

    A sensor that turns for a minute takes each bearing from another place. `base_from_sensor` holds these places as
    odometry has them, so their user need not know whether the robot moved.
    """

    stamp_ns: int
    ids: Tuple[str, ...]
    angles_rad: np.ndarray  # (N,) counter-clockwise from the x axis of the sensor
    sigma_rad: np.ndarray  # (N,)
    base_from_sensor: np.ndarray  # (N, 3) where the sensor was, seen from base at stamp_ns
    origin_sigma_m: np.ndarray  # (N,) how unsure that place is, for want of better odometry; 0: the robot stood still

    def __post_init__(self) -> None:
        count = len(self.ids)
        shapes = [
            np.shape(value) for value in (self.angles_rad, self.sigma_rad, self.base_from_sensor, self.origin_sigma_m)
        ]
        if shapes != [(count,), (count,), (count, 3), (count,)]:
            raise ValueError(
                f"expected {count} ids with angles (N,), sigma (N,), sensor poses (N, 3) and origin sigma "
                f"(N,), got {', '.join(map(str, shapes))}"
            )
        if len(set(self.ids)) < count:
            twice = sorted({name for name in self.ids if self.ids.count(name) > 1})
            raise ValueError(f"bearings must be of different landmarks, got {', '.join(twice)} more than once")
        if not (np.isfinite(self.angles_rad).all() and np.isfinite(self.base_from_sensor).all()):
            raise ValueError("bearings and the poses they were taken from must be finite")
        if not (np.isfinite(self.sigma_rad).all() and (self.sigma_rad > 0.0).all()):
            raise ValueError(f"sigma of bearings must be > 0 rad, got {self.sigma_rad.tolist()}")
        if not (np.isfinite(self.origin_sigma_m).all() and (self.origin_sigma_m >= 0.0).all()):
            raise ValueError(f"origin sigma of bearings must be >= 0 m, got {self.origin_sigma_m.tolist()}")

    def __len__(self) -> int:
        return len(self.ids)

    def subset(self, chosen: np.ndarray) -> "LandmarkBearings":
        """The bearings of a mask (N,) bool or of indices (M,)."""
        numbers = np.arange(len(self.ids))[chosen]
        return LandmarkBearings(
            self.stamp_ns,
            tuple(self.ids[number] for number in numbers),
            self.angles_rad[numbers],
            self.sigma_rad[numbers],
            self.base_from_sensor[numbers],
            self.origin_sigma_m[numbers],
        )

    def seen_from(self, stamp_ns: int, later_from_base: np.ndarray) -> "LandmarkBearings":
        """The same bearings relative to the robot's pose at another time, by odometry between the two (3,)."""
        return replace(self, stamp_ns=stamp_ns, base_from_sensor=se2.compose(later_from_base, self.base_from_sensor))


def standing(
    ids: Sequence[str],
    angles_rad: np.ndarray,
    sigma_rad: float,
    stamp_ns: int = 0,
    base_from_sensor: Optional[np.ndarray] = None,
) -> LandmarkBearings:
    """Bearings (N,) that a robot took while it stood still; without base_from_sensor (3,) the sensor is at base."""
    count = len(ids)
    place = np.zeros(3) if base_from_sensor is None else np.asarray(base_from_sensor, float)
    return LandmarkBearings(
        stamp_ns,
        tuple(ids),
        np.array(angles_rad, float),
        np.full(count, float(sigma_rad)),
        np.tile(place, (count, 1)),
        np.zeros(count),
    )


@dataclass(frozen=True)
class OdometryDrift:
    """How uncertain odometry is between two bearings."""

    bearing_drift_per_m: float = 0.02  # [m/m] of the distance, in position
    bearing_drift_rad_per_m: float = 0.01  # [rad/m] of the distance, in heading
    bearing_drift_per_rad: float = 0.02  # [rad/rad] of the turn, in heading

    def __post_init__(self) -> None:
        for name in ("bearing_drift_per_m", "bearing_drift_rad_per_m", "bearing_drift_per_rad"):
            if not 0.0 <= getattr(self, name) < np.inf:
                raise ValueError(f"~{name} must be >= 0, got {getattr(self, name)}")


def collected(
    bearings: Sequence[LandmarkBearing],
    odom_from_base: np.ndarray,
    base_from_sensor: np.ndarray,
    drift: OdometryDrift = OdometryDrift(),
) -> LandmarkBearings:
    """Bearings taken one after the other -> the same with regard to where the robot was at the last one.

    Args:
        bearings: N >= 1, of different landmarks, by ascending stamp.
        odom_from_base: (N, 3) odometry at the stamp of each.
        base_from_sensor: (3,) where the sensor sits, its x axis where angles are 0.
        drift: makes sigma of older bearings larger, by the distance and the turns between them and the last one.
    """
    odom_from_base = np.asarray(odom_from_base, float)
    last = odom_from_base[-1]
    step = odom_from_base[1:] - odom_from_base[:-1]
    since = np.zeros((len(bearings), 2))  # distance [m] and turn [rad] from each stamp to the last one
    since[:-1] = np.cumsum(
        np.stack([np.hypot(step[:, 0], step[:, 1]), np.abs(angles.wrap(step[:, 2]))], axis=-1)[::-1], axis=0
    )[::-1]
    heading = drift.bearing_drift_rad_per_m * since[:, 0] + drift.bearing_drift_per_rad * since[:, 1]
    sigma = np.array([bearing.sigma_rad for bearing in bearings])
    return LandmarkBearings(
        bearings[-1].stamp_ns,
        tuple(bearing.landmark_id for bearing in bearings),
        np.array([bearing.angle_rad for bearing in bearings]),
        np.hypot(sigma, heading),
        se2.compose(se2.compose(se2.inverse(last), odom_from_base), base_from_sensor),
        drift.bearing_drift_per_m * since[:, 0],
    )
