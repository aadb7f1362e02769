"""The hierarchical atlas: a rotation system of meetpoints, edges and darts, in arrays.

Every edge has two darts: dart 2e leaves its first node, dart 2e + 1 its second one, so dart ^ 1 is the same edge in
the other direction. At each node the darts are kept in clockwise order, seen from above. Edges are not identified by
their nodes: an edge may return to the node that it left, and two nodes may share several edges. A robot that arrives at
a node is at a dart, the one that leads back. N nodes, E edges, D = 2E darts, up to millions of each.

Seed document: global_localization_procedure.txt, "Uniqueness in the Hierarchical Atlas": average of the equidistant
distances per meetpoint, straight-line and travelled distance and two directional feature maps per edge. The edge
angles, which it leaves for later, are kept per dart.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Sequence, Tuple

import numpy as np

from glass_nav.topology.atlas import components
from glass_nav.world.free_space import FreeSpace
from glass_nav.world.grid_map import GridMap

MEETPOINT, DEAD_END, RING_MARKER = 0, 1, 2
KINDS = ("meetpoint", "dead_end", "ring_marker")  # a ring without a meetpoint has one node, somewhere on it

BEARING_AT_M = 0.5  # a dart's bearing is measured from its node to the point this far along the edge, or to its end
ORDER_SLACK_RAD = 1e-3  # rounding may turn two darts of one node past each other by this angle
CHORD_SLACK_M = 1e-3  # rounding may make a straight edge shorter than its chord by this length
MAX_DIFFERING_SHARE = 1e-3  # of the free cells: another drawing of the same map, not another map
MIN_MISSES = 3  # lately, before a node counts as usually missed
POLYLINE_SLACK_M = 0.5  # the line of an edge may end this far from its node: meetpoints lie between cells


class AtlasError(ValueError):
    """An atlas that breaks a rule; one line: which node, edge or dart, what was given, what is allowed."""


@dataclass(frozen=True)
class Ragged:
    """Rows of different lengths, concatenated in one array."""

    values: np.ndarray  # (V, ...)
    offsets: np.ndarray  # (rows + 1,) int64: row i is values[offsets[i]:offsets[i + 1]]

    @classmethod
    def of(cls, rows: Sequence[np.ndarray], width: int) -> "Ragged":
        """Concatenates arrays (n_i, width)."""
        offsets = np.concatenate([[0], np.cumsum([len(row) for row in rows], dtype=np.int64)]).astype(np.int64)
        values = [np.asarray(row, float).reshape(-1, width) for row in rows]
        return cls(np.concatenate(values) if values else np.zeros((0, width)), offsets)

    @classmethod
    def empty(cls, rows: int, width: int) -> "Ragged":
        """This number of empty rows."""
        return cls(np.zeros((0, width)), np.zeros(rows + 1, np.int64))

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def __getitem__(self, row: int) -> np.ndarray:
        return self.values[self.offsets[row] : self.offsets[row + 1]]

    def refuse_bad_offsets(self, what: str, rows: int) -> None:
        """Raises AtlasError unless there is that number of rows and they cover the values."""
        if self.offsets.shape != (rows + 1,):
            raise AtlasError(f"{what} need {rows} rows, got {len(self.offsets) - 1}")
        if self.offsets[0] != 0 or self.offsets[-1] != len(self.values) or np.any(np.diff(self.offsets) < 0):
            raise AtlasError(f"the offsets of {what} must ascend from 0 to {len(self.values)}")


@dataclass(frozen=True)
class Nodes:
    """Meetpoints, dead ends, and one marker on each ring without either."""

    position_m: np.ndarray  # (N, 2) in the frame map
    r_m: np.ndarray  # (N,) equidistance: mean distance of the nearest obstacles
    sigma_r_m: np.ndarray  # (N,) uncertainty of r in the map
    kind: np.ndarray  # (N,) int8: MEETPOINT, DEAD_END, RING_MARKER

    def __len__(self) -> int:
        return len(self.r_m)


@dataclass(frozen=True)
class Edges:
    """Paths equidistant from two obstacles."""

    length_m: np.ndarray  # (E,) travelled
    chord_m: np.ndarray  # (E,) in a straight line
    sigma_m: np.ndarray  # (E,) uncertainty of both in the map
    clearance_m: np.ndarray  # (E,) distance of the obstacles where it is narrowest
    polyline_m: Ragged  # (E) rows of (n, 2) points in the frame map, as dart 2e runs; may be empty

    def __len__(self) -> int:
        return len(self.length_m)


@dataclass(frozen=True)
class Darts:
    """The two directions of each edge, each with one of the two feature maps of the document."""

    node: np.ndarray  # (D,) int: where it leaves
    bearing_rad: np.ndarray  # (D,) direction in which it leaves, in the frame map; see BEARING_AT_M
    segments_m: Ragged  # (D) rows of (n, 4) line segments x1 y1 x2 y2 in the frame map; may be empty

    def __len__(self) -> int:
        return len(self.node)


@dataclass(frozen=True)
class MapReference:
    """The map that an atlas was made from."""

    name: str
    sha256: str  # GridMap.fingerprint; empty: not known, every map is accepted
    free_space: Optional[FreeSpace] = None  # of the map; None: not known, only the very same map is accepted


@dataclass(frozen=True)
class Visits:
    """Measurements of robots so far: Welford's running count, mean and sum of squared deviations.

    And how often the detector missed a node lately: one more with each miss, halved by each visit.
    """

    node_count: np.ndarray  # (N,) int
    node_r_mean_m: np.ndarray  # (N,) 0 without a visit
    node_r_m2: np.ndarray  # (N,) [m^2]
    edge_count: np.ndarray  # (E,) int
    edge_length_mean_m: np.ndarray  # (E,)
    edge_length_m2: np.ndarray  # (E,) [m^2]
    node_missed: np.ndarray  # (N,) int

    @property
    def usually_missed(self) -> np.ndarray:
        """(N,) bool: nodes that robots pass without seeing them, as at a door that is shut for weeks."""
        return np.asarray(self.node_missed >= MIN_MISSES)

    @classmethod
    def none(cls, nodes: int, edges: int) -> "Visits":
        return cls(
            np.zeros(nodes, np.int64),
            np.zeros(nodes),
            np.zeros(nodes),
            np.zeros(edges, np.int64),
            np.zeros(edges),
            np.zeros(edges),
            np.zeros(nodes, np.int64),
        )

    def add_nodes(self, node: np.ndarray, r_m: np.ndarray) -> None:
        """Add equidistances measured at nodes (K,), in this order; NaN counts as a visit without a measurement."""
        _welford(self.node_count, self.node_r_mean_m, self.node_r_m2, node, r_m)
        for at in node.tolist():
            self.node_missed[at] //= 2

    def add_misses(self, node: np.ndarray) -> None:
        """Nodes (K,) that robots passed without seeing them."""
        np.add.at(self.node_missed, node, 1)

    def add_edges(self, edge: np.ndarray, length_m: np.ndarray) -> None:
        """Add lengths travelled along edges (K,), in this order."""
        _welford(self.edge_count, self.edge_length_mean_m, self.edge_length_m2, edge, length_m)


def _welford(count: np.ndarray, mean: np.ndarray, m2: np.ndarray, index: np.ndarray, value: np.ndarray) -> None:
    for at, given in zip(index.tolist(), value.tolist()):  # few per run; one index may occur twice
        count[at] += 1
        off = given - mean[at]
        mean[at] += off / count[at]
        m2[at] += off * (given - mean[at])


@dataclass(frozen=True)
class Atlas:
    """Nodes, edges and darts of one floor, or of several components that do not touch.

    Checked when it is made: an Atlas keeps all rules.
    """

    name: str
    source: MapReference
    nodes: Nodes
    edges: Edges
    darts: Darts
    rings: Ragged  # (N) rows of darts in clockwise order; values (D,) int
    visits: Visits

    def __post_init__(self) -> None:
        _refuse_bad_nodes(self.nodes)
        _refuse_bad_edges(self.edges)
        _refuse_bad_darts(self.darts, len(self.nodes), len(self.edges))
        _refuse_bad_rings(self.rings, self.darts, len(self.nodes))
        _refuse_bad_kinds(self.nodes, self.degree)
        _refuse_bad_order(self.rings, self.darts, self.degree)
        _refuse_bad_polylines(self)
        _refuse_bad_visits(self.visits, len(self.nodes), len(self.edges))
        rank = np.empty(len(self.darts), np.int64)
        rank[self.rings.values] = np.arange(len(self.darts)) - np.repeat(self.rings.offsets[:-1], self.degree)
        object.__setattr__(self, "_rank", rank)

    @property
    def degree(self) -> np.ndarray:
        """(N,) number of darts."""
        return np.diff(self.rings.offsets)

    @property
    def rank(self) -> np.ndarray:
        """(D,) place of each dart in the ring of its node, from 0."""
        return self._rank  # type: ignore[attr-defined, no-any-return]

    def clockwise(self, dart: np.ndarray, steps: np.ndarray) -> np.ndarray:
        """(...) darts that number of steps clockwise of darts (...) at the same node."""
        node = self.darts.node[dart]
        start = self.rings.offsets[node]
        degree = self.rings.offsets[node + 1] - start
        return self.rings.values[start + (self._rank[dart] + steps) % degree]  # type: ignore[attr-defined, no-any-return]

    def map_from_dart(self, dart: np.ndarray) -> np.ndarray:
        """(..., 3) poses in the frame map of a robot at the dart's node that looks along the dart."""
        position = self.nodes.position_m[self.darts.node[dart]]
        return np.concatenate([position, self.darts.bearing_rad[dart][..., None]], axis=-1)

    def check_map(self, grid_map: GridMap, what: str) -> str:
        """Whether a map is the one that the atlas was made from.

        Args:
            grid_map: it.
            what: for people, as "that of topic /map".

        Returns:
            A warning where a few cells differ, else "".

        Raises:
            AtlasError: it is another map.
        """
        source = self.source
        if source.sha256 in ("", grid_map.fingerprint):
            return ""
        name = source.name or "one without a name"
        differing = None if source.free_space is None else source.free_space.cells_that_differ(grid_map)
        if source.free_space is None or differing is None:
            how = f"with sha256 {source.sha256[:12]}..., got {grid_map.fingerprint[:12]}..."
            raise AtlasError(f"was made from another map than {what}: from {name} {how}")
        cells = f"{differing} of {source.free_space.free_cells} free cells"
        if differing > MAX_DIFFERING_SHARE * source.free_space.free_cells:
            raise AtlasError(f"was made from another map than {what}: from {name}, which differs in {cells}")
        return f"was made from {name}, which differs from {what} in {cells}" if differing else ""

    def components(self) -> Tuple[int, np.ndarray]:
        """How many parts do not touch, and (N,) in which of them each node lies."""
        return components.connected(len(self.nodes), self.darts.node[0::2], self.darts.node[1::2])


