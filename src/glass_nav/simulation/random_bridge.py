"""A random bridge of glass between two lobbies, with open surroundings that no map shows.

The bridge has panes on both sides, whole or between posts, and on some floors pieces of wall. Outdoors stand trees,
vehicles and facades of other buildings: most beams of a robot on the bridge end there. The same seed gives the same
bridge.
"""

from __future__ import annotations

import math
from typing import List, Tuple

import numpy as np

from glass_nav.geometry import se2
from glass_nav.simulation.building import MATERIALS, Building, Pane, Thing, Wall, box

LENGTH_M, WIDTH_M = (12.0, 32.0), (2.0, 3.6)  # of the bridge
LOBBY_M = (6.0, 10.0)  # edges of a lobby
POSTS_M = (1.8, 4.0)  # between the posts of a row
PIECE_OF_WALL = 0.1  # share of the fields between posts
THICK_M, POST_M = 0.25, 0.08
OUTDOORS_M = (2.0, 14.0)  # from the bridge to the things beside it


def build(seed: int) -> Building:
    """The bridge of a seed, with a path "across".

    Args:
        seed: >= 0.
    """
    rng = np.random.default_rng([seed, 0xB41D])
    bridge = _Bridge(rng)
    placed = np.array([*rng.uniform(-5.0, 5.0, 2), rng.uniform(-math.pi, math.pi)])
    bridge.add_lobbies()
    bridge.add_sides()
    bridge.add_surroundings()
    return bridge.built(placed, f"bridge_{seed}")


class _Bridge:
    """Walls, panes and things around a bridge along x from 0 to its length, centred on y = 0; built() places it."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._length, self._width = rng.uniform(*LENGTH_M), rng.uniform(*WIDTH_M)
        self._walls: List[np.ndarray] = []
        self._panes: List[np.ndarray] = []
        self._things: List[Tuple[np.ndarray, str, bool]] = []  # outline, material, mapped

    def add_lobbies(self) -> None:
        """One at each end, with furniture."""
        rng, half_width = self._rng, 0.5 * self._width
        for end, side in ((0.0, -1.0), (self._length, 1.0)):
            deep, low, high = rng.uniform(*LOBBY_M), rng.uniform(2.0, 4.5), rng.uniform(2.0, 4.5)
            outer = end + side * deep
            below, above = -half_width - low, half_width + high
            corners = [
                [end, -half_width],
                [end, below],
                [outer, below],
                [outer, above],
                [end, above],
                [end, half_width],
            ]
            self._walls.append(np.array(corners))
            for _ in range(int(rng.integers(3, 8))):
                across = rng.choice([rng.uniform(below + 0.8, -0.9), rng.uniform(0.9, above - 0.8)])
                along = end + side * rng.uniform(1.0, deep - 0.9)
                size = rng.uniform(0.4, 1.2), rng.uniform(0.4, 0.7)
                outline = box(float(along), float(across), *size, float(rng.uniform(0.0, math.pi)))
                self._things.append((outline, str(rng.choice(["wood", "metal", "cloth", "plant", "black"])), True))

    def add_sides(self) -> None:
        """A row of panes between posts on either side; here and there a piece of wall instead."""
        for across in (-0.5 * self._width, 0.5 * self._width):
            posts = max(2, int(round(self._length / self._rng.uniform(*POSTS_M))))
            at = np.linspace(0.0, self._length, posts + 1)
            for first, last in zip(at[:-1], at[1:]):
                inside = np.array([[first + 0.5 * POST_M, across], [last - 0.5 * POST_M, across]])
                (self._walls if self._rng.random() < PIECE_OF_WALL else self._panes).append(inside)
            self._things += [(box(float(each), float(across), POST_M, POST_M), "metal", True) for each in at[1:-1]]

    def add_surroundings(self) -> None:
        """Trees, vehicles and facades beside the bridge, none of which is in the map."""
        rng, half_width = self._rng, 0.5 * self._width
        for _ in range(int(rng.integers(4, 16))):
            beside = rng.choice([-1.0, 1.0]) * (half_width + rng.uniform(*OUTDOORS_M))
            kind, size = ("plant", (0.4, 0.4)) if rng.random() < 0.6 else ("metal", (4.2, 1.8))
            beside += np.sign(beside) * 0.5 * max(size)
            middle, yaw = float(rng.uniform(0.0, self._length)), float(rng.uniform(0.0, math.pi))
            self._things.append((box(middle, float(beside), *size, yaw), kind, False))
        for side in (-1.0, 1.0):
            if rng.random() < 0.6:
                away = side * (half_width + rng.uniform(9.0, 18.0))
                outline = box(0.5 * self._length, float(away), 1.2 * self._length, 0.6, float(rng.uniform(-0.15, 0.15)))
                self._things.append((outline, "plaster", False))

    def built(self, placed: np.ndarray, name: str) -> Building:
        """The building at a pose (3,), with a path from lobby to lobby."""
        length, sway = self._length, 0.1 * self._width
        way = [[-2.5, 0.0], [1.0, sway], [0.5 * length, -sway], [length - 1.0, sway], [length + 2.5, 0.0]]
        across_m = se2.transform_points(placed, np.array(way))
        return Building(
            tuple(Wall(se2.transform_points(placed, line), THICK_M) for line in self._walls),
            tuple(Pane(se2.transform_points(placed, line)) for line in self._panes),
            things=tuple(
                Thing(se2.transform_points(placed, outline), MATERIALS[kind], mapped=mapped)
                for outline, kind, mapped in self._things
            ),
            paths={"across": across_m},
            start=np.array([*across_m[0], placed[2]]),
            name=name,
        )
