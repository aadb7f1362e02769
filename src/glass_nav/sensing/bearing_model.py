"""The bearings expected at a pose, and their derivatives. N bearings; poses (..., 3).

The bearing to a landmark at L, taken by a sensor at the place o and turned by psi on the robot (both change from
bearing to bearing while the robot drives and the sensor turns), is

    h = atan2(d) - yaw - psi,   d = L - (x, y) - R(yaw) o.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glass_nav.geometry import angles
from glass_nav.sensing.bearings import LandmarkBearings
from glass_nav.world.landmark_map import LandmarkMap


@dataclass(frozen=True, eq=False)
class Sightings:
    """Bearings and the landmarks they belong to."""

    number: np.ndarray  # (N,) of the landmark on its map
    landmarks_m: np.ndarray  # (N, 2) in map
    direction_rad: np.ndarray  # (N,) of the bearing in the frame base: angle + psi
    origin_m: np.ndarray  # (N, 2) place of the sensor in the frame base
    variance: np.ndarray  # (N,) of the angle [rad^2]
    place_m2: np.ndarray  # (N,) variance across the line of sight, of landmark and sensor [m^2]

    def subset(self, chosen: np.ndarray) -> "Sightings":
        """The bearings of a mask (N,) or of indices."""
        return Sightings(
            self.number[chosen],
            self.landmarks_m[chosen],
            self.direction_rad[chosen],
            self.origin_m[chosen],
            self.variance[chosen],
            self.place_m2[chosen],
        )


def sightings(bearings: LandmarkBearings, landmarks: LandmarkMap) -> Sightings:
    """Bearings with their landmarks.

    Raises:
        UnknownLandmark: the map does not have one of them.
    """
    number = landmarks.numbers(bearings.ids)
    return Sightings(
        number,
        landmarks.positions_m[number],
        bearings.angles_rad + bearings.base_from_sensor[:, 2],
        bearings.base_from_sensor[:, :2],
        bearings.sigma_rad**2,
        bearings.origin_sigma_m**2 + landmarks.sigma_m**2,
    )


def lines_of_sight(seen: Sightings, poses: np.ndarray) -> np.ndarray:
    """(..., N, 2) from the sensor to the landmarks, in map."""
    cos, sin = angles.cos_sin(poses[..., 2])
    cos, sin = cos[..., None], sin[..., None]
    ox, oy = seen.origin_m[:, 0], seen.origin_m[:, 1]
    return np.stack(
        [
            seen.landmarks_m[:, 0] - poses[..., 0, None] - cos * ox + sin * oy,
            seen.landmarks_m[:, 1] - poses[..., 1, None] - sin * ox - cos * oy,
        ],
        axis=-1,
    )


def residuals(seen: Sightings, poses: np.ndarray, sight_m: np.ndarray) -> np.ndarray:
    """(..., N) measured minus expected [rad], in [-pi, pi), for the lines_of_sight() of the poses."""
    return angles.wrap(seen.direction_rad + poses[..., 2, None] - np.arctan2(sight_m[..., 1], sight_m[..., 0]))


def variances(seen: Sightings, sight_m: np.ndarray) -> np.ndarray:
    """(..., N) of the residuals [rad^2]: of the angle, and of where landmark and sensor are."""
    return seen.variance + seen.place_m2 / np.maximum((sight_m * sight_m).sum(axis=-1), 1e-6)


def jacobian(seen: Sightings, pose: np.ndarray, sight_m: np.ndarray) -> np.ndarray:
    """(N, 3) of the expected bearings with regard to x, y, yaw of one pose (3,)."""
    range2 = np.maximum((sight_m * sight_m).sum(axis=-1), 1e-12)
    by_x, by_y = sight_m[:, 1] / range2, -sight_m[:, 0] / range2
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    turned_x = -sin * seen.origin_m[:, 0] - cos * seen.origin_m[:, 1]  # of R(yaw) o, by yaw
    turned_y = cos * seen.origin_m[:, 0] - sin * seen.origin_m[:, 1]
    return np.stack([by_x, by_y, by_x * turned_x + by_y * turned_y - 1.0], axis=-1)