def twin(dart: np.ndarray) -> np.ndarray:
    """(...) the darts of the same edges in the other direction."""
    return dart ^ 1


def rings_clockwise(dart_node: np.ndarray, bearing_rad: np.ndarray, node_count: int) -> Ragged:
    """The rings that bearings give: darts of each node, clockwise by bearing.

    Args:
        dart_node: (D,) node that each dart leaves.
        bearing_rad: (D,) its direction in the frame map.
        node_count: N.
    """
    order = np.lexsort((-np.mod(bearing_rad, 2.0 * np.pi), dart_node))
    degree = np.bincount(dart_node, minlength=node_count)
    return Ragged(order, np.concatenate([[0], np.cumsum(degree)]).astype(np.int64))


# -- the rules, each with its own line


def _first(bad: np.ndarray) -> int:
    """Index of the first True, -1 if there is none."""
    return int(np.argmax(bad)) if bad.any() else -1


def _refuse(who: str, bad: np.ndarray, given: np.ndarray, allowed: str) -> None:
    """Raise AtlasError for the first bad row, if there is one."""
    at = _first(bad)
    if at >= 0:
        raise AtlasError(f"{who} {at}: {allowed}, got {np.asarray(given)[at].tolist()}")


def _positive(value: np.ndarray) -> np.ndarray:
    return np.isfinite(value) & (np.nan_to_num(value) > 0.0)


