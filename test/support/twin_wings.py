"""Seed -> a floor with parts that look alike: wings around a hall, a half-turn symmetry, the floors of a tower.

A wing is a corridor with rooms along both sides. All copies have the same walls and furniture, except where the kind says
so: one room of one wing is furnished otherwise; one cupboard breaks the symmetry; each floor of a tower has one room
of its own. The same seed gives the same floor. The wake-up benchmark and the screenshots of rviz build on it.
"""

from __future__ import annotations

import math
from typing import List, Tuple

import numpy as np

from glass_nav.geometry import se2
from glass_nav.simulation.building import MATERIALS, Building, Thing, Wall, box

TWIN_WINGS, FOUR_WINGS, HALF_TURN, TOWER = "twin_wings", "four_wings", "half_turn", "tower"
KINDS = (TWIN_WINGS, FOUR_WINGS, HALF_TURN, TOWER)
THICK_M, DOOR_M = 0.15, 1.1
CORRIDOR_M, ROOM_M, DEPTH_M = (1.8, 2.4), (3.4, 5.2), (3.6, 5.0)
HALL_M = 11.0  # edge of the hall: rooms of neighbouring wings do not meet
FLOORS, APART_M = 3, 40.0


def build(kind: str, seed: int) -> Building:
    """The floor of a kind and a seed; the robot's own start is in a copy that the seed chooses."""
    rng = np.random.default_rng([seed, KINDS.index(kind), 0x7313])
    wing = _Wing(rng, 2 if kind == FOUR_WINGS else 3)
    copies = {TWIN_WINGS: 2, FOUR_WINGS: 4, HALF_TURN: 2, TOWER: FLOORS}[kind]
    walls: List[np.ndarray] = []
    things: List[np.ndarray] = []
    other = int(rng.integers(len(wing.rooms)))
    for k in range(copies):
        if kind == TOWER:
            placed = np.array([0.0, APART_M * k, 0.0])
            walls.append(se2.transform_points(placed, wing.closed_m))
        else:
            yaw = 2.0 * math.pi * k / copies
            placed = se2.compose(np.array([0.0, 0.0, yaw]), np.array([0.5 * HALL_M, 0.0, 0.0]))
        walls += [se2.transform_points(placed, line) for line in wing.walls]
        own = k if kind == TOWER else other if kind in (TWIN_WINGS, FOUR_WINGS) and k == copies - 1 else -1
        for room, outlines in enumerate(wing.furniture):
            outlines = wing.furnished(room) if room == own % len(wing.rooms) and own >= 0 else outlines
            things += [se2.transform_points(placed, outline) for outline in outlines]
        if kind == HALF_TURN and k == 1:
            things.append(se2.transform_points(placed, box(wing.length_m - 0.4, 0.0, 0.6, 1.0)))
    if kind != TOWER:
        walls += _hall(wing.corridor_m, copies)
    turned = np.array([*rng.uniform(-5.0, 5.0, 2), rng.uniform(-math.pi, math.pi)])
    start = np.array([1.0, APART_M * (seed % FLOORS) if kind == TOWER else 0.0, 0.0])
    seen = np.array([[1.0, APART_M * k] for k in range(FLOORS)] if kind == TOWER else [[0.0, 0.0]])
    return Building(
        tuple(Wall(se2.transform_points(turned, line), THICK_M) for line in walls),
        things=tuple(Thing(se2.transform_points(turned, outline), MATERIALS["wood"]) for outline in things),
        start=se2.compose(turned, start),
        seen_m=se2.transform_points(turned, seen),
        name=f"{kind}_{seed}",
    )


def as_file(building: Building) -> str:
    """The building.yaml of such a floor, for what reads files only."""

    def listed(points_m: np.ndarray) -> str:
        return str(np.round(points_m, 6).tolist())

    return "\n".join(
        [
            "walls:",
            *(f"  - {{line: {listed(wall.line_m)}, thickness: {THICK_M}}}" for wall in building.walls),
            "furniture:",
            *(
                f"  - {{outline: {listed(thing.outline_m)}, reflectance: {thing.reflectance}}}"
                for thing in building.things
            ),
            f"start: {listed(building.start)}",
            f"seen: {listed(building.seen_m)}\n",
        ]
    )


class _Wing:
    """Along x, its corridor from (0, 0) on."""

    def __init__(self, rng: np.random.Generator, rooms: int) -> None:
        self._rng = rng
        self.corridor_m = float(rng.uniform(*CORRIDOR_M))
        half = 0.5 * self.corridor_m
        widths = rng.uniform(*ROOM_M, (2, rooms))
        widths[1] *= widths[0].sum() / widths[1].sum()
        self.length_m = float(widths[0].sum())
        self.walls: List[np.ndarray] = [np.array([[self.length_m, -half], [self.length_m, half]])]
        self.closed_m = np.array([[0.0, -half], [0.0, half]])
        self.rooms: List[Tuple[float, float, float, float]] = []  # x and y of two corners
        for side, row in ((1.0, widths[0]), (-1.0, widths[1])):
            depth, x = float(rng.uniform(*DEPTH_M)), 0.0
            near, far = side * half, side * (half + depth)
            for width in row.tolist():
                door = x + float(rng.uniform(0.4, width - 0.4 - DOOR_M))
                self.walls += [
                    np.array([[x, near], [door, near]]),
                    np.array([[door + DOOR_M, near], [x + width, near], [x + width, far], [x, far], [x, near]]),
                ]
                self.rooms.append((x, near, x + width, far))
                x += width
        self.furniture = [self.furnished(room) for room in range(len(self.rooms))]

    def furnished(self, room: int) -> List[np.ndarray]:
        """Outlines of things along the walls of a room, none near its door."""
        x1, near, x2, far = self.rooms[room]
        side, things = math.copysign(1.0, far), []
        for _ in range(int(self._rng.integers(2, 5))):
            size = self._rng.uniform(0.5, 1.4), self._rng.uniform(0.4, 0.8)
            middle = self._rng.uniform(x1 + 0.9, x2 - 0.9)
            away = far - side * self._rng.uniform(0.5, 1.8)
            things.append(box(float(middle), float(away), *map(float, size), float(self._rng.uniform(0.0, math.pi))))
        return things


def _hall(corridor_m: float, copies: int) -> List[np.ndarray]:
    """Its four walls, open where a wing begins."""
    half, gap = 0.5 * HALL_M, 0.5 * corridor_m
    walls = []
    for k in range(4):
        turned = np.array([0.0, 0.0, 0.5 * math.pi * k])
        is_open = copies == 4 or k % 2 == 0
        lines = (
            [[[half, -half], [half, -gap]], [[half, gap], [half, half]]] if is_open else [[[half, -half], [half, half]]]
        )
        walls += [se2.transform_points(turned, np.array(line)) for line in lines]
    return walls
