"""A simulated robot in an atlas, without coordinates: reports meetpoints and edges, and takes the chosen turns.

It measures what the atlas says (lengths, chords, equidistances, angles) by dead reckoning, with normally distributed
errors. Detection errors join and split edges. For a robot outside the atlas, the parts of the atlas are shuffled.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Optional, Tuple

import numpy as np

from glass_nav.geometry import angles
from glass_nav.topology.atlas.atlas import Atlas, twin
from glass_nav.topology.observations import Meetpoint, Traversal
from glass_nav.topology.search.matching import Tolerances

_SPURIOUS_DEAD_ENDS = 0.2  # share of the spurious meetpoints: something stood in the way


@dataclass(frozen=True)
class TrialParams:
    """A robot and its errors."""

    noise: Tolerances = field(default_factory=Tolerances)  # standard deviations of its measurements
    noise_gain: float = 1.0  # times that
    noise_limit: float = math.inf  # largest error, in standard deviations
    missed: float = 0.0  # probability of driving past a meetpoint
    spurious: float = 0.0  # probability of a spurious meetpoint on an edge
    angles: bool = True  # it measures directions, too
    max_edges: int = 100  # then it gives up

    def __post_init__(self) -> None:
        for name in ("missed", "spurious"):
            if not 0.0 <= getattr(self, name) < 1.0:
                raise ValueError(f"{name} must be in [0, 1), got {getattr(self, name)}")
        for name in ("noise_gain", "noise_limit"):
            if not getattr(self, name) >= 0.0:
                raise ValueError(f"{name} must be >= 0, got {getattr(self, name)}")
        if self.max_edges < 1:
            raise ValueError(f"max_edges must be >= 1, got {self.max_edges}")


@dataclass(frozen=True)
class Surroundings:
    """The quantities that can be measured; nodes, edges and darts as in the atlas."""

    atlas: Atlas  # for its topology
    r_m: np.ndarray  # (N,)
    length_m: np.ndarray  # (E,)
    chord_m: np.ndarray  # (E,)
    chord_bearing_rad: np.ndarray  # (D,) counterclockwise from the direction in which the dart leaves
    turn_rad: np.ndarray  # (D,) from that direction to the one of arrival
    gap_rad: np.ndarray  # (D,) from the dart that is first in the ring, clockwise

    @classmethod
    def of(cls, atlas: Atlas) -> "Surroundings":
        """The surroundings of a robot in the atlas."""
        darts, position = atlas.darts, atlas.nodes.position_m
        there = twin(np.arange(len(darts)))
        step = position[darts.node[there]] - position[darts.node]
        ahead = angles.wrap(np.arctan2(step[:, 1], step[:, 0]) - darts.bearing_rad)
        turn = angles.wrap(darts.bearing_rad[there] + np.pi - darts.bearing_rad)
        first = atlas.rings.values[atlas.rings.offsets[darts.node]]
        gap = np.mod(darts.bearing_rad[first] - darts.bearing_rad, 2.0 * np.pi)
        return cls(atlas, atlas.nodes.r_m, atlas.edges.length_m, atlas.edges.chord_m, ahead, turn, gap)

    def shuffled(self, rng: np.random.Generator) -> "Surroundings":
        """The same nodes and edges shuffled: each takes the place of another one, nodes of the same degree."""
        degree = self.atlas.degree
        node = np.arange(len(degree))
        for same in np.unique(degree):
            node[degree == same] = rng.permutation(np.flatnonzero(degree == same))
        edge = rng.permutation(len(self.length_m))
        dart = (2 * edge[:, None] + [0, 1]).ravel()
        ring = self.atlas.rings
        place = np.repeat(ring.offsets[node], degree) + np.arange(len(dart)) - np.repeat(ring.offsets[:-1], degree)
        gap = np.empty(len(dart))
        gap[ring.values] = self.gap_rad[ring.values[place]]
        return Surroundings(
            self.atlas,
            self.r_m[node],
            self.length_m[edge],
            self.chord_m[edge],
            self.chord_bearing_rad[dart],
            self.turn_rad[dart],
            gap,
        )


class AtlasRobot:
    """A robot that follows edges; its true place is at the node of `dart`, along which it came, or on an edge."""

    def __init__(self, world: Surroundings, p: TrialParams, rng: np.random.Generator) -> None:
        self._world, self._p, self._rng = world, p, rng
        self.dart = 0  # reference dart at a node; on an edge the dart of the edge, as it was driven
        self.on_edge = 0.0  # share of the edge that it has driven, 0 at a node
        self.detection_errors = 0  # so far

    def wake_up(self, dart: Optional[int] = None) -> Meetpoint:
        """Wake up with a dart as the reference edge; without one, at any dart of the atlas."""
        self.dart = int(self._rng.integers(len(self._world.chord_bearing_rad))) if dart is None else dart
        self.on_edge = 0.0
        return self._at_node()

    def drive(self, rank: int) -> Tuple[Traversal, Meetpoint]:
        """Leave by an edge and follow it to what looks like the next meetpoint."""
        world = self._world
        here, length = np.zeros(3), 0.0  # pose where it left, x along the edge
        if self.on_edge:  # at a spurious meetpoint every edge but the one back leads on
            along, begun = self.dart, self.on_edge
            if rank == 0:
                along, begun = self.dart ^ 1, 1.0 - self.on_edge
            here[2] = -world.chord_bearing_rad[along]
        else:
            along, begun = int(world.atlas.clockwise(np.array(self.dart), np.array(rank))), 0.0
        while True:
            edge = along >> 1
            until = 1.0
            if self._rng.random() < self._p.spurious:
                until = begun + (1.0 - begun) * float(self._rng.uniform(0.15, 0.85))
                self.detection_errors += 1
            length += (until - begun) * float(world.length_m[edge])
            chord = (until - begun) * world.chord_m[edge]
            ahead = here[2] + world.chord_bearing_rad[along]
            here = np.array(
                [
                    here[0] + chord * math.cos(ahead),
                    here[1] + chord * math.sin(ahead),
                    ahead if until < 1.0 else here[2] + world.turn_rad[along],
                ]
            )
            if until < 1.0:
                self.dart, self.on_edge = along, until
                return self._measured(rank, length, here), self._nothing_there()
            arrival = along ^ 1
            degree = int(world.atlas.degree[world.atlas.darts.node[arrival]])
            if degree == 1 or not self._rng.random() < self._p.missed:
                self.dart, self.on_edge = arrival, 0.0
                return self._measured(rank, length, here), self._at_node()
            self.detection_errors += 1
            along, begun = int(world.atlas.clockwise(np.array(arrival), np.array(self._rng.integers(1, degree)))), 0.0
            here[2] += np.pi + world.gap_rad[arrival] - world.gap_rad[along]

    def _noise(self, sigma: float) -> float:
        limit = self._p.noise_limit
        return float(np.clip(self._rng.normal(), -limit, limit)) * self._p.noise_gain * sigma

    def _measured(self, rank: int, length_m: float, here: np.ndarray) -> Traversal:
        noise = self._p.noise
        sigma = float(noise.sigma_length_m(np.array(length_m)))
        chord = float(np.hypot(here[0], here[1]))
        length_m, chord = max(length_m + self._noise(sigma), 1e-3), max(chord + self._noise(sigma), 0.0)
        if not self._p.angles:
            return Traversal(rank, length_m, chord)
        blur = math.hypot(noise.bearing_sigma_rad, noise.turn_sigma_rad)
        return Traversal(
            rank,
            length_m,
            chord,
            chord_bearing_rad=math.atan2(here[1], here[0]) + self._noise(blur),
            turn_rad=float(angles.wrap(here[2] + self._noise(blur))),
        )

    def _at_node(self) -> Meetpoint:
        atlas = self._world.atlas
        node = int(atlas.darts.node[self.dart])
        degree = int(atlas.degree[node])
        ring = atlas.clockwise(np.full(degree, self.dart), np.arange(degree))
        gap = np.mod(self._world.gap_rad[ring] - self._world.gap_rad[self.dart], 2.0 * np.pi)
        gap[1:] += [self._noise(self._p.noise.bearing_sigma_rad) for _ in range(degree - 1)]
        return self._reported(degree, float(self._world.r_m[node]), gap)

    def _nothing_there(self) -> Meetpoint:
        """A spurious meetpoint: the edge ahead, and a branch to the left or to the right."""
        r = float(self._rng.choice(self._world.r_m))
        if self._rng.random() < _SPURIOUS_DEAD_ENDS:
            return self._reported(1, r, np.zeros(1))
        left = self._rng.random() < 0.5
        return self._reported(3, r, np.array([0.0, 0.5 if left else 1.0, 1.0 if left else 1.5]) * np.pi)

    def _reported(self, degree: int, r_m: float, gap_rad: np.ndarray) -> Meetpoint:
        r = max(r_m + self._noise(self._p.noise.r_sigma_m), 1e-3)
        if not self._p.angles:
            return Meetpoint(degree, r)
        in_order = np.clip(np.maximum.accumulate(gap_rad), 0.0, 2.0 * np.pi - 1e-6)
        return Meetpoint(degree, r, bearings_rad=np.pi - in_order)