def _not_negative(value: np.ndarray) -> np.ndarray:
    return np.isfinite(value) & (np.nan_to_num(value) >= 0.0)


def _refuse_bad_nodes(nodes: Nodes) -> None:
    count = len(nodes)
    if not count:
        raise AtlasError("an atlas needs at least one node, got none")
    for name, shape in (("position_m", (count, 2)), ("r_m", (count,)), ("sigma_r_m", (count,)), ("kind", (count,))):
        if getattr(nodes, name).shape != shape:
            raise AtlasError(f"{name} of {count} nodes must be {shape}, got {getattr(nodes, name).shape}")
    _refuse("node", ~np.isfinite(nodes.position_m).all(axis=1), nodes.position_m, "the position must be finite")
    _refuse("node", ~_positive(nodes.r_m), nodes.r_m, "r must be finite and > 0 m")
    _refuse("node", ~_positive(nodes.sigma_r_m), nodes.sigma_r_m, "sigma_r must be finite and > 0 m")
    unknown = (nodes.kind < 0) | (nodes.kind >= len(KINDS))
    _refuse("node", unknown, nodes.kind, f"the kind must be 0 to {len(KINDS) - 1}")


def _refuse_bad_edges(edges: Edges) -> None:
    count = len(edges)
    if not count:
        raise AtlasError("an atlas needs at least one edge, got none")
    for name in ("length_m", "chord_m", "sigma_m", "clearance_m"):
        if getattr(edges, name).shape != (count,):
            raise AtlasError(f"{name} of {count} edges must be ({count},), got {getattr(edges, name).shape}")
    _refuse("edge", ~_positive(edges.length_m), edges.length_m, "the length must be finite and > 0 m")
    _refuse("edge", ~_positive(edges.sigma_m), edges.sigma_m, "sigma must be finite and > 0 m")
    for name, value in (("chord", edges.chord_m), ("clearance", edges.clearance_m)):
        _refuse("edge", ~_not_negative(value), value, f"the {name} must be finite and >= 0 m")
    at = _first(edges.chord_m > edges.length_m + CHORD_SLACK_M)
    if at >= 0:
        raise AtlasError(
            f"edge {at}: the chord must not be longer than the edge, got chord {edges.chord_m[at]:g} m "
            f"and length {edges.length_m[at]:g} m"
        )


