"""A small occupancy grid around the robot, made of scans and odometry, that contains glass.

A single scan shows a pane only where beams meet it almost at right angles, and elsewhere what lies behind. So each
cell counts, by beam direction, how many beams ended in it and how many passed it, and is occupied if beams from any
one direction end there. Beams that pass a pane at a flat angle do not contradict those that returned from it; beams
from about the same direction do (a person who walked on). A robot that drives along a pane sees every piece of it at
a right angle once, and always the piece beside it, since the nearest point of a plane is met at a right angle.

Between and beside such pieces there is probably more of the pane. They are extended along their line until there is
an obstacle, or beams have passed there almost at right angles.

The window moves with the robot in whole cells; poses are odom_from_base (3,). n x n cells, D directions.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Iterator, List, Optional, Tuple

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from glass_nav.geometry import angles, se2
from glass_nav.params import number
from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import UNKNOWN, GridMap

FREE, OCCUPIED = 0, 100
_FORGET_AT = 60  # beams counted in a cell from one direction: halved, so that what is new counts
_BEFORE_M = 0.05  # so near in front of where a beam ended it proves nothing: noise, and the cell's own size
_MIN_PIECE = 4  # cells of a pane that give a line
_LOOK_PAST_MIDDLE = 1.2  # times r from the middle of a room, r from its walls: these, and a little more
_SHOWS_PAST_MIDDLE = 1.6  # times r: the ways out as well
_CLIMB_M, _CLIMBS, _CLIMB_GAIN = 0.5, 60, 0.2  # towards the middle of a room: steps, and what each gains
_LOOK_PER_ROOM = 1.9  # of a meetpoint r from its obstacles all ways show that are longer than 1.6 r, and a little more


@dataclass(frozen=True)
class LocalMapParams:
    """Lengths in metres."""

    window_m: float = number(20.0, 1.0, 100.0)  # edge of the square around the robot
    narrow_window_m: float = number(12.0, 1.0, 100.0)  # of it, so much is looked at in narrow places, more in wide ones
    resolution_m: float = number(0.05, 0.01, 1.0)  # edge of a cell; that of the atlas' map
    directions: int = number(16, 1, 360)  # of beams, told apart
    least_ends: int = 2  # beams that must have ended in a cell from one direction ...
    least_share: float = 0.15  # ... and at least this share of those that came about that way
    unanswered_m: float = 4.0  # a beam that did not come back proves free space so far at most
    extend_glass_m: float = 0.6  # how far beyond what was seen of it a pane is taken to go on; 0: not
    robot_radius_m: float = 0.22  # where the robot stands there is room for it

    def __post_init__(self) -> None:
        for name in ("window_m", "narrow_window_m", "resolution_m", "robot_radius_m", "unanswered_m"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"~{name} must be > 0 m and finite, got {getattr(self, name)}")
        if self.window_m < 10.0 * self.resolution_m:
            raise ValueError(f"~window_m must be at least ten cells, got {self.window_m} m of {self.resolution_m} m")
        if not 4 <= self.directions <= 64:
            raise ValueError(f"~directions must be 4 to 64, got {self.directions}")
        if self.least_ends < 1:
            raise ValueError(f"~least_ends must be >= 1, got {self.least_ends}")
        if not 0.0 < self.least_share <= 1.0:
            raise ValueError(f"~least_share must be in (0, 1], got {self.least_share}")
        if not 0.0 <= self.extend_glass_m < math.inf:
            raise ValueError(f"~extend_glass_m must be >= 0 m and finite, got {self.extend_glass_m}")


class LocalMap:
    """A window of cells in the frame odom that goes with the robot."""

    def __init__(self, p: LocalMapParams = LocalMapParams()) -> None:
        self._p = p
        self._size = int(round(p.window_m / p.resolution_m))
        self._first = np.zeros(2, np.int64)  # column and row in odom of cell [0, 0]
        self._seen = False
        shape = (p.directions, self._size, self._size)
        self._ended, self._passed = np.zeros(shape, np.uint8), np.zeros(shape, np.uint8)
        self._stood = np.zeros(shape[1:], bool)  # the robot's outline was here
        self._occupied: Optional[np.ndarray] = None  # worked out since the last scan

    @property
    def params(self) -> LocalMapParams:
        return self._p

    def clear(self) -> None:
        """Forget everything."""
        self._occupied = None
        self._ended[:], self._passed[:], self._stood[:], self._seen = 0, 0, False, False

    def add(self, scan: Scan, odom_from_base: np.ndarray) -> None:
        """Take in a scan.

        Args:
            scan: in which beams begin at the laser; origins of deskewed ones are not looked at.
            odom_from_base: (3,) at its stamp.
        """
        self._occupied = None
        self._follow(odom_from_base)
        laser = se2.compose(odom_from_base, scan.base_from_laser)
        cell_m = self._p.resolution_m
        edges = (np.arange(self._size) + 0.5) * cell_m
        x = self._first[0] * cell_m + edges[None, :] - laser[0]
        y = self._first[1] * cell_m + edges[:, None] - laser[1]
        ends = self._ends(scan, laser)
        self._count(self._ended, np.unique(ends))
        passes = self._passes(scan, laser, x, y)
        ended = np.zeros(self._size**2, bool)
        ended[ends % self._size**2] = True
        self._count(self._passed, passes[~ended[passes % self._size**2]])
        body = (x + laser[0] - odom_from_base[0]) ** 2 + (y + laser[1] - odom_from_base[1]) ** 2
        self._stood |= body <= self._p.robot_radius_m**2

    # -- what stands where

    def occupied(self) -> np.ndarray:
        """(n, n) bool: something stands there, glass included, as far as it was seen itself."""
        if self._occupied is None:
            self._occupied = self._worked_out()
        return self._occupied

    def _worked_out(self) -> np.ndarray:
        likely = np.flatnonzero((self._ended >= self._p.least_ends).any(axis=0))  # few cells: the rest is quick
        ended, passed = self._counts_at(likely)
        passed += np.roll(passed, 1, axis=0) + np.roll(passed, -1, axis=0)
        stands = (ended >= self._p.least_ends) & (ended >= self._p.least_share * (ended + passed))
        occupied = np.zeros(self._size**2, bool)
        occupied[likely] = stands.any(axis=0)
        return occupied.reshape(self._size, self._size) & ~self._stood

    def _counts_at(self, cells: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """(directions, K) each: how many beams ended in the flat cells (K,), and how many passed them."""
        ended, passed = (
            counts.reshape(self._p.directions, -1)[:, cells].astype(np.int64) for counts in (self._ended, self._passed)
        )
        return ended, passed

    def glass(self) -> np.ndarray:
        """(n, n) bool: of what stands there, what beams passed from elsewhere."""
        occupied = self.occupied()
        cells = np.flatnonzero(occupied)  # few
        ended, passed = self._counts_at(cells)
        glass = np.zeros(occupied.size, bool)
        glass[cells] = ((passed > ended) & (ended == 0)).any(axis=0)
        return glass.reshape(occupied.shape)

    def walls(self) -> GridMap:
        """The window as a map with what stands there; all else is free."""
        return self._as_map(np.where(self.occupied(), np.int8(OCCUPIED), np.int8(FREE)))

    def grid(self) -> GridMap:
        """The window as a map in the frame odom, with panes extended."""
        occupied = self.occupied()
        free = (self._passed.any(axis=0) | self._stood) & ~occupied
        if self._p.extend_glass_m > 0.0:
            occupied = occupied | self._extended(occupied)
        occupancy = np.where(occupied & ~self._stood, OCCUPIED, np.where(free, FREE, UNKNOWN)).astype(np.int8)
        return self._as_map(occupancy)

    def grid_around(self, point_m: np.ndarray) -> GridMap:
        """Of grid(), a square around a point (2,) of the window: large enough that the ways out of a hall show as ways,
        and no larger, for what lies far away is known badly, behind glass worst of all.
        """
        whole, cell_m = self.grid(), self._p.resolution_m
        at = np.asarray(point_m) / cell_m - self._first
        reach_m = min(self._reach_m(point_m), 0.5 * self._p.window_m)
        low = np.maximum(np.rint(at - reach_m / cell_m), 0).astype(np.int64)
        high = np.rint(at + reach_m / cell_m).astype(np.int64)
        return GridMap(
            np.ascontiguousarray(whole.occupancy[low[1] : high[1], low[0] : high[0]]),
            cell_m,
            np.append((self._first + low) * cell_m, 0.0),
        )

    def shows_room(self, point_m: np.ndarray) -> bool:
        """Whether the window reaches as far around a point (2,) as its graph needs; also where nothing is known yet."""
        if not self._seen:
            return True
        away_m, room_m = self._middle_of_room(np.asarray(point_m, float))[1:]
        return away_m + _SHOWS_PAST_MIDDLE * room_m <= 0.5 * self._p.window_m

    def _reach_m(self, point_m: np.ndarray) -> float:
        """From a point (2,) to the edge of the square that grid_around() should show; inf: no wall is in the window.

        It is that of the room and not only that of the point: beside the wall of a hall the middle matters, too.
        """
        here_m, away_m, room_m = self._middle_of_room(np.asarray(point_m, float))
        return max(0.5 * self._p.narrow_window_m, _LOOK_PER_ROOM * here_m, away_m + _LOOK_PAST_MIDDLE * room_m)

    def _middle_of_room(self, point_m: np.ndarray) -> Tuple[float, float, float]:
        """Distance of a point (2,) from the walls, from the middle of the room that it is in, and of that from the walls."""
        rows, columns = np.nonzero(self.occupied())
        if not len(rows):
            return math.inf, 0.0, math.inf
        cell_m, at = self._p.resolution_m, point_m
        walls = cKDTree((np.column_stack([columns, rows]) + self._first + 0.5) * cell_m)
        room_m = here_m = float(walls.query(at)[0])
        around = 2.0 * np.pi / 16 * np.arange(16)
        steps = _CLIMB_M * np.column_stack([np.cos(around), np.sin(around)])
        for _ in range(_CLIMBS):
            ring = at + steps
            rooms_m = np.where(self._is_free(ring), walls.query(ring)[0], -math.inf)
            best = int(rooms_m.argmax())
            if rooms_m[best] < room_m + _CLIMB_GAIN * _CLIMB_M:
                break
            at, room_m = ring[best], float(rooms_m[best])
        return here_m, float(np.hypot(*(at - point_m))), room_m

    def _is_free(self, points_m: np.ndarray) -> np.ndarray:
        """(K,) bool: beams passed the points (K, 2), and no obstacle is there."""
        columns, rows = (np.floor(points_m / self._p.resolution_m).astype(np.int64) - self._first).T
        inside = (columns >= 0) & (columns < self._size) & (rows >= 0) & (rows < self._size)
        columns, rows = np.where(inside, columns, 0), np.where(inside, rows, 0)
        known = self._passed[:, rows, columns].any(axis=0) | self._stood[rows, columns]
        return inside & known & ~self.occupied()[rows, columns]

    def coarser(self, factor: int) -> LocalMap:
        """A window of as many cells, each as large as factor x factor of these, that knows what this one knows."""
        p = replace(self._p, window_m=factor * self._p.window_m, resolution_m=factor * self._p.resolution_m)
        wide = LocalMap(p)
        first = self._first // factor
        count = (self._first + self._size - 1) // factor - first + 1  # of its cells, that these are in
        offset = (self._size - count) // 2
        wide._first, wide._seen = first - offset, self._seen
        low = self._first - first * factor
        high = count * factor - self._size - low
        columns, rows = (slice(int(begin), int(begin + length)) for begin, length in zip(offset, count))
        for to, cells, whole in (
            (wide._ended, self._ended, np.max),
            (wide._passed, self._passed, np.min),  # a cell with a wall in it was not passed
            (wide._stood, self._stood, np.min),
        ):
            beside = [(0, 0)] * (cells.ndim - 2)
            padded = np.pad(cells, [*beside, (int(low[1]), int(high[1])), (int(low[0]), int(high[0]))], "edge")
            blocks = padded.reshape(*cells.shape[:-2], int(count[1]), factor, int(count[0]), factor)
            to[..., rows, columns] = whole(blocks, axis=(-3, -1))
        return wide

    def _as_map(self, occupancy: np.ndarray) -> GridMap:
        return GridMap(occupancy, self._p.resolution_m, np.append(self._first * self._p.resolution_m, 0.0))

    # -- counting

    def _follow(self, odom_from_base: np.ndarray) -> None:
        """Keep the robot in the middle quarter of the window."""
        cell_m = self._p.resolution_m
        wanted = np.floor(odom_from_base[:2] / cell_m).astype(np.int64) - self._size // 2
        shift = wanted - self._first
        if not self._seen:
            self._first, self._seen = wanted, True
            return
        if np.abs(shift).max() <= self._size // 16:
            return
        self._first = wanted
        for cells in (self._ended, self._passed, self._stood):
            moved = np.zeros_like(cells)
            kept = self._size - np.abs(shift)
            if (kept > 0).all():
                (to_x, from_x), (to_y, from_y) = (_overlap(int(step), self._size) for step in shift)
                moved[..., to_y, to_x] = cells[..., from_y, from_x]
            cells[...] = moved

    def _counters(self, angle_rad: np.ndarray, cell: np.ndarray) -> np.ndarray:
        """(K,) flat indices of counts: of the directions that angles (K,) in odom belong to, at flat cells (K,)."""
        turn = self._p.directions / (2.0 * np.pi)
        return np.floor(angle_rad * turn + 0.5).astype(np.int64) % self._p.directions * self._size**2 + cell

    def _ends(self, scan: Scan, laser: np.ndarray) -> np.ndarray:
        """(K,) counters of the cells in which beams ended."""
        answered = scan.answered
        bearing = scan.angles_rad[answered] + laser[2]
        ranges_m = scan.ranges_m[answered]
        points = laser[:2] + ranges_m[:, None] * np.column_stack([np.cos(bearing), np.sin(bearing)])
        column_row = np.floor(points / self._p.resolution_m).astype(np.int64) - self._first
        inside = ((column_row >= 0) & (column_row < self._size)).all(axis=1)
        cell = column_row[inside, 1] * self._size + column_row[inside, 0]
        return self._counters(bearing[inside], cell)

    def _passes(self, scan: Scan, laser: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """(K,) counters of the cells that beams passed; each cell once."""
        count = len(scan)
        step = float(scan.angles_rad[1] - scan.angles_rad[0]) if count > 1 else 2.0 * np.pi
        ranges_m = np.where(np.isposinf(scan.ranges_m), min(self._p.unanswered_m, scan.range_max_m), scan.ranges_m)
        ranges_m = np.where(np.isfinite(ranges_m), ranges_m, 0.0) - _BEFORE_M
        around = ndimage.minimum_filter1d(ranges_m, 3, mode="nearest")  # a beam beside it counts as well
        away = np.sqrt(x * x + y * y).ravel()
        cells = np.flatnonzero(away < around.max())  # may be passed: the angle takes longest
        bearing = np.arctan2(y[cells // self._size, 0], x[0, cells % self._size])
        middle = 0.5 * step * (count - 1)
        relative = angles.wrap(bearing - laser[2] - scan.angles_rad[0] - middle) + middle
        beam = np.rint(relative / step).astype(np.int64)
        looked = (beam >= 0) & (beam < count)
        passed = looked & (away[cells] < around[np.where(looked, beam, 0)])
        return self._counters(bearing[passed], cells[passed])

    def _count(self, counts: np.ndarray, counters: np.ndarray) -> None:
        """Increase these distinct counters (K,) by one; both counts of a cell are halved once they are large."""
        counts = counts.reshape(-1)
        counts[counters] += 1
        many = counters[counts[counters] >= _FORGET_AT]
        if len(many):
            for of_all in (self._ended, self._passed):
                of_all.reshape(-1)[many] >>= 1

    # -- panes

    def _extended(self, occupied: np.ndarray) -> np.ndarray:
        """(n, n) bool: free cells that continue the line of a piece of glass."""
        more = np.zeros_like(occupied)
        cells = np.flatnonzero(self.glass())
        ended = self._counts_at(cells)[0] >= self._p.least_ends
        for direction in np.flatnonzero(ended.any(axis=1)).tolist():
            rows, columns = np.divmod(cells[ended[direction]], self._size)
            for points in _pieces(np.column_stack([columns, rows])):
                for beyond in self._beyond(points.astype(float), direction):
                    self._stand(beyond, more, occupied, direction)
        return more

    def _beyond(self, points: np.ndarray, direction: int) -> List[np.ndarray]:
        """Rows of column and row (k, 2) along the line of a piece (m, 2) of a pane, from either end outwards; none if
        it is no line across that direction.
        """
        centre = points.mean(axis=0)
        values, vectors = np.linalg.eigh(np.cov((points - centre).T))
        along = vectors[:, 1]
        beam = 2.0 * math.pi * direction / self._p.directions
        flat = abs(float(along @ [math.cos(beam), math.sin(beam)]))
        if values[1] < 4.0 * max(values[0], 0.1) or flat > math.sin(1.5 * math.pi / self._p.directions):
            return []
        at = (points - centre) @ along
        reach = self._p.extend_glass_m / self._p.resolution_m
        steps = np.arange(0.5, reach, 0.5)
        return [
            np.rint(centre + (end + sign * steps)[:, None] * along).astype(np.int64)
            for end, sign in ((at.max(), 1.0), (at.min(), -1.0))
        ]

    def _stand(self, cells: np.ndarray, more: np.ndarray, occupied: np.ndarray, direction: int) -> None:
        """Mark cells as occupied, in order, up to an obstacle or to a cell that beams of that direction passed."""
        near = np.array([[(direction + off) % self._p.directions] for off in (-1, 0, 1)])
        inside = ((cells >= 0) & (cells < self._size)).all(axis=1)
        columns, rows = np.where(inside[:, None], cells, 0).T
        passed = self._passed[near, rows, columns].sum(axis=0, dtype=np.int64) > 1
        ends = np.flatnonzero(passed | ~inside)
        until = ends[0] if len(ends) else len(cells)
        rows, columns = rows[:until], columns[:until]
        more[rows, columns] |= ~occupied[rows, columns]


def _pieces(cells: np.ndarray) -> Iterator[np.ndarray]:
    """The connected pieces, large enough for a line, of cells (K, 2): column and row of each in order of rows."""
    low = cells.min(axis=0)
    box = np.zeros(cells.max(axis=0) - low + 1, bool).T
    box[tuple((cells - low).T[::-1])] = True
    label, _ = ndimage.label(box, np.ones((3, 3), bool))
    for piece, window in enumerate(ndimage.find_objects(label), start=1):
        rows, columns = np.nonzero(label[window] == piece)
        if len(rows) >= _MIN_PIECE:
            yield np.column_stack([columns + window[1].start, rows + window[0].start]) + low


def _overlap(shift: int, size: int) -> Tuple[slice, slice]:
    """Slices along one axis of a shifted window: where the cells that stay go to, and where they come from."""
    if shift >= 0:
        return slice(0, size - shift), slice(shift, size)
    return slice(-shift, size), slice(0, size + shift)
