"""Random paths through the free space of a building, clear of walls and furniture."""

from __future__ import annotations

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from glass_nav.simulation import building_map
from glass_nav.simulation.building import Building

CELL_M = 0.2
CLEARANCE_M = 0.5  # from the middle of the path to the nearest surface of the map
STRIDE = 3  # cells between waypoints


def tour(building: Building, rng: np.random.Generator, stops: int = 4, least_m: float = 5.0) -> np.ndarray:
    """(W, 2) waypoints through random places, one after the other by a shortest path.

    Args:
        building: as it is now.
        rng: draws the places.
        stops: so many.
        least_m: as the crow flies, from one stop to the next.

    Raises:
        ValueError: there are no such places.
    """
    grid = building_map.draw(building)
    room_m = ndimage.distance_transform_edt(np.pad(grid.free, 1))[1:-1, 1:-1] * grid.resolution_m
    step = round(CELL_M / grid.resolution_m)
    clear = room_m[::step, ::step] >= CLEARANCE_M
    graph = _neighbours(clear)
    parts = csgraph.connected_components(graph, directed=False)[1]
    start = _nearest(grid.cells(building.start[:2]), clear, step)
    reachable = np.flatnonzero(clear.ravel() & (parts == parts[start]))
    chosen = [start]
    for cell in rng.permutation(reachable).tolist():
        way = np.array(divmod(cell, clear.shape[1])) - divmod(chosen[-1], clear.shape[1])
        if CELL_M * np.hypot(*way) >= least_m:
            chosen.append(cell)
        if len(chosen) > stops:
            break
    if len(chosen) < 2:
        raise ValueError(f"{building.name}: no path of {least_m:g} m")
    cells = [chosen[0]]
    for start, goal in zip(chosen[:-1], chosen[1:]):
        before = csgraph.dijkstra(graph, indices=start, return_predecessors=True)[1]
        back = [goal]
        while back[-1] != start:
            back.append(int(before[back[-1]]))
        cells += [*back[-1 - STRIDE : 0 : -STRIDE], goal]
    rows, columns = np.divmod(np.array(cells), clear.shape[1])
    return grid.centres(rows * step, columns * step)


def _nearest(cell: "tuple[np.ndarray, np.ndarray]", clear: np.ndarray, step: int) -> int:
    """Flat index of the clear node nearest to a cell of the map."""
    rows, columns = np.nonzero(clear)
    near = int(np.argmin((rows * step - cell[0]) ** 2 + (columns * step - cell[1]) ** 2))
    return int(rows[near] * clear.shape[1] + columns[near])


def _neighbours(clear: np.ndarray) -> sparse.csr_matrix:
    """Lengths between clear nodes beside each other, also across corners."""
    number = np.arange(clear.size).reshape(clear.shape)
    rows, columns, lengths = [], [], []
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        high, wide = clear.shape
        here = (slice(0, high - down), slice(max(0, -right), wide - max(0, right)))
        there = (slice(down, high), slice(max(0, right), wide + min(0, right)))
        both = clear[here] & clear[there]
        rows.append(number[here][both])
        columns.append(number[there][both])
        lengths.append(np.full(int(both.sum()), np.hypot(down, right)))
    edges = np.concatenate(lengths), (np.concatenate(rows), np.concatenate(columns))
    graph = sparse.coo_matrix(edges, shape=(clear.size, clear.size))
    return (graph + graph.T).tocsr()