def _refuse_bad_darts(darts: Darts, nodes: int, edges: int) -> None:
    if darts.node.shape != (2 * edges,) or darts.bearing_rad.shape != (2 * edges,):
        raise AtlasError(
            f"{edges} edges have {2 * edges} darts, got {darts.node.shape[0]} nodes of darts and "
            f"{darts.bearing_rad.shape[0]} bearings"
        )
    at = _first((darts.node < 0) | (darts.node >= nodes))
    if at >= 0:
        raise AtlasError(
            f"edge {at // 2}: its {'to' if at % 2 else 'from'} must be a node 0 to {nodes - 1}, got {darts.node[at]}"
        )
    _refuse("dart", ~np.isfinite(darts.bearing_rad), darts.bearing_rad, "the bearing must be finite")
    darts.segments_m.refuse_bad_offsets("the segments of darts", 2 * edges)
    finite = np.isfinite(darts.segments_m.values).all()
    if darts.segments_m.values.shape[1:] != (4,) or not finite:
        raise AtlasError("segments of darts must be rows of x1 y1 x2 y2, all finite")


def _refuse_bad_rings(rings: Ragged, darts: Darts, nodes: int) -> None:
    """Check reciprocity: each dart is exactly once in the ring of the node that it leaves, and in no other ring."""
    rings.refuse_bad_offsets("the rings of nodes", nodes)
    at = _first(np.diff(rings.offsets) == 0)
    if at >= 0:
        raise AtlasError(f"node {at}: has no darts; no edge leads there")
    at = _first((rings.values < 0) | (rings.values >= len(darts)))
    if at >= 0:
        raise AtlasError(f"node {_row(rings, at)}: there is no dart {rings.values[at]}, allowed 0 to {len(darts) - 1}")
    where = np.repeat(np.arange(nodes), np.diff(rings.offsets))
    listed = np.bincount(rings.values, minlength=len(darts))
    at = _first(listed > 1)
    if at >= 0:
        raise AtlasError(f"node {darts.node[at]}: dart {at} is listed {listed[at]} times, each is once in one ring")
    at = _first(darts.node[rings.values] != where)
    if at >= 0:
        dart = int(rings.values[at])
        raise AtlasError(
            f"node {where[at]}: lists dart {dart}, but edge {dart // 2} says that it leaves node {darts.node[dart]}"
        )
    at = _first(listed == 0)
    if at >= 0:
        raise AtlasError(f"node {darts.node[at]}: edge {at // 2} leaves it, but its ring does not list dart {at}")


