"""Atlases made for tests and benchmarks: random rotation systems, Voronoi graphs of random points, symmetric floors."""

from __future__ import annotations

from typing import List, Optional, Sequence, Tuple

import numpy as np

from glass_nav.topology.atlas.atlas import (
    DEAD_END,
    MEETPOINT,
    RING_MARKER,
    Atlas,
    Darts,
    Edges,
    MapReference,
    Nodes,
    Ragged,
    Visits,
    rings_clockwise,
)

SIGMA_M = 0.02


def atlas_of(
    position_m: np.ndarray,
    r_m: np.ndarray,
    ends: np.ndarray,
    length_m: np.ndarray,
    bearing_rad: Optional[np.ndarray] = None,
    chord_m: Optional[np.ndarray] = None,
    name: str = "made",
) -> Atlas:
    """An atlas of nodes (N, 2) and edges between them.

    Args:
        position_m: (N, 2).
        r_m: (N,).
        ends: (E, 2) nodes of each edge.
        length_m: (E,); shorter ones than the chord are made as long.
        bearing_rad: (D,) of the darts; default: straight to the other end.
        chord_m: (E,); default: between the ends.
    """
    step = position_m[ends[:, 1]] - position_m[ends[:, 0]]
    if chord_m is None:
        chord_m = np.linalg.norm(step, axis=1)
    if bearing_rad is None:
        out = np.arctan2(step[:, 1], step[:, 0])
        bearing_rad = np.stack([out, out + np.pi], axis=1).ravel()
    nodes, edges = len(position_m), len(ends)
    node = ends.ravel().astype(np.int64)
    rings = rings_clockwise(node, bearing_rad, nodes)
    degree = np.diff(rings.offsets)
    kind = np.select([degree == 1, degree == 2], [DEAD_END, RING_MARKER], MEETPOINT).astype(np.int8)
    return Atlas(
        name,
        MapReference("none", ""),
        Nodes(position_m, r_m, np.full(nodes, SIGMA_M), kind),
        Edges(
            np.maximum(length_m, chord_m), chord_m, np.full(edges, SIGMA_M), np.full(edges, 0.3), Ragged.empty(edges, 2)
        ),
        Darts(node, bearing_rad, Ragged.empty(2 * edges, 4)),
        rings,
        Visits.none(nodes, edges),
    )


def rotation_system(rng: np.random.Generator, values: int = 3) -> Atlas:
    """Any graph at all: loops, parallel edges, degrees 1 to 6, several components; few different values, so that much
    looks alike."""
    count = int(rng.integers(1, 9))
    ends = [(int(rng.integers(count)), int(rng.integers(count))) for _ in range(int(rng.integers(1, 13)))]
    lonely = set(range(count)) - {end for pair in ends for end in pair}
    ends += [(node, int(rng.integers(count))) for node in sorted(lonely)]
    length = rng.integers(2, 2 + values, len(ends)) * 3.0
    chord = length / rng.integers(1, 3, len(ends))
    bearing = rng.uniform(-np.pi, np.pi, 2 * len(ends))
    return atlas_of(
        rng.uniform(0.0, 20.0, (count, 2)),
        rng.integers(1, 1 + values, count) * 1.0,
        np.array(ends),
        length,
        bearing,
        chord,
    )


def voronoi(nodes: int, seed: int, spacing_m: float = 8.0) -> Atlas:
    """The Voronoi graph of random points: all nodes of degree 3 but those that the rim cut; r is the true equidistance.

    Ways are up to a third longer than their chords, and leave up to 20 degrees beside them.
    """
    from scipy.spatial import Voronoi, cKDTree

    rng = np.random.default_rng(seed)
    side = spacing_m * np.sqrt(nodes / 2.0)
    points = rng.uniform(0.0, side, (nodes // 2 + 2, 2))
    diagram = Voronoi(points)
    ridges = np.array(diagram.ridge_vertices)
    inside = np.all((diagram.vertices > 0.0) & (diagram.vertices < side), axis=1)
    ends = ridges[(ridges >= 0).all(axis=1)]
    ends = ends[inside[ends].all(axis=1)]
    names, ends = np.unique(ends, return_inverse=True)
    ends = ends.reshape(-1, 2)
    position = diagram.vertices[names]
    r = cKDTree(points).query(position)[0]
    chord = np.linalg.norm(position[ends[:, 1]] - position[ends[:, 0]], axis=1)
    length = np.maximum(chord, 0.05) * rng.uniform(1.0, 1.33, len(ends))
    step = position[ends[:, 1]] - position[ends[:, 0]]
    out = np.arctan2(step[:, 1], step[:, 0])
    bearing = np.stack([out, out + np.pi], axis=1).ravel() + rng.uniform(-0.35, 0.35, 2 * len(ends))
    return atlas_of(position, np.maximum(r, 0.05), ends, length, bearing, name=f"voronoi_{nodes}_{seed}")


def torus(columns: int, rows: int, spacing_m: float = 5.0) -> Atlas:
    """A grid that closes on itself: every dart looks like every other one. Positions are those on the plane."""
    column, row = np.divmod(np.arange(columns * rows), rows)
    east = ((column + 1) % columns) * rows + row
    north = column * rows + (row + 1) % rows
    here = np.arange(columns * rows)
    ends = np.concatenate([np.stack([here, east], axis=1), np.stack([here, north], axis=1)])
    bearing = np.concatenate([np.tile([0.0, np.pi], len(here)), np.tile([np.pi / 2, -np.pi / 2], len(here))])
    length = np.full(len(ends), spacing_m)
    return atlas_of(np.stack([column, row], axis=1) * spacing_m, np.full(len(here), 1.5), ends, length, bearing, length)


def corridors(
    xy: Sequence[Tuple[float, float]],
    r: Sequence[float],
    ends: Sequence[Tuple[int, int]],
    length: Optional[List[float]] = None,
) -> Atlas:
    """Straight corridors between a few places."""
    position, pairs = np.array(xy, float), np.array(ends)
    chord = np.linalg.norm(position[pairs[:, 1]] - position[pairs[:, 0]], axis=1)
    return atlas_of(position, np.array(r, float), pairs, chord if length is None else np.array(length))
