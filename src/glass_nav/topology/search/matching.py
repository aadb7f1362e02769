"""Tests whether a node or an edge of the atlas matches what was observed.

Each test compares one number: the difference between atlas and observation with z times its standard deviation. z
follows from a risk budget for a whole run, because a probability that is small for one test is not small for a
hundred. C candidates; a candidate at a meetpoint is the dart that matches its reference edge.

Seed document global_localization_procedure.txt, "Updating the Search Forest", which does not define when values
match.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Dict, List, Optional, Tuple

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.topology.atlas.atlas import Atlas, twin
from glass_nav.topology.atlas.edge_views import poses_along
from glass_nav.topology.observations import Meetpoint, Traversal
from glass_nav.topology.search import edge_segments
from glass_nav.topology.search.edge_segments import Reach, SegmentTest

_MAX_COMPARED = 100  # candidates whose walls are compared: some milliseconds each
_VIEW_STEP_M = 0.5  # between viewpoints along an edge
_REMEMBERED = 64  # traversals whose comparisons are kept
_TESTS_PER_EDGE = 7  # length, chord, its direction, turn; then r and two angles between edges of the node


@dataclass(frozen=True)
class Tolerances:
    """Measurement errors of the robot, where its reports do not state them, and the risk that is accepted."""

    risk: float = 0.001  # probability of ruling out the truth in a run by normally distributed errors
    risk_edges: int = 30  # edges of such a run
    r_sigma_m: float = 0.05  # of an equidistance
    length_sigma_m: float = 0.1  # of a length: constant part, ...
    length_sigma_share: float = 0.02  # ... and per metre
    bearing_sigma_rad: float = 0.1  # of the direction of an edge
    turn_sigma_rad: float = 0.1  # of dead reckoning's heading over an edge

    def __post_init__(self) -> None:
        if not 0.0 < self.risk < 1.0:
            raise ValueError(f"~risk must be in (0, 1), got {self.risk}")
        if self.risk_edges < 1:
            raise ValueError(f"~risk_edges must be >= 1, got {self.risk_edges}")
        for name in ("r_sigma_m", "length_sigma_m", "bearing_sigma_rad", "turn_sigma_rad"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise ValueError(f"~{name} must be finite and > 0, got {getattr(self, name)}")
        if not (math.isfinite(self.length_sigma_share) and self.length_sigma_share >= 0.0):
            raise ValueError(f"~length_sigma_share must be finite and >= 0, got {self.length_sigma_share}")

    @property
    def z(self) -> float:
        """Largest difference, in standard deviations: two-sided, the risk shared by all tests of the run."""
        from scipy.special import ndtri  # slow to import

        return float(-ndtri(self.risk / (2.0 * _TESTS_PER_EDGE * self.risk_edges)))

    def sigma_length_m(self, length_m: np.ndarray) -> np.ndarray:
        """(...) of lengths travelled."""
        return self.length_sigma_m + self.length_sigma_share * length_m


class Matcher:
    """The tests of one atlas, with what they need of it by dart."""

    def __init__(
        self,
        atlas: Atlas,
        tolerances: Tolerances,
        use_angles: bool,
        segments: Optional[SegmentTest] = None,
    ) -> None:
        """
        Args:
            atlas: with the segments of its darts, if these are to be compared.
            tolerances: of the tests on numbers.
            use_angles: whether directions of edges are evidence.
            segments: the test of walls seen along an edge; None: they are not evidence.
        """
        self.atlas = atlas
        self._segments = segments if segments is not None and segments.match_segments else None
        self._compared: Dict[int, Tuple[Traversal, Dict[int, bool]]] = {}  # by identity of the traversal
        self.tolerances = tolerances
        self.use_angles = use_angles
        self.z = tolerances.z
        ring, count = atlas.rings, len(atlas.darts)
        following = np.arange(1, count + 1)
        following[ring.offsets[1:] - 1] = ring.offsets[:-1]
        self._next = np.empty(count, np.int32)  # clockwise; int32 and float32: a million nodes are gathered at random
        self._next[ring.values] = ring.values[following]
        self._before = np.empty(count, np.int32)
        self._before[self._next] = np.arange(count, dtype=np.int32)
        self._degree = atlas.degree.astype(np.int32)
        self.length_m = atlas.edges.length_m.astype(np.float32)
        self._by_degree_r = np.lexsort((atlas.nodes.r_m, self._degree))  # (N,) nodes
        self._max_sigma_r = float(atlas.nodes.sigma_r_m.max())
        self._r_sorted = atlas.nodes.r_m[self._by_degree_r]
        self._degree_sorted = self._degree[self._by_degree_r]

    def departures(self, dart: np.ndarray, rank: int) -> np.ndarray:
        """(C,) darts by which a robot leaves if it takes this rank at reference darts (C,).

        All nodes must have the degree of one meetpoint, above the rank.
        """
        if not len(dart):
            return dart
        degree = int(self._degree[self.atlas.darts.node[dart[0]]])
        steps, table = (rank, self._next) if 2 * rank <= degree else (degree - rank, self._before)
        for _ in range(steps):
            dart = table[dart]
        return dart.astype(np.int64)

    def ring_from(self, dart: int) -> List[int]:
        """The darts at its node by rank: the dart itself, then clockwise."""
        found = [dart]
        while self._next[found[-1]] != dart:
            found.append(int(self._next[found[-1]]))
        return found

    def others(self, dart: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """All other darts (K,) at the nodes of darts (C,), and the index (K,) of the given dart at the same node."""
        beside = np.arange(len(dart))
        found, of = [], []
        step = self._next[dart]
        while len(beside):
            more = step != dart[beside]
            beside, step = beside[more], step[more]
            found.append(step.astype(np.int64))
            of.append(beside)
            step = self._next[step]
        return (np.concatenate(found), np.concatenate(of)) if found else (dart, beside)

    # -- nodes

    def all_at(self, meetpoint: Meetpoint) -> np.ndarray:
        """(C,) all darts of the atlas that match the reference edge of a meetpoint."""
        window = self.z * math.hypot(self.sigma_r_m(meetpoint), self._max_sigma_r)
        first, last = np.searchsorted(self._degree_sorted, [meetpoint.degree, meetpoint.degree + 1])
        r = self._r_sorted[first:last]
        low, high = first + np.searchsorted(r, [meetpoint.r_m - window, meetpoint.r_m + window + 1e-9])
        node = self._by_degree_r[low:high]
        node = node[self._r_fits(node, meetpoint)]
        start = self.atlas.rings.offsets[node]
        dart = self.atlas.rings.values[(start[:, None] + np.arange(meetpoint.degree)).ravel()]
        return np.sort(dart[self._angles_fit(dart, meetpoint)])

    def at(self, dart: np.ndarray, meetpoint: Meetpoint) -> np.ndarray:
        """(C,) bool: darts (C,) match the reference edge of the meetpoint."""
        node = self.atlas.darts.node[dart]
        fits = self._degree[node] == meetpoint.degree
        fits[fits] = self._r_fits(node[fits], meetpoint)
        fits[fits] = self._angles_fit(dart[fits], meetpoint)
        return fits

    @property
    def some_usually_missed(self) -> bool:
        """Whether the atlas has nodes that robots usually miss."""
        return bool(self.atlas.visits.usually_missed.any())

    def log_likelihood_at(self, dart: np.ndarray, meetpoint: Meetpoint) -> np.ndarray:
        """(C,) log density of the meetpoint if its reference edge is one of darts (C,) that match, up to a constant."""
        nodes, node = self.atlas.nodes, self.atlas.darts.node[dart]
        sigma = np.hypot(self.sigma_r_m(meetpoint), nodes.sigma_r_m[node])
        log_p = -0.5 * ((nodes.r_m[node] - meetpoint.r_m) / sigma) ** 2 - np.log(sigma)
        if self.use_angles and len(meetpoint.bearings_rad):
            variance = 2.0 * self.tolerances.bearing_sigma_rad**2
            bearing, other = self.atlas.darts.bearing_rad, dart
            for gap in meetpoint.gaps_rad[1:]:
                other = self._next[other]
                log_p -= 0.5 * angles.wrap(bearing[dart] - bearing[other] - gap) ** 2 / variance
        return log_p

    def sigma_r_m(self, meetpoint: Optional[Meetpoint] = None) -> float:
        """Standard deviation of a measured equidistance, without the uncertainty of the atlas."""
        return (meetpoint.sigma_r_m if meetpoint else 0.0) or self.tolerances.r_sigma_m

    def _r_fits(self, node: np.ndarray, meetpoint: Meetpoint) -> np.ndarray:
        nodes = self.atlas.nodes
        sigma = np.hypot(self.sigma_r_m(meetpoint), nodes.sigma_r_m[node])
        return np.abs(nodes.r_m[node] - meetpoint.r_m) <= self.z * sigma

    def _angles_fit(self, dart: np.ndarray, meetpoint: Meetpoint) -> np.ndarray:
        fits = np.ones(len(dart), bool)
        if not self.use_angles or not len(meetpoint.bearings_rad):
            return fits
        allowed = self.z * math.sqrt(2.0) * self.tolerances.bearing_sigma_rad
        bearing = self.atlas.darts.bearing_rad
        other = dart
        for gap in meetpoint.gaps_rad[1:]:
            other = self._next[other]
            fits &= np.abs(angles.wrap(bearing[dart] - bearing[other] - gap)) <= allowed
        return fits

    # -- paths: one edge, or several that a missed meetpoint joins

    def sigma_length_m(self, traversal: Traversal) -> float:
        """Of a measured length, without the uncertainty of the atlas."""
        return traversal.sigma_length_m or float(self.tolerances.sigma_length_m(np.array(traversal.length_m)))

    def sigma_chord_m(self, traversal: Traversal) -> float:
        """Standard deviation of a measured chord, without the uncertainty of the atlas."""
        return traversal.sigma_chord_m or float(self.tolerances.sigma_length_m(np.array(traversal.length_m)))

    def longest_m(self, traversal: Traversal, edges: int = 1) -> float:
        """Upper bound of the length of a path of that number of edges that matches."""
        sigma = math.hypot(self.sigma_length_m(traversal), math.sqrt(edges) * float(self.atlas.edges.sigma_m.max()))
        return traversal.length_m + self.z * sigma

    def may_contain(self, dart: np.ndarray, traversal: Traversal) -> np.ndarray:
        """(C,) bool: the edges of darts (C,) are at least as long as the distance travelled, within tolerance."""
        edge = dart >> 1
        sigma = np.hypot(self.sigma_length_m(traversal), self.atlas.edges.sigma_m[edge])
        return self.atlas.edges.length_m[edge] >= traversal.length_m - self.z * sigma

    def edges_along(self, departure: np.ndarray, traversal: Traversal) -> np.ndarray:
        """(K,) the darts (C,) that lead along an edge that matches."""
        edges = self.atlas.edges
        longest = self.longest_m(traversal)  # a coarse window first, which reads little memory
        length = self.length_m[departure >> 1]
        kept = np.flatnonzero((length <= longest + 1e-3) & (length >= 2.0 * traversal.length_m - longest - 1e-3))
        departure = departure[kept]
        edge = departure >> 1
        fits = np.abs(edges.length_m[edge] - traversal.length_m) <= self.z * np.hypot(
            self.sigma_length_m(traversal), edges.sigma_m[edge]
        )
        if not math.isnan(traversal.chord_m):
            fits &= np.abs(edges.chord_m[edge] - traversal.chord_m) <= self.z * np.hypot(
                self.sigma_chord_m(traversal), edges.sigma_m[edge]
            )
        fits[fits] = self._directions_fit(departure[fits], twin(departure[fits]), edges.sigma_m[edge[fits]], traversal)
        fits[fits] = self._segments_fit(departure[fits], traversal)
        return kept[fits]

    def directions_fit(self, departure: np.ndarray, traversal: Traversal) -> np.ndarray:
        """(C,) bool: the directions of the edges of darts (C,) match those driven."""
        return self._directions_fit(departure, twin(departure), self.atlas.edges.sigma_m[departure >> 1], traversal)

    def _segments_fit(self, departure: np.ndarray, traversal: Traversal) -> np.ndarray:
        """(C,) bool: the walls seen are compatible with those along darts (C,); all True for too many darts."""
        if self._segments is None or not len(traversal.segments_m) or len(departure) > _MAX_COMPARED:
            return np.ones(len(departure), bool)
        if id(traversal) not in self._compared and len(self._compared) >= _REMEMBERED:
            self._compared.clear()
        _, known = self._compared.setdefault(id(traversal), (traversal, {}))
        for dart in departure.tolist():
            if dart not in known:
                known[dart] = edge_segments.matches(*self.contradiction(dart, traversal), self._segments)
        return np.array([known[dart] for dart in departure.tolist()], bool)

    def contradiction(self, dart: int, traversal: Traversal) -> Tuple[float, float]:
        """Share and metres of the walls seen that stand in free space if a dart's edge was driven."""
        seen = self.atlas.darts.segments_m[dart]
        dart_from_map = se2.inverse(self.atlas.map_from_dart(np.array(dart)))
        line = self.atlas.edges.polyline_m[dart >> 1]
        if len(line) < 2:
            line = self.atlas.nodes.position_m[self.atlas.darts.node[[dart & ~1, dart | 1]]]
        path = poses_along(line, _VIEW_STEP_M)[:, :2]
        limits = self.tolerances
        reach = Reach(
            self.z * math.hypot(limits.length_sigma_m, limits.r_sigma_m),
            self.z * limits.bearing_sigma_rad,
            self.z,
            limits.length_sigma_share,
        )
        return edge_segments.contradiction(
            traversal.segments_m,
            se2.transform_points(dart_from_map, seen.reshape(-1, 2)).reshape(-1, 4),
            se2.transform_points(dart_from_map, path),
            reach,
        )

    def paths_along(
        self,
        departure: np.ndarray,
        arrival: np.ndarray,
        length_m: np.ndarray,
        sigma_m: np.ndarray,
        traversal: Traversal,
    ) -> np.ndarray:
        """(C,) bool: paths of several edges match.

        Args:
            departure: (C,) first darts.
            arrival: (C,) darts at their ends, which lead back.
            length_m: (C,) of all edges together.
            sigma_m: (C,) of the atlas, for all edges together.
            traversal: what was travelled.
        """
        fits = np.abs(length_m - traversal.length_m) <= self.z * np.hypot(self.sigma_length_m(traversal), sigma_m)
        if not math.isnan(traversal.chord_m):
            chord = np.linalg.norm(self._displacement_m(departure[fits], arrival[fits]), axis=-1)
            fits[fits] = np.abs(chord - traversal.chord_m) <= self.z * np.hypot(
                self.sigma_chord_m(traversal), sigma_m[fits]
            )
        fits[fits] = self._directions_fit(departure[fits], arrival[fits], sigma_m[fits], traversal)
        return fits

    def _displacement_m(self, departure: np.ndarray, arrival: np.ndarray) -> np.ndarray:
        position, node = self.atlas.nodes.position_m, self.atlas.darts.node
        return position[node[arrival]] - position[node[departure]]

    def _directions_fit(
        self, departure: np.ndarray, arrival: np.ndarray, sigma_m: np.ndarray, traversal: Traversal
    ) -> np.ndarray:
        fits = np.ones(len(departure), bool)
        if not self.use_angles:
            return fits
        limits = self.tolerances
        bearing = self.atlas.darts.bearing_rad
        if not math.isnan(traversal.turn_rad):
            turned = bearing[arrival] + np.pi - bearing[departure]
            allowed = self.z * math.hypot(math.sqrt(2.0) * limits.bearing_sigma_rad, limits.turn_sigma_rad)
            fits &= np.abs(angles.wrap(turned - traversal.turn_rad)) <= allowed
        if not math.isnan(traversal.chord_bearing_rad):
            step = self._displacement_m(departure, arrival)
            chord = np.linalg.norm(step, axis=-1)
            ahead = np.arctan2(step[:, 1], step[:, 0]) - bearing[departure]
            off_m = self.z * np.hypot(self.sigma_chord_m(traversal), sigma_m)
            across = np.arcsin(
                np.minimum(off_m / np.maximum(chord, 1e-9), 1.0)
            )  # close to the start every direction is possible
            allowed_each = self.z * math.hypot(limits.bearing_sigma_rad, limits.turn_sigma_rad) + across
            fits &= (off_m >= chord) | (np.abs(angles.wrap(ahead - traversal.chord_bearing_rad)) <= allowed_each)
        return fits

    # -- what a turn would show: which candidates would remain?

    def alike_at(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """(...) bool: a robot at the first darts (...) that measures without error would not rule out the second."""
        nodes, node = self.atlas.nodes, self.atlas.darts.node
        a, b = node[first], node[second]
        alike = (self._degree[a] == self._degree[b]) & (
            np.abs(nodes.r_m[a] - nodes.r_m[b]) <= self.z * np.hypot(self.tolerances.r_sigma_m, nodes.sigma_r_m[b])
        )
        if self.use_angles:
            alike &= self._rings_alike(first, second)
        return alike

    def _rings_alike(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        bearing = self.atlas.darts.bearing_rad
        allowed = self.z * math.sqrt(2.0) * self.tolerances.bearing_sigma_rad
        alike = np.ones(np.broadcast(first, second).shape, bool)
        most = int(self._degree[self.atlas.darts.node[first]].max()) if first.size else 0
        a, b = first, second
        for _ in range(most - 1):
            a, b = self._next[a], self._next[b]
            off = (bearing[first] - bearing[a]) - (bearing[second] - bearing[b])
            alike &= np.abs(angles.wrap(off)) <= allowed
        return alike

    def alike_along(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """(...) bool: a robot that leaves by the first darts (...) and measures without error would not rule out at the
        next meetpoint that it left by the second.
        """
        edges, limits = self.atlas.edges, self.tolerances
        a, b = first >> 1, second >> 1
        sigma = np.hypot(limits.sigma_length_m(edges.length_m[a]), edges.sigma_m[b])
        alike = (np.abs(edges.length_m[a] - edges.length_m[b]) <= self.z * sigma) & (
            np.abs(edges.chord_m[a] - edges.chord_m[b]) <= self.z * sigma
        )
        if self.use_angles:
            alike &= self._courses_alike(first, second, self.z * sigma)
        return alike & self.alike_at(twin(first), twin(second))

    def _courses_alike(self, first: np.ndarray, second: np.ndarray, off_m: np.ndarray) -> np.ndarray:
        limits, bearing = self.tolerances, self.atlas.darts.bearing_rad
        turned = (bearing[twin(first)] - bearing[first]) - (bearing[twin(second)] - bearing[second])
        allowed = self.z * math.hypot(math.sqrt(2.0) * limits.bearing_sigma_rad, limits.turn_sigma_rad)
        a, b = self._displacement_m(first, twin(first)), self._displacement_m(second, twin(second))
        chord = np.hypot(b[..., 0], b[..., 1])
        across = np.arcsin(np.minimum(off_m / np.maximum(chord, 1e-9), 1.0))
        ahead = (np.arctan2(a[..., 1], a[..., 0]) - bearing[first]) - (
            np.arctan2(b[..., 1], b[..., 0]) - bearing[second]
        )
        allowed_ahead = self.z * math.hypot(limits.bearing_sigma_rad, limits.turn_sigma_rad) + across
        return (np.abs(angles.wrap(turned)) <= allowed) & (
            (off_m >= chord) | (np.abs(angles.wrap(ahead)) <= allowed_ahead)
        )


def poses_at(atlas: Atlas, dart: np.ndarray, meetpoint: Meetpoint) -> np.ndarray:
    """(C, 3) poses in the frame map of a robot whose reference edges are darts (C,)."""
    back = float(meetpoint.bearings_rad[0]) if len(meetpoint.bearings_rad) else np.pi
    base_from_dart = np.array([*meetpoint.centre_m, back])
    return se2.compose(atlas.map_from_dart(dart), se2.inverse(base_from_dart))