def _row(ragged: Ragged, position: int) -> int:
    return int(np.searchsorted(ragged.offsets, position, side="right")) - 1


def _refuse_bad_kinds(nodes: Nodes, degree: np.ndarray) -> None:
    for kind, allowed in ((DEAD_END, 1), (RING_MARKER, 2)):
        at = _first((nodes.kind == kind) & (degree != allowed))
        if at >= 0:
            raise AtlasError(f"node {at}: a {KINDS[kind]} has degree {allowed}, got {degree[at]}")


def _refuse_bad_order(rings: Ragged, darts: Darts, degree: np.ndarray) -> None:
    """Check cyclic order: one round of a ring is one turn clockwise."""
    bearing = darts.bearing_rad[rings.values]
    following = np.arange(1, len(bearing) + 1)
    following[rings.offsets[1:] - 1] = rings.offsets[:-1]
    gap = np.mod(bearing - bearing[following] + ORDER_SLACK_RAD, 2.0 * np.pi) - ORDER_SLACK_RAD
    turn = np.add.reduceat(gap, rings.offsets[:-1])
    at = _first((degree > 1) & (np.abs(turn - 2.0 * np.pi) > ORDER_SLACK_RAD * (degree + 1)))
    if at >= 0:
        raise AtlasError(
            f"node {at}: its darts are not in clockwise order, bearings "
            f"{', '.join(f'{angle:.3f}' for angle in darts.bearing_rad[rings[at]])} rad"
        )


def _refuse_bad_polylines(atlas: Atlas) -> None:
    lines = atlas.edges.polyline_m
    lines.refuse_bad_offsets("the polylines of edges", len(atlas.edges))
    if lines.values.shape[1:] != (2,) or not np.isfinite(lines.values).all():
        raise AtlasError("polylines of edges must be rows of x y, all finite")
    drawn = np.flatnonzero(np.diff(lines.offsets) > 0)
    for end, points in ((0, lines.values[lines.offsets[drawn]]), (1, lines.values[lines.offsets[drawn + 1] - 1])):
        node = atlas.darts.node[2 * drawn + end]
        off = np.linalg.norm(points - atlas.nodes.position_m[node], axis=1)
        at = _first(off > POLYLINE_SLACK_M)
        if at >= 0:
            raise AtlasError(
                f"edge {drawn[at]}: its line ends {off[at]:.2f} m from node {node[at]}, allowed {POLYLINE_SLACK_M:g} m"
            )


def _refuse_bad_visits(visits: Visits, nodes: int, edges: int) -> None:
    for what, count, mean, m2, rows in (
        ("node", visits.node_count, visits.node_r_mean_m, visits.node_r_m2, nodes),
        ("edge", visits.edge_count, visits.edge_length_mean_m, visits.edge_length_m2, edges),
    ):
        if not count.shape == mean.shape == m2.shape == (rows,):
            raise AtlasError(
                f"visits of {rows} {what}s need count, mean and m2 ({rows},), got {count.shape}, "
                f"{mean.shape} and {m2.shape}"
            )
        _refuse(f"visits of {what}", count < 0, count, "the count must be >= 0")
        _refuse(f"visits of {what}", ~_not_negative(mean), mean, "the mean must be finite and >= 0 m")
        _refuse(f"visits of {what}", ~_not_negative(m2), m2, "m2 must be finite and >= 0 m^2")
    if visits.node_missed.shape != (nodes,):
        raise AtlasError(f"visits of {nodes} nodes need missed ({nodes},), got {visits.node_missed.shape}")
    _refuse("visits of node", visits.node_missed < 0, visits.node_missed, "missed must be >= 0")
