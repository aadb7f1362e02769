"""The pose from three bearings: the intersection of two inscribed-angle circles through the middle landmark.

Seed document landmark_bearings.txt (Tsukiyama 2009), sec. 2, eqs. 1-9: from a place P two landmarks A and B appear at
the angle alpha apart, so P is on one circle through A and B; B and C at the angle beta apart give another one. Both go
through B; P is their other intersection, the mirror image of B in the line through their centres.

Written without radii and centres, because these are infinite where P is in line with two landmarks. With B at the
origin and alpha the directed angle from PA to PB (modulo pi), the inscribed-angle theorem reads

    sin(alpha) PA.PB = cos(alpha) PA x PB,   that is   s1 |P|^2 + g1.P = 0,   s1 = sin(alpha),
    g1 = -s1 A + cos(alpha) J A,   J a quarter turn counter-clockwise,

the circle with its centre at -g1 / (2 s1), or a line where s1 = 0; and likewise for B, C and beta. Eliminating |P|^2
leaves a line through B, the radical axis of the two circles, on which P is. Directed angles make the solution hold for
any arrangement and any order of the landmarks. T triples.
"""

from __future__ import annotations

from typing import Tuple

import numpy as np

from glass_nav.geometry import angles

_ROUNDING = 1e-12  # squared length of the radical axis, of circles of size 1, below which the two are the same


def intersect(landmarks_m: np.ndarray, angles_rad: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Poses from which three landmarks appear in these directions.

    Args:
        landmarks_m: (T, 3, 2) in map, each three different points.
        angles_rad: (T, 3) directions in the frame of the sensor.

    Returns:
        map_from_sensor (T, 3), NaN where the two circles are one; and misfit_rad (T,), the largest
        difference between a direction from there and the measured one: 0, or pi where no place matches.
    """
    b = landmarks_m[:, 1]
    ax, ay = (landmarks_m[:, 0] - b).T
    cx, cy = (landmarks_m[:, 2] - b).T
    scale = np.maximum(ax * ax + ay * ay, cx * cx + cy * cy)
    alpha, beta = angles_rad[:, 1] - angles_rad[:, 0], angles_rad[:, 2] - angles_rad[:, 1]
    s1, c1, s2, c2 = np.sin(alpha), np.cos(alpha), np.sin(beta), np.cos(beta)
    g1x, g1y = -s1 * ax - c1 * ay, -s1 * ay + c1 * ax
    g2x, g2y = -s2 * cx + c2 * cy, -s2 * cy - c2 * cx
    dx, dy = -(s2 * g1y - s1 * g2y), s2 * g1x - s1 * g2x  # along the radical axis
    length2 = dx * dx + dy * dy
    with np.errstate(divide="ignore", invalid="ignore"):
        along = -(s1 * (g1x * dx + g1y * dy) + s2 * (g2x * dx + g2y * dy)) / ((s1 * s1 + s2 * s2) * length2)
        along = np.where(length2 > _ROUNDING * scale, along, np.nan)
    x, y = b[:, 0] + along * dx, b[:, 1] + along * dy
    heading = np.arctan2(landmarks_m[..., 1] - y[:, None], landmarks_m[..., 0] - x[:, None]) - angles_rad
    apart = angles.wrap(heading - heading[:, :1])
    yaw = angles.wrap(heading[:, 0] + apart.mean(axis=1))
    return np.stack([x, y, yaw], axis=-1), np.abs(apart).max(axis=1)


def off_circle(landmarks_m: np.ndarray, angles_rad: np.ndarray, sigma_rad: np.ndarray) -> np.ndarray:
    """How clearly the bearings distinguish the robot from one on the circle (or line) through the three landmarks.

    On that circle, and nowhere else, the angle at which the robot sees two of them equals the inscribed angle at the
    third (modulo pi), and the two circles of intersect() are one. The difference is counted in its standard deviations.

    Args:
        landmarks_m: (T, 3, 2).
        angles_rad: (T, 3).
        sigma_rad: (T, 3) standard deviation of each.

    Returns:
        (T,) the least of the three pairs; below about 3 the position is arbitrary.
    """
    one, other = np.roll(landmarks_m, -1, axis=1) - landmarks_m, np.roll(landmarks_m, -2, axis=1) - landmarks_m
    inscribed = np.arctan2(other[..., 1], other[..., 0]) - np.arctan2(one[..., 1], one[..., 0])  # (T, 3) at each
    seen = np.roll(angles_rad, -2, axis=1) - np.roll(angles_rad, -1, axis=1)
    excess = np.mod(seen - inscribed + 0.5 * np.pi, np.pi) - 0.5 * np.pi
    sigma = np.hypot(np.roll(sigma_rad, -2, axis=1), np.roll(sigma_rad, -1, axis=1))
    return (np.abs(excess) / sigma).min(axis=1)


def circle(landmarks_m: np.ndarray) -> Tuple[np.ndarray, float]:
    """Centre (2,) and radius [m] of the circle through three points (3, 2); radius inf if they are in a line."""
    b, c = landmarks_m[1] - landmarks_m[0], landmarks_m[2] - landmarks_m[0]
    twice = 2.0 * (b[0] * c[1] - b[1] * c[0])
    if abs(twice) < 1e-9 * float(np.hypot(*b) * np.hypot(*c)):
        return np.full(2, np.nan), float("inf")
    square_b, square_c = float(b @ b), float(c @ c)
    centre = np.array([c[1] * square_b - b[1] * square_c, b[0] * square_c - c[0] * square_b]) / twice
    return landmarks_m[0] + centre, float(np.hypot(*centre))
