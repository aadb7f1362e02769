"""A second ray caster, written to be obviously right: the tests and the benchmark hold the compiled one against it.

It does not walk. The parameters at which a ray crosses grid lines are listed for both axes, sorted, and the cell
between two crossings is where the middle of that stretch lies. Lengths are in cells; t is the length of the ray.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, List, Optional

import numpy as np

CORNER = 1e-9  # two crossings this close are one corner
AXIS_PARALLEL = 1e-12  # a direction this small is rounding: cos(pi / 2) is 6e-17


@dataclass(frozen=True)
class Visits:
    """The cells of the grid that a ray touches, in order (V)."""

    t_in: np.ndarray  # (V,)
    t_out: np.ndarray  # (V,) equal to t_in for a cell touched at its corner only
    row: np.ndarray  # (V,) int
    column: np.ndarray


@dataclass(frozen=True)
class Run:
    """Occupied cells on a ray with no gap that counts."""

    t_in: float
    t_out: float
    cells: List[int]  # flat indices; the first of them is met first


def visits(x: float, y: float, direction_rad: float, shape: "tuple[int, int]") -> Visits:
    """The cells of a grid of this shape (rows, columns) that the ray from (x, y) touches."""
    origin = np.array([x, y])
    direction = np.array([np.cos(direction_rad), np.sin(direction_rad)])
    direction[np.abs(direction) < AXIS_PARALLEL] = 0.0
    crossings = np.concatenate([_crossings(origin[axis], direction[axis], shape[1 - axis]) for axis in (0, 1)])
    crossings.sort()
    t = np.concatenate([[0.0], crossings, [crossings[-1] + 1.0 if len(crossings) else 1.0]])
    stretches = np.flatnonzero(np.diff(t) > CORNER)
    middle = 0.5 * (t[stretches] + t[stretches + 1])
    cells = np.floor(origin + middle[:, None] * direction).astype(int)  # (S, 2) column, row
    t_in, t_out = t[stretches], t[stretches + 1]
    if not len(cells) or t_in[0] > 0.0 or (cells[0] != np.floor(origin)).any():  # starts on a line, and leaves at once
        cells = np.vstack([np.floor(origin).astype(int)[None], cells])
        t_in, t_out = np.concatenate([[0.0], t_in]), np.concatenate([[0.0], t_out])

    touched = [(t_in[0], t_out[0], *cells[0])]
    for before, cell, start, end in zip(cells[:-1], cells[1:], t_in[1:], t_out[1:]):
        if (before != cell).all():  # through a corner: the two cells beside it are touched as well
            touched += [(start, start, cell[0], before[1]), (start, start, before[0], cell[1])]
        touched.append((start, end, *cell))
    t_in, t_out, column, row = np.array(touched).T
    inside = (column >= 0) & (row >= 0) & (column < shape[1]) & (row < shape[0])
    return Visits(t_in[inside], t_out[inside], row[inside].astype(int), column[inside].astype(int))


def first_hit(
    occupied: np.ndarray, x: float, y: float, direction_rad: float, t_max: float, stops: Optional[np.ndarray] = None
) -> "tuple[float, set[int]]":
    """Length of the ray to the first occupied cell, inf if there is none, and the cells it meets there."""
    seen = visits(x, y, direction_rad, occupied.shape)
    hits = occupied[seen.row, seen.column] & (seen.t_in <= t_max)
    if stops is not None and stops[seen.row, seen.column].any():
        hits[np.argmax(stops[seen.row, seen.column]) :] = False
    if not hits.any():
        return np.inf, {-1}
    t = seen.t_in[np.argmax(hits)]
    here = hits & (seen.t_in <= t + 2.0 * CORNER)
    return t, set((seen.row * occupied.shape[1] + seen.column)[here])


def surfaces(
    occupied: np.ndarray,
    x: float,
    y: float,
    direction_rad: float,
    t_max: float,
    min_gap: float,
    same_wall: Callable[[int, int], bool] = lambda passed, cell: False,
) -> List[Run]:
    """All surfaces that begin within t_max, gaps shorter than min_gap closed; t_out is inf beyond t_max.

    None begins at a cell for which same_wall(first cell of the surface before, cell) holds; but where such a cell is
    nearer than the gap to the surface before, it belongs to that, as any other cell does.
    """
    seen = visits(x, y, direction_rad, occupied.shape)
    found: List[Run] = []
    for t_in, t_out, row, column in zip(seen.t_in, seen.t_out, seen.row, seen.column):
        if not occupied[row, column] or t_in > t_max:
            continue
        t_out = t_out if t_out <= t_max else np.inf
        cell = int(row * occupied.shape[1] + column)
        if found and t_in - found[-1].t_out < max(min_gap, CORNER):
            last = found.pop()
            found.append(Run(last.t_in, max(t_out, last.t_out), last.cells + [cell]))
        elif not (found and same_wall(found[-1].cells[0], cell)):
            found.append(Run(t_in, t_out, [cell]))
    return found


def _crossings(origin: float, direction: float, cells: int) -> np.ndarray:
    """t at which the ray crosses the grid lines 0 ... cells of one axis; none for a ray along them.

    A ray that starts on a line crosses it if it goes downwards: the line belongs to the cell above.
    """
    if direction == 0.0:
        return np.zeros(0)
    lines = np.arange(cells + 1)
    ahead = lines > np.floor(origin) if direction > 0.0 else lines <= np.floor(origin)
    return (lines[ahead] - origin) / direction
