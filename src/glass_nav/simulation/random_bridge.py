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
    length, width = rng.uniform(*LENGTH_M), rng.uniform(*WIDTH_M)
    placed = np.array([*rng.uniform(-5.0, 5.0, 2), rng.uniform(-math.pi, math.pi)])
    walls: List[np.ndarray] = []
    panes: List[np.ndarray] = []
    things: List[Tuple[np.ndarray, str, bool]] = []
    for end, side in ((0.0, -1.0), (length, 1.0)):
        deep, low, high = rng.uniform(*LOBBY_M), rng.uniform(2.0, 4.5), rng.uniform(2.0, 4.5)
        outer = end + side * deep
        below, above = -0.5 * width - low, 0.5 * width + high
        corners = [[end, -0.5 * width], [end, below], [outer, below], [outer, above], [end, above], [end, 0.5 * width]]
        walls.append(np.array(corners))
        for _ in range(int(rng.integers(3, 8))):
            across = rng.choice([rng.uniform(below + 0.8, -0.9), rng.uniform(0.9, above - 0.8)])
            along = end + side * rng.uniform(1.0, deep - 0.9)
            size = rng.uniform(0.4, 1.2), rng.uniform(0.4, 0.7)
            outline = box(float(along), float(across), *size, float(rng.uniform(0.0, math.pi)))
            things.append((outline, str(rng.choice(["wood", "metal", "cloth", "plant", "black"])), True))
    for across in (-0.5 * width, 0.5 * width):
        posts = max(2, int(round(length / rng.uniform(*POSTS_M))))
        at = np.linspace(0.0, length, posts + 1)
        for first, last in zip(at[:-1], at[1:]):
            inside = np.array([[first + 0.5 * POST_M, across], [last - 0.5 * POST_M, across]])
            (walls if rng.random() < PIECE_OF_WALL else panes).append(inside)
        things += [(box(float(each), float(across), POST_M, POST_M), "metal", True) for each in at[1:-1]]
    for _ in range(int(rng.integers(4, 16))):
        beside = rng.choice([-1.0, 1.0]) * (0.5 * width + rng.uniform(*OUTDOORS_M))
        kind, size = ("plant", (0.4, 0.4)) if rng.random() < 0.6 else ("metal", (4.2, 1.8))
        beside += np.sign(beside) * 0.5 * max(size)
        middle, yaw = float(rng.uniform(0.0, length)), float(rng.uniform(0.0, math.pi))
        things.append((box(middle, float(beside), *size, yaw), kind, False))
    for side in (-1.0, 1.0):
        if rng.random() < 0.6:
            away = side * (0.5 * width + rng.uniform(9.0, 18.0))
            facade = box(0.5 * length, float(away), 1.2 * length, 0.6, float(rng.uniform(-0.15, 0.15)))
            things.append((facade, "plaster", False))
    way = [
        [-2.5, 0.0],
        [1.0, 0.1 * width],
        [0.5 * length, -0.1 * width],
        [length - 1.0, 0.1 * width],
        [length + 2.5, 0.0],
    ]
    across_m = se2.transform_points(placed, np.array(way))
    return Building(
        tuple(Wall(se2.transform_points(placed, line), THICK_M) for line in walls),
        tuple(Pane(se2.transform_points(placed, line)) for line in panes),
        things=tuple(
            Thing(se2.transform_points(placed, outline), MATERIALS[kind], mapped=mapped)
            for outline, kind, mapped in things
        ),
        paths={"across": across_m},
        start=np.array([*across_m[0], placed[2]]),
        name=f"bridge_{seed}",
    )
