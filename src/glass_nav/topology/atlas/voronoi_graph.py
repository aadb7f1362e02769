"""GridMap -> the generalized Voronoi graph of its free space: meetpoints, and the ways between them.

The graph is that of the cells that bound free space: Delaunay triangles of their centres, whose circumcentres are
equidistant from three of them, joined where two triangles share a side. What two neighbouring cells of one wall give
is left out, what a robot of that radius cannot reach is left out, twigs are pruned and meetpoints that no lidar can
tell apart are made one. It works on a map of a building and on the few metres around a robot alike, so that the
atlas and the robot see the same graph.

What is an obstacle:
- Occupied cells are walls, glass or not.
- Unknown cells cannot be driven through, so they bound the graph like walls. But no lidar sees that boundary: the real
  wall is somewhere beyond. So each node tells how far from any wall its obstacles are (doubt_m): 0 at walls, some cells
  where a wall has gaps, up to r at the frontier of what is known.
- Things smaller than smallest_obstacle_m that the robot can pass on all sides make no meetpoints; the clearance of an
  edge knows them. Unknown specks of that size with no wall in them are free.

V vertices of the raw graph, N nodes, E edges; coordinates inside are cells, x along columns, y along rows.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass
from typing import Callable, Dict, List, Sequence, Tuple

import numpy as np
from scipy import ndimage, sparse
from scipy.spatial import Delaunay, cKDTree

from glass_nav.geometry import se2
from glass_nav.world.grid_map import GridMap

SEPARATION_CELLS = 3.5  # cells of one wall lie closer; nearer walls than this cannot be told from one
CORNER = 0.5  # r falls by more than this share of the way into a corner of 60 degrees or more,
CORNER_SLACK_CELLS = 2.0  # unless by so much walls are rough
STEPS = 5  # of build()
TRACE_CELLS = 3.0  # a line is smoothed over so many cells (1 sigma): the steps of rasterized walls
POINT_CELLS = 1.0  # distance of the points of a line


@dataclass(frozen=True)
class VoronoiParams:
    """Lengths in metres. The defaults are for a robot of 0.22 m radius with a lidar good to some centimetres."""

    robot_radius_m: float = 0.22  # narrower passages and what lies beyond them are not in the graph,
    passage_margin_m: float = 0.04  # nor those with less room than this on each side: no robot drives through them
    smallest_obstacle_m: float = 0.25  # free-standing things that measure less make no meetpoints
    leaf_m: float = 0.3  # a twig goes when length + r at its end - r at its junction is less than this,
    leaf_share_of_r: float = 0.6  # or less than this times r at its junction
    merge_m: float = 0.3  # meetpoints closer along their edge are one, and those where a robot at
    equidistance_m: float = 0.15  # either sees the obstacles of the other nearer than r and this
    smallest_component_m: float = 2.0  # a part of the graph with less way in it is left out

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (np.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} must be finite and >= 0, got {value}")
        if not self.robot_radius_m > 0.0:
            raise ValueError(f"robot_radius_m must be > 0 m, got {self.robot_radius_m}")


@dataclass(frozen=True)
class VoronoiGraph:
    """Nodes and edges in the frame of the map. Nodes are of degree 1, 3 or more, but for one on each plain ring."""

    position_m: np.ndarray  # (N, 2)
    r_m: np.ndarray  # (N,) mean distance of the obstacles that it is equidistant from
    spread_m: np.ndarray  # (N,) how far the meetpoints lay apart that were made one; 0 for most
    doubt_m: np.ndarray  # (N,) how far the most doubtful of these obstacles is from a wall, at most r
    obstacles_m: List[np.ndarray]  # (N) arrays (k, 2): the obstacles' nearest cells
    edge_node: np.ndarray  # (E, 2) int: nodes that each edge joins
    lines_m: List[np.ndarray]  # (E) arrays (n, 2) from the one to the other, n >= 2
    line_clearance_m: List[np.ndarray]  # (E) arrays (n,) distance of the nearest obstacle, posts and specks too
    left_out: int  # parts of the free space that were too small for smallest_component_m

    @property
    def degree(self) -> np.ndarray:
        """(N,) number of ends of edges."""
        return np.bincount(self.edge_node.ravel(), minlength=len(self.r_m))

    def components(self) -> Tuple[int, np.ndarray]:
        """How many parts do not touch, and (N,) in which of them each node lies."""
        return _components(len(self.r_m), self.edge_node[:, 0], self.edge_node[:, 1])


def build(
    grid_map: GridMap, params: VoronoiParams = VoronoiParams(), step: Callable[[], None] = lambda: None
) -> VoronoiGraph:
    """The graph of all free space that the robot can stand in; without any, a graph of no nodes.

    Args:
        grid_map: any grid, large or small.
        params: of the robot and of its lidar.
        step: called STEPS times on the way.
    """
    cell_m = grid_map.resolution_m
    clearance = max((params.robot_radius_m + params.passage_margin_m) / cell_m, SEPARATION_CELLS / 2.0)
    bounds = _bounds(grid_map, clearance, params.smallest_obstacle_m / cell_m)
    step()
    raw = _raw_graph(bounds, clearance)
    step()
    twigs = _Chains(raw)
    twigs.prune(params.leaf_m / cell_m, params.leaf_share_of_r)
    step()
    meetpoints = _Meetpoints(bounds.points, raw, twigs.kept())
    meetpoints.merge(params.merge_m / cell_m, params.equidistance_m / cell_m)
    left_out = meetpoints.drop_small(params.smallest_component_m / cell_m)
    step()
    graph = _in_map(grid_map, bounds, raw, meetpoints, left_out)
    step()
    return graph


# -- the cells that bound free space


@dataclass(frozen=True)
class _Bounds:
    points: np.ndarray  # (G, 2) centres of cells that bound free space
    doubt: np.ndarray  # (G,) distance of the nearest wall
    posts: np.ndarray  # (K, 2) centres of cells of things that make no meetpoints
    open: np.ndarray  # (H + 2, W + 2) bool: free, or within such a thing; one more cell on each side


def _bounds(grid_map: GridMap, clearance: float, smallest: float) -> _Bounds:
    free = np.pad(grid_map.free, 1)
    _drop_specks(free, np.pi * clearance**2)
    rows, columns = np.nonzero(_around(free) & ~free)
    points = np.column_stack([columns, rows]) - 0.5  # centre of cell 0 is at 0.5, less the border of 1
    occupied = np.pad(grid_map.occupied, 1)
    doubt = _distance_of_walls(occupied, rows, columns)
    blobs, count = ndimage.label(~free, np.ones((3, 3), bool))
    blob = blobs[rows, columns]
    has_wall = np.zeros(count + 1, bool)
    has_wall[blobs[occupied]] = True
    speck = _is_small(points, blob, smallest) & ~has_wall[blob]
    post = np.zeros(len(points), bool)
    post[~speck] = _posts(points[~speck], blob[~speck], 2.0 * clearance, smallest)
    if (post | speck).any():
        passed = np.zeros(count + 1, bool)
        passed[blob[post | speck]] = True
        free |= passed[blobs]
    bound = ~(post | speck)
    return _Bounds(points[bound], doubt[bound], points[post], free)


def _drop_specks(free: np.ndarray, least_cells: float) -> None:
    """Free cells in pieces too small for the robot are no longer free; in place."""
    label, count = ndimage.label(free)
    large = np.bincount(label.ravel(), minlength=count + 1) >= least_cells
    large[0] = False
    np.take(large, label, out=free)


def _around(cells: np.ndarray) -> np.ndarray:
    """(H, W) bool: one of the cell itself and its 8 neighbours is set."""
    beside = cells.copy()
    beside[1:] |= cells[:-1]
    beside[:-1] |= cells[1:]
    around = beside.copy()
    around[:, 1:] |= beside[:, :-1]
    around[:, :-1] |= beside[:, 1:]
    return around


def _distance_of_walls(occupied: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """(G,) how far from each cell the nearest occupied one is: 0 if it is one, inf if there is none."""
    away = np.where(occupied[rows, columns], 0.0, np.inf)
    walls = np.argwhere(occupied & _around(~occupied))
    if len(walls):
        doubtful = away > 0.0
        away[doubtful], _ = cKDTree(walls).query(np.column_stack([rows[doubtful], columns[doubtful]]))
    return away


def _posts(points: np.ndarray, blob: np.ndarray, gap: float, smallest: float) -> np.ndarray:
    """(G,) bool: belongs to a thing smaller than that along both axes, further than the gap from everything else.

    Points (G, 2) of one blob of cells are one thing, and so are those that the robot cannot pass between.
    """
    post = _is_small(points, blob, smallest)
    small = np.flatnonzero(post)
    if not len(small):
        return post
    if len(small) < len(points):
        away, _ = cKDTree(points[~post]).query(points[small], distance_upper_bound=gap)
        attached = np.isfinite(away)
    else:
        attached = np.zeros(len(small), bool)
    thing = _things(points[small], gap)
    of_large = np.zeros(thing.max() + 1, bool)
    of_large[thing[attached]] = True
    post[small] = _is_small(points[small], thing, smallest) & ~of_large[thing]
    return post


def _is_small(points: np.ndarray, thing: np.ndarray, smallest: float) -> np.ndarray:
    """(G,) bool: all points with this number lie within less than that along both axes, cells and all."""
    if not len(points):
        return np.zeros(0, bool)
    order = np.argsort(thing, kind="stable")
    starts = np.flatnonzero(np.diff(thing[order], prepend=-1))
    size = (np.maximum.reduceat(points[order], starts) - np.minimum.reduceat(points[order], starts) + 1.0).max(axis=1)
    small = np.empty(len(points), bool)
    small[order] = np.repeat(size < smallest, np.diff(starts, append=len(points)))
    return small


def _things(points: np.ndarray, gap: float) -> np.ndarray:
    """(G,) the number of the group of each point: groups are further apart than the gap.

    The Delaunay triangulation holds the shortest tree that spans all points, so its short sides are enough.
    """
    far = 1e3 * (1.0 + np.abs(points).max()) * np.array([[-1, -1], [2, -1], [-1, 2]])  # points in a line have no mesh
    sides = _sides(Delaunay(np.concatenate([points, far])).simplices)
    sides = sides[(sides < len(points)).all(axis=1)]
    short = np.hypot(*(points[sides[:, 0]] - points[sides[:, 1]]).T) <= gap
    return _components(len(points), sides[short, 0], sides[short, 1])[1]


def _sides(triangles: np.ndarray) -> np.ndarray:
    """(3T, 2) the sides of triangles (T, 3)."""
    return np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])


def _components(count: int, first: np.ndarray, second: np.ndarray) -> Tuple[int, np.ndarray]:
    links = sparse.coo_matrix((np.ones(len(first), np.int8), (first, second)), shape=(count, count))
    parts, label = sparse.csgraph.connected_components(links, directed=False)
    return int(parts), label


# -- circumcentres and the ridges between them


@dataclass(frozen=True)
class _RawGraph:
    points: np.ndarray  # (V, 2) circumcentres
    r: np.ndarray  # (V,) their distance from the cells that they are equidistant from
    generator: np.ndarray  # (V, 3) int: these cells, rows of _Bounds.points
    links: np.ndarray  # (L, 2) int: vertices that a ridge joins


def _raw_graph(bounds: _Bounds, clearance: float) -> _RawGraph:
    if len(bounds.points) < 4:
        return _RawGraph(np.zeros((0, 2)), np.zeros(0), np.zeros((0, 3), int), np.zeros((0, 2), int))
    mesh = Delaunay(bounds.points)
    centres, r = _circumcircles(bounds.points[mesh.simplices])
    with np.errstate(invalid="ignore"):  # slivers on the hull have none
        inside = (
            (r > clearance)
            & (centres > -1.0).all(axis=1)
            & (centres < np.array(bounds.open.shape[::-1]) - 1.0).all(axis=1)
        )
    reachable = np.flatnonzero(inside)
    column_row = np.floor(centres[reachable] + 1.0).astype(np.int64)
    reachable = reachable[bounds.open[column_row[:, 1], column_row[:, 0]]]
    vertex = np.full(len(mesh.simplices), -1)
    vertex[reachable] = np.arange(len(reachable))
    links = []
    for opposite in range(3):  # the side opposite to corner k is shared with neighbour k
        beyond = mesh.neighbors[reachable, opposite]
        there = (beyond > reachable) & (vertex[beyond] >= 0)
        here, beyond = reachable[there], beyond[there]
        first = bounds.points[mesh.simplices[here, (opposite + 1) % 3]]
        second = bounds.points[mesh.simplices[here, (opposite + 2) % 3]]
        apart = np.hypot(*(first - second).T)
        middle = (first + second) / 2.0
        narrowest = np.sum((centres[here] - middle) * (centres[beyond] - middle), axis=1) < 0.0
        kept = (apart > SEPARATION_CELLS) & ~(narrowest & (apart <= 2.0 * clearance))
        links.append(np.column_stack([vertex[here[kept]], vertex[beyond[kept]]]))
    return _RawGraph(centres[reachable], r[reachable], mesh.simplices[reachable], np.concatenate(links))


def _circumcircles(corners: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Centres (T, 2) and radii (T,) of triangles (T, 3, 2); not finite where the corners are in a line."""
    first = corners[:, 0]
    b, c = corners[:, 1] - first, corners[:, 2] - first
    twice_area = b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0]
    bb, cc = np.sum(b * b, axis=1), np.sum(c * c, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        offset = np.column_stack([c[:, 1] * bb - b[:, 1] * cc, b[:, 0] * cc - c[:, 0] * bb]) / (
            2.0 * twice_area[:, None]
        )
    return first + offset, np.hypot(offset[:, 0], offset[:, 1])


# -- pruning


class _Chains:
    """The raw graph as junctions, ends and the chains of plain vertices between them; prune() takes twigs off.

    A leaf ends where it stops running into a corner: a corridor in the middle of its end, not in the corner of it
    whose twig was pruned last.
    """

    def __init__(self, raw: _RawGraph) -> None:
        self._r = raw.r.tolist()
        self._at_xy = raw.points.tolist()
        self._chains = _chains(raw)  # vertices of each chain, both ends included
        self._ends = [[chain[0], chain[-1]] for chain in self._chains]
        self._length = [_way(raw.points[chain]) for chain in self._chains]
        self._parts: List[List[Tuple[int, bool]]] = [[(number, False)] for number in range(len(self._chains))]
        self._alive = [True] * len(self._chains)
        self._at: Dict[int, List[int]] = {}  # chains at each junction or end; a loop is there twice
        for number, (first, last) in enumerate(self._ends):
            self._at.setdefault(first, []).append(number)
            self._at.setdefault(last, []).append(number)

    def prune(self, leaf: float, share_of_r: float) -> None:
        """Take off leaves with length + r_end - r_junction < max(leaf, share r_junction), least salient first."""
        twigs: List[Tuple[float, int]] = []

        def judge(number: int) -> None:
            side = self._free_end(number)
            if side >= 0:
                junction_r = self._r[self._ends[number][1 - side]]
                _, corner, end_r = self._corner(number, side)
                salience = self._length[number] - corner + end_r - junction_r
                if salience < max(leaf, share_of_r * junction_r):
                    heapq.heappush(twigs, (salience, number))

        for number in range(len(self._chains)):
            judge(number)
        while twigs:
            _, number = heapq.heappop(twigs)
            side = self._free_end(number) if self._alive[number] else -1
            if side < 0:
                continue
            junction = self._ends[number][1 - side]
            self._remove(number)
            left = self._at[junction]
            if len(left) == 2 and left[0] != left[1]:
                judge(self._join(left[0], left[1], junction))

    def kept(self) -> List[np.ndarray]:
        """Vertices (n,) of each chain that is left, both ends included, n >= 2."""
        kept = []
        for number in np.flatnonzero(self._alive).tolist():
            vertices = self._vertices(number)
            first, last = (
                self._corner(number, side)[0] if len(self._at[self._ends[number][side]]) == 1 else 0 for side in (0, 1)
            )
            first = min(first, len(vertices) - 2)
            kept.append(vertices[first : max(len(vertices) - last, first + 2)])
        return kept

    def _free_end(self, number: int) -> int:
        """Which end of a chain is free: 0, 1; -1 for neither or both."""
        free = [len(self._at[end]) == 1 for end in self._ends[number]]
        return free.index(True) if free[0] != free[1] else -1

    def _corner(self, number: int, side: int) -> Tuple[int, float, float]:
        """How far an end of a chain runs into a corner: in vertices, as a length, and r where it begins to."""
        parts = self._parts[number]
        end = self._ends[number][side]
        before, along = end, 0.0
        count, best, corner = 0, self._r[end], (0, 0.0, self._r[end])
        for part, back in reversed(parts) if side else parts:
            chain = self._chains[part]
            for vertex in (chain[-2::-1] if back != bool(side) else chain[1:]).tolist():
                along += math.hypot(
                    self._at_xy[vertex][0] - self._at_xy[before][0], self._at_xy[vertex][1] - self._at_xy[before][1]
                )
                before, count = vertex, count + 1
                rise = self._r[vertex] - CORNER * along
                if rise > best:
                    best, corner = rise, (count, along, self._r[vertex])
                elif rise < best - CORNER_SLACK_CELLS:
                    return corner
        return corner

    def _remove(self, number: int) -> None:
        self._alive[number] = False
        for end in self._ends[number]:
            self._at[end].remove(number)

    def _join(self, first: int, second: int, junction: int) -> int:
        """One chain of two that meet where nothing else does."""
        turned = self._ends[first][0] == junction, self._ends[second][1] == junction
        parts = [
            [(part, back != turn) for part, back in self._parts[number][:: -1 if turn else 1]]
            for number, turn in zip((first, second), turned)
        ]
        ends = [self._ends[first][1 if turned[0] else 0], self._ends[second][0 if turned[1] else 1]]
        self._remove(first)
        self._remove(second)
        self._ends.append(ends)
        self._length.append(self._length[first] + self._length[second])
        self._parts.append(parts[0] + parts[1])
        self._alive.append(True)
        for end in ends:
            self._at[end].append(len(self._ends) - 1)
        return len(self._ends) - 1

    def _vertices(self, number: int) -> np.ndarray:
        pieces = [self._chains[part][::-1] if back else self._chains[part] for part, back in self._parts[number]]
        return np.concatenate([pieces[0], *(piece[1:] for piece in pieces[1:])])


def _chains(raw: _RawGraph) -> List[np.ndarray]:
    """Chains of vertices of degree 2 between others; a ring of such starts and ends where it is widest."""
    links = len(raw.links)
    ends = np.concatenate([raw.links[:, 0], raw.links[:, 1]])
    order = np.argsort(ends, kind="stable")
    degrees = np.bincount(ends, minlength=len(raw.r))
    start = np.concatenate([[0], np.cumsum(degrees)]).tolist()
    link_at = (order % max(links, 1)).tolist()
    beyond_at = np.concatenate([raw.links[:, 1], raw.links[:, 0]])[order].tolist()
    degree = degrees.tolist()
    walked = [False] * links

    def walk(vertex: int, place: int) -> np.ndarray:
        chain = [vertex]
        first = vertex
        while True:
            walked[link_at[place]] = True
            vertex = beyond_at[place]
            chain.append(vertex)
            if degree[vertex] != 2 or vertex == first:
                return np.array(chain)
            place = start[vertex] + (1 if walked[link_at[start[vertex]]] else 0)

    chains = []
    for vertex in np.flatnonzero((degrees > 0) & (degrees != 2)).tolist():
        for place in range(start[vertex], start[vertex + 1]):
            if not walked[link_at[place]]:
                chains.append(walk(vertex, place))
    plain = np.flatnonzero(degrees == 2)
    for vertex in plain[np.argsort(-raw.r[plain], kind="stable")].tolist():
        if not walked[link_at[start[vertex]]]:
            chains.append(walk(vertex, start[vertex]))
    return chains


def _way(points: np.ndarray) -> float:
    return float(np.hypot(*np.diff(points, axis=0).T).sum())


# -- meetpoints that are one


class _Meetpoints:
    """Nodes and lines between them; merge() makes nodes one that are too close to tell apart."""

    def __init__(self, bounds: np.ndarray, raw: _RawGraph, chains: Sequence[np.ndarray]) -> None:
        self.lines = [raw.points[chain] for chain in chains]
        self.ends = [[int(chain[0]), int(chain[-1])] for chain in chains]
        self.members = {end: [end] for ends in self.ends for end in ends}  # raw vertices of each node
        self.position = {node: raw.points[node] for node in self.members}
        self._r = {node: float(raw.r[node]) for node in self.members}
        self._obstacles = {node: bounds[raw.generator[node]] for node in self.members}
        self._at: Dict[int, List[int]] = {node: [] for node in self.members}
        for edge, ends in enumerate(self.ends):
            for end in ends:
                self._at[end].append(edge)
        self._length = [_way(line) for line in self.lines]
        self.edges = set(range(len(self.lines)))

    def merge(self, least: float, tolerance: float) -> None:
        """Contract edges that no robot can tell from a point, the shortest first; the others at their ends grow."""

        def further(node: int, other: int) -> float:
            """By how much are the obstacles of the other node further away from this one than its own."""
            away = np.hypot(*(self._obstacles[other] - self.position[node]).T)
            return float(away.max()) - self._r[node]

        def too_short(edge: int) -> bool:
            first, second = self.ends[edge]
            return first != second and (
                self._length[edge] < least or max(further(first, second), further(second, first)) < tolerance
            )

        short = [(self._length[edge], edge) for edge in self.edges if too_short(edge)]
        heapq.heapify(short)
        while short:
            length, edge = heapq.heappop(short)
            if edge in self.edges and length == self._length[edge] and too_short(edge):
                for changed in self._contract(edge):
                    if too_short(changed):
                        heapq.heappush(short, (self._length[changed], changed))

    def drop_small(self, least: float) -> int:
        """Leave out parts with less way in them, or none; returns how many there were."""
        edges = sorted(self.edges)
        number = {node: index for index, node in enumerate(self.members)}
        count, part = _components(
            len(number),
            np.array([number[self.ends[edge][0]] for edge in edges], int),
            np.array([number[self.ends[edge][1]] for edge in edges], int),
        )
        of_edge = np.array([part[number[self.ends[edge][0]]] for edge in edges], int)
        way = np.bincount(of_edge, [self._length[edge] for edge in edges], minlength=count)
        small = (way < least) | (way == 0.0)
        self.edges -= {edge for edge, its in zip(edges, of_edge.tolist()) if small[its]}
        self.members = {node: members for node, members in self.members.items() if not small[part[number[node]]]}
        return int(small.sum())

    def _contract(self, edge: int) -> List[int]:
        """Both ends of an edge become one node between them, or the junction if one is a dead end. Returns the edges
        whose length changed.
        """
        kept, gone = sorted(self.ends[edge], key=lambda node: -len(self._at[node]))
        self._forget(edge)
        if not self._at[gone]:
            del self._at[gone], self.members[gone]
            return self._dissolve(kept) if len(self._at[kept]) == 2 else []
        count = len(self.members[kept]), len(self.members[gone])
        shares = np.array(count) / sum(count)
        centre = shares[0] * self.position[kept] + shares[1] * self.position[gone]
        for node in (kept, gone):
            for other in set(self._at[node]):
                self._move_end(other, node, centre)
        self.position[kept] = centre
        self._r[kept] = shares[0] * self._r[kept] + shares[1] * self._r[gone]
        self.members[kept] += self.members.pop(gone)
        self._obstacles[kept] = np.concatenate([self._obstacles[kept], self._obstacles.pop(gone)])
        for other in set(self._at[gone]):
            self.ends[other] = [kept if end == gone else end for end in self.ends[other]]
        self._at[kept] += self._at.pop(gone)
        return sorted(set(self._at[kept]))

    def _move_end(self, edge: int, node: int, centre: np.ndarray) -> None:
        """Let the line of an edge end there instead of at the node: what lies nearer than the node did is cut off."""
        for side in (0, 1):
            if self.ends[edge][side] == node:
                line = self.lines[edge][::-1] if side else self.lines[edge]
                away = np.hypot(*(line - centre).T)
                beyond = np.flatnonzero(away[1:-1] > away[0]) + 1
                inner = line[beyond[0] : -1] if len(beyond) else line[:0]
                line = np.concatenate([centre[None], inner, line[-1:]])
                self.lines[edge] = line[::-1] if side else line
        self._length[edge] = _way(self.lines[edge])

    def _dissolve(self, node: int) -> List[int]:
        """A node of degree 2 is none, but for the only one on a ring."""
        first, second = self._at[node]
        if first == second:
            return [first]
        lines = [
            self.lines[first] if self.ends[first][1] == node else self.lines[first][::-1],
            self.lines[second] if self.ends[second][0] == node else self.lines[second][::-1],
        ]
        ends = [
            self.ends[first][0 if self.ends[first][1] == node else 1],
            self.ends[second][1 if self.ends[second][0] == node else 0],
        ]
        self._forget(first)
        self._forget(second)
        del self._at[node], self.members[node]
        joined = len(self.lines)
        self.lines.append(np.concatenate([lines[0], lines[1][1:]]))
        self.ends.append(ends)
        self._length.append(_way(self.lines[joined]))
        self.edges.add(joined)
        for end in ends:
            self._at[end].append(joined)
        return [joined]

    def _forget(self, edge: int) -> None:
        self.edges.remove(edge)
        for end in self.ends[edge]:
            self._at[end].remove(edge)


def _smooth(line: np.ndarray) -> np.ndarray:
    """A line (n, 2) without the steps of the cells: even points, moved by a cell at most, ends by none."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    count = max(int(np.ceil(along[-1] / POINT_CELLS)), 1)
    at = np.linspace(0.0, along[-1], count + 1)
    even = np.column_stack([np.interp(at, along, line[:, axis]) for axis in (0, 1)])
    reach = min(int(4.0 * TRACE_CELLS / POINT_CELLS), count)
    before, after = 2.0 * even[0] - even[reach:0:-1], 2.0 * even[-1] - even[-2 : -2 - reach : -1]  # ends stay in place
    padded = np.concatenate([before, even, after])
    smooth = ndimage.gaussian_filter1d(padded, TRACE_CELLS / POINT_CELLS, axis=0, mode="nearest")
    move = smooth[reach : reach + count + 1] - even
    return even + move / np.maximum(np.hypot(*move.T), 1.0)[:, None]


# -- cells -> metres


def _in_map(grid_map: GridMap, bounds: _Bounds, raw: _RawGraph, meetpoints: _Meetpoints, left_out: int) -> VoronoiGraph:
    resolution_m = grid_map.resolution_m

    def metres(points: np.ndarray) -> np.ndarray:
        return se2.transform_points(grid_map.map_from_grid, points * resolution_m)

    nodes = sorted(meetpoints.members, key=lambda node: _order(meetpoints.position[node]))
    number = {node: index for index, node in enumerate(nodes)}
    members = [meetpoints.members[node] for node in nodes]
    cells = [np.unique(raw.generator[its]) for its in members]
    edges = sorted(
        (_edge([number[end] for end in meetpoints.ends[edge]], meetpoints.lines[edge]) for edge in meetpoints.edges),
        key=lambda edge: (edge[0], _order(edge[1][len(edge[1]) // 3])),
    )
    lines = [_smooth(line) for _, line in edges]
    obstacles = cKDTree(np.concatenate([bounds.points, bounds.posts])) if edges else None
    position = np.array([meetpoints.position[node] for node in nodes]).reshape(-1, 2)
    r_m = np.array([raw.r[its].mean() for its in members]) * resolution_m
    return VoronoiGraph(
        position_m=metres(position),
        r_m=r_m,
        spread_m=np.array(
            [np.sqrt(((raw.points[its] - raw.points[its].mean(axis=0)) ** 2).sum(axis=1).mean()) for its in members]
        )
        * resolution_m,
        doubt_m=np.minimum(np.array([bounds.doubt[its].max() for its in cells]) * resolution_m, r_m),
        obstacles_m=[metres(bounds.points[its]) for its in cells],
        edge_node=np.array([ends for ends, _ in edges], int).reshape(-1, 2),
        lines_m=[metres(line) for line in lines],
        line_clearance_m=[obstacles.query(line)[0] * resolution_m for line in lines] if obstacles is not None else [],
        left_out=left_out,
    )


def _edge(ends: List[int], line: np.ndarray) -> Tuple[List[int], np.ndarray]:
    """An edge from its lower node to its higher one, a loop to the side that comes first in order."""
    third = len(line) // 3
    if ends[0] > ends[1] or ends[0] == ends[1] and _order(line[third]) > _order(line[-1 - third]):
        return ends[::-1], line[::-1]
    return ends, line


def _order(point: np.ndarray) -> Tuple[float, float]:
    """By x, then y, to a hundredth of a cell: other versions of the mesh round otherwise."""
    return round(float(point[0]), 2), round(float(point[1]), 2)
