"""The candidates of a global search for a display: ring, heading and probability of each."""

from __future__ import annotations

from typing import List, Union

import numpy as np

from glass_nav.shapes import Shape, ShapeKind, Text
from glass_nav.vocabulary import PLACE_RGB, LocalizationState

PLACES_NAMESPACE = "places"
MAX_PLACES = 10  # that are drawn, the most probable first

_APART_M = 2.0  # poses nearer than that are one place
_RING_M = 0.6  # radius: to be seen when all of a floor is
_LINE_M, _LETTER_M = 0.1, 0.6
_CORNERS = 24
_HEIGHT_M = 0.05


def place_shapes(state: str, particles: np.ndarray) -> List[Union[Shape, Text]]:
    """Rings with headings, and a text for each place; empty ones, which clear the display, unless it searches.

    Args:
        state: of the localization.
        particles: (P, 3) poses in the map; while it searches they are drawn from the candidates by weight.
    """
    searching = state == LocalizationState.GLOBAL_SEARCH
    poses, shares = places(particles) if searching else (np.zeros((0, 3)), np.zeros(0))
    lines = [_ring(pose) for pose in poses] or [np.zeros((0, 2))]
    ring = Shape(PLACES_NAMESPACE, 0, ShapeKind.LINES, np.concatenate(lines), _HEIGHT_M, _LINE_M, PLACE_RGB)
    texts = []
    for number in range(MAX_PLACES):
        known = number < len(poses)
        words = f"{100.0 * shares[number]:.0f} %" if known else ""
        at_m = np.append(poses[number, :2] + [0.0, -_RING_M - _LETTER_M], _HEIGHT_M) if known else np.zeros(3)
        texts.append(Text(PLACES_NAMESPACE, 1 + number, words, at_m, _LETTER_M, PLACE_RGB))
    return [ring, *texts]


def places(particles: np.ndarray) -> "tuple[np.ndarray, np.ndarray]":
    """Poses (K, 3) that stand for all particles (P, 3) within _APART_M of them, and their shares (K,), most first."""
    left = particles
    poses: List[np.ndarray] = []
    shares: List[float] = []
    while len(left) and len(poses) < MAX_PLACES:
        cells, number = np.unique(np.floor(left[:, :2] / _APART_M), axis=0, return_inverse=True)
        densest = left[number.ravel() == np.bincount(number.ravel(), minlength=len(cells)).argmax()]
        pose = densest[len(densest) // 2]
        near = np.hypot(*(left[:, :2] - pose[:2]).T) <= _APART_M
        poses.append(pose)
        shares.append(np.count_nonzero(near) / len(particles))
        left = left[~near]
    order = np.argsort(-np.array(shares), kind="stable")
    return np.array(poses).reshape(-1, 3)[order], np.array(shares)[order]


def _ring(pose: np.ndarray) -> np.ndarray:
    """Pairs of ends (2 n, 2): a circle, and a line from its middle to where the robot faces."""
    turn = np.linspace(0.0, 2.0 * np.pi, _CORNERS + 1)
    circle = pose[:2] + _RING_M * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    facing = np.array([np.cos(pose[2]), np.sin(pose[2])])
    heading = np.stack([pose[:2], pose[:2] + 1.6 * _RING_M * facing])
    return np.concatenate([np.repeat(circle, 2, axis=0)[1:-1], heading])
