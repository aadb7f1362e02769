"""A random floor: rooms along corridors that form loops, doors, furniture, some glass walls.

Corridors of several widths cross and cut the floor into blocks; some pieces are walled off, which leaves rings and dead
ends. A block is one or two rows of rooms with a door each, an open hall with columns, or unseen by the mapper. Then the
whole floor is skewed and turned: no two rooms are alike, and few angles are right. The same seed gives the same floor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Callable, List, Sequence, Tuple

import numpy as np

from glass_nav.geometry import se2
from glass_nav.simulation.building import MATERIALS, Building, Door, Pane, Thing, Wall, box

CORRIDOR_M = (1.4, 3.0)  # width
BLOCK_M = (4.5, 11.0)  # edge of a block between corridors
ROOM_M = (2.8, 6.5)  # width of a room along its corridor
TWO_ROWS_M = 8.0  # deeper blocks have rooms on both sides
DOOR_M = (0.85, 1.2)  # width
THIN_M, THICK_M = 0.12, 0.25  # walls within and around the floor
BEND = 0.06  # largest skew and bend of the walls
DOOR_ROOM_M = 1.1  # kept free behind a door
_CLOSED = 0.15  # share of the doors
_WALLED_OFF = 0.15  # share of the pieces of corridor
_HALL, _UNSEEN = 0.2, 0.1  # share of the blocks


@dataclass(frozen=True)
class FloorParams:
    """Size of the floor and its share of glass."""

    blocks: Tuple[int, int] = (3, 3)  # across and along, with corridors between them
    glass: float = 0.4  # share of the rooms with a glass wall to the corridor

    def __post_init__(self) -> None:
        if min(self.blocks) < 2:
            raise ValueError(f"a random floor needs at least 2 x 2 blocks, got {self.blocks[0]} x {self.blocks[1]}")
        if not 0.0 <= self.glass <= 1.0:
            raise ValueError(f"the share of glass must be 0 to 1, got {self.glass}")


def build(seed: int, p: FloorParams = FloorParams()) -> Building:
    """The floor of a seed.

    Args:
        seed: >= 0.
        p: its size and share of glass.
    """
    return _Floor(np.random.default_rng([seed, 0xF1002]), p).built(f"random_{seed}")


Line = Callable[[Tuple[float, float], Tuple[float, float]], np.ndarray]


class _Floor:
    """Walls, doors and furniture of a rectangular plan [m]; built() skews it."""

    def __init__(self, rng: np.random.Generator, p: FloorParams) -> None:
        self._rng, self._p = rng, p
        self._walls: List[Tuple[np.ndarray, float]] = []
        self._panes: List[np.ndarray] = []
        self._doors: List[np.ndarray] = []
        self._things: List[Tuple[np.ndarray, str]] = []
        self._x, self._y = (self._cuts(count) for count in p.blocks)
        self._outside()
        self._corridors()
        for column in range(p.blocks[0]):
            for row in range(p.blocks[1]):
                self._block(column, row)

    def _cuts(self, blocks: int) -> np.ndarray:
        """(2 * blocks,) where blocks begin and end along one axis."""
        edges = self._rng.uniform(*BLOCK_M, blocks)
        widths = self._rng.uniform(*CORRIDOR_M, blocks - 1)
        steps = np.empty(2 * blocks - 1)
        steps[0::2], steps[1::2] = edges, widths
        return np.concatenate([[0.0], np.cumsum(steps)])

    def _outside(self) -> None:
        (left, right), (low, high) = self._x[[0, -1]], self._y[[0, -1]]
        corners = np.array([[left, low], [right, low], [right, high], [left, high], [left, low]])
        self._walls += [(corners[side : side + 2], THICK_M) for side in range(4)]

    def _corridors(self) -> None:
        """Wall off some pieces at one end: outer ones and, between crossings, those of one axis only. One corridor of
        that axis stays whole, so that all crossings remain connected.
        """
        cut = bool(self._rng.integers(2))
        for across, along, turned in ((self._x, self._y, False), (self._y, self._x, True)):
            corridors, pieces = len(across) // 2 - 1, len(along) // 2
            whole = int(self._rng.integers(corridors))
            for corridor in range(corridors):
                for piece in range(pieces):
                    inner = 0 < piece < pieces - 1
                    if self._rng.random() >= _WALLED_OFF or inner and (turned != cut or corridor == whole):
                        continue
                    at = along[2 * piece] if piece == pieces - 1 else along[2 * piece + 1]
                    wall = np.column_stack([across[2 * corridor + 1 : 2 * corridor + 3], [at, at]])
                    self._walls.append((wall[:, ::-1] if turned else wall, THIN_M))

    def _block(self, column: int, row: int) -> None:
        x0, x1 = self._x[[2 * column, 2 * column + 1]]
        y0, y1 = self._y[[2 * row, 2 * row + 1]]
        sides = {
            "left": column > 0,
            "right": column < self._p.blocks[0] - 1,
            "low": row > 0,
            "high": row < self._p.blocks[1] - 1,
        }  # along which a corridor runs
        kind = self._rng.random()
        if kind < _HALL:
            self._hall(x0, x1, y0, y1)
            return
        doors = kind >= _HALL + _UNSEEN
        across, along = (sides["left"], sides["right"]), (sides["low"], sides["high"])
        if any(along) and (x1 - x0 >= y1 - y0 or not any(across)):
            self._rooms((x0, x1), (y0, y1), along, across, doors, False)
        else:
            self._rooms((y0, y1), (x0, x1), across, along, doors, True)

    def _hall(self, x0: float, x1: float, y0: float, y1: float) -> None:
        """Put columns into a hall, which is open to the corridors around it."""
        for _ in range(int(self._rng.integers(1, 4))):
            size = self._rng.uniform(0.3, 0.6)
            place = self._rng.uniform([x0 + 1.2, y0 + 1.2], [x1 - 1.2, y1 - 1.2])
            self._things.append((box(float(place[0]), float(place[1]), size, size), "plaster"))

    def _rooms(
        self,
        along: Sequence[float],
        deep: Sequence[float],
        facing: Tuple[bool, bool],
        ends: Tuple[bool, bool],
        doors: bool,
        turned: bool,
    ) -> None:
        """Rooms in one row or two along a corridor on either side.

        Args:
            along, deep: first and last coordinate on the two axes; turned: deep is x.
            facing: there is a corridor beyond the first, the last of deep.
            ends: there is one beyond the first, the last of along.
            doors: the rooms have some.
        """

        def line(a: Tuple[float, float], b: Tuple[float, float]) -> np.ndarray:
            points = np.array([a, b])
            return points[:, ::-1] if turned else points

        rows: List[Tuple[float, float, int]] = []  # deep from, to, and which of them its corridor is
        if all(facing) and deep[1] - deep[0] > TWO_ROWS_M:
            middle = self._rng.uniform(*(np.array(deep) + [3.2, -3.2]))
            self._walls.append((line((along[0], middle), (along[1], middle)), THIN_M))
            rows = [(deep[0], middle, 0), (middle, deep[1], 1)]
        else:
            side = int(self._rng.integers(2)) if all(facing) else int(facing[1])
            rows = [(deep[0], deep[1], side)]
            if facing[1 - side]:
                self._walls.append((line((along[0], deep[1 - side]), (along[1], deep[1 - side])), THIN_M))
        for end, there in zip(along, ends):
            if there:
                self._walls.append((line((end, deep[0]), (end, deep[1])), THIN_M))
        for start, stop, side in rows:
            at = (start, stop)[side]
            cuts = [along[0]]
            while along[1] - cuts[-1] > ROOM_M[0] + ROOM_M[1]:
                cuts.append(cuts[-1] + self._rng.uniform(*ROOM_M))
            cuts.append(along[1])
            for first, last in zip(cuts[:-1], cuts[1:]):
                if first > along[0]:
                    self._walls.append((line((first, start), (first, stop)), THIN_M))
                door = self._front(first, last, at, doors, line)
                if doors:
                    self._furnish((first, last), (start, stop), (door, at), turned)

    def _front(self, first: float, last: float, at: float, door: bool, line: Line) -> float:
        """Add the wall to the corridor with its door; returns where the door is."""
        glass = bool(self._rng.random() < self._p.glass)
        width = self._rng.uniform(*DOOR_M)
        middle = self._rng.uniform(first + 0.3 + width / 2.0, last - 0.3 - width / 2.0)
        closed = bool(self._rng.random() < _CLOSED)
        low, high = middle - width / 2.0, middle + width / 2.0
        pieces = [(first, low), (high, last)] if door else [(first, last)]
        for a, b in pieces:
            if glass and b - a > 0.6:
                self._panes.append(line((a + 0.05, at), (b - 0.05, at)))
                self._walls += [(line((end - 0.05, at), (end + 0.05, at)), 0.1) for end in (a, b)]
            else:
                self._walls.append((line((a, at), (b, at)), THIN_M))
        if door and closed:
            self._doors.append(line((low, at), (high, at)))
        return middle

    def _furnish(self, along: Sequence[float], deep: Sequence[float], door: Tuple[float, float], turned: bool) -> None:
        """Add boxes, most of them turned, but none near the door."""
        for _ in range(int(self._rng.integers(0, 4))):
            length, width = self._rng.uniform(0.4, 1.7), self._rng.uniform(0.4, 0.8)
            reach = 0.5 * math.hypot(length, width) + 0.1
            low, high = np.array([along[0], deep[0]]) + reach, np.array([along[1], deep[1]]) - reach
            place = self._rng.uniform(low, np.maximum(high, low))
            yaw = float(self._rng.choice([0.0, self._rng.uniform(-0.6, 0.6)]))
            if (high > low).all() and np.hypot(*(place - door)) > DOOR_ROOM_M + reach:
                outline = box(float(place[0]), float(place[1]), length, width, yaw)
                self._things.append(
                    (
                        outline[:, ::-1] if turned else outline,
                        str(self._rng.choice(["wood", "metal", "cloth", "plant"])),
                    )
                )

    def built(self, name: str) -> Building:
        """The building, skewed and turned."""
        lean = self._rng.uniform(-BEND, BEND, 2)
        bend = self._rng.uniform(-BEND, BEND, 2) / np.array([self._y[-1], self._x[-1]])
        placed = np.array([*self._rng.uniform(-5.0, 5.0, 2), self._rng.uniform(-math.pi, math.pi)])

        def at(points: np.ndarray) -> np.ndarray:
            x, y = points[..., 0], points[..., 1]
            skewed = np.stack([x + (lean[0] + bend[0] * x) * y, y + (lean[1] + bend[1] * y) * x], axis=-1)
            return se2.transform_points(placed, skewed)

        crossing = np.array([self._x[1:3].mean(), self._y[1:3].mean()])
        return Building(
            tuple(Wall(at(line), thickness) for line, thickness in self._walls),
            tuple(Pane(at(line)) for line in self._panes),
            (),
            tuple(Door(at(line)) for line in self._doors),
            tuple(Thing(at(outline), MATERIALS[kind], movable=True) for outline, kind in self._things),
            start=np.array([*at(crossing), 0.0]),
            name=name,
        )
