"""What a display draws, free of ROS: a node sends it as markers, a replay writes the same markers into a bag."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Dict

import numpy as np

from glass_nav.vocabulary import Rgb


class ShapeKind(Enum):
    """How the points of a shape are drawn."""

    SQUARES = "squares"  # one on each point
    LINES = "lines"  # between pairs of points


@dataclass(frozen=True)
class Shape:
    """Squares or lines of one colour; without points, what was drawn before under its name goes away."""

    namespace: str  # a checkbox in rviz
    number: int  # within the namespace
    kind: ShapeKind
    points_m: np.ndarray  # (K, 2)
    height_m: float
    width_m: float  # of the lines, or the side of the squares
    rgb: Rgb
    alpha: float = 1.0


@dataclass(frozen=True)
class Text:
    """Words that face the viewer."""

    namespace: str
    number: int
    text: str
    at_m: np.ndarray  # (3,) its middle
    letter_m: float  # height of a capital letter
    rgb: Rgb


FIGURES: Dict[str, np.ndarray] = {  # pairs of ends (2 n, 2) around 0, in units of half their size; matplotlib's names
    "s": np.zeros((0, 2)),  # the square of the point itself
    "^": np.array([[-1, -0.8], [1, -0.8], [1, -0.8], [0, 1], [0, 1], [-1, -0.8]], float),
    "+": np.array([[-1, 0], [1, 0], [0, -1], [0, 1]], float),
    "D": np.array([[-1, 0], [0, 1], [0, 1], [1, 0], [1, 0], [0, -1], [0, -1], [-1, 0]], float),
    "x": np.array([[-0.8, -0.8], [0.8, 0.8], [-0.8, 0.8], [0.8, -0.8]], float),
}


def figures_at(mark: str, points_m: np.ndarray, size_m: float) -> np.ndarray:
    """A figure of FIGURES on each point (K, 2): pairs of ends (K 2 n, 2) [m]."""
    return (points_m[:, None] + 0.5 * size_m * FIGURES[mark]).reshape(-1, 2)
