"""The search forest: which darts of the atlas are still possible after the observations.

The document's forest has a row of search nodes for each depth; a search node is a node of the atlas with the search
edge that leads there. Here a candidate is that edge's dart at the node, the arrival dart, which identifies both. A
turn maps darts one to one, so a row never has more candidates than the atlas has darts, and no dart twice. Rows keep
active candidates only; the parents of a candidate, and what was ruled out, follow from the row before
(forest_explanation.py prints them). In the row of depth 0 there is no arrival dart: any dart of a node that matches may
be the reference edge.

Beyond the document, the detector may fail: it misses a meetpoint, which joins two edges to one, or reports a spurious
one, which splits an edge. A row is kept for each number of detection errors, and rows with errors are computed only
when no candidate without errors is left. Rules for the row of depth d with e errors:

* an edge from the row of d - 1 with e;
* two edges joined from the row of d - 1 with e - 1, three from that with e - 2;
* an edge from the row of d - 2 with e - 1, as long as both traversals, if the meetpoint of d - 1 was spurious; from
  the row of d - 3 with e - 2 if two were spurious;
* the node it came from, if it turned round at a spurious meetpoint (a spurious dead end);
* anywhere, if all meetpoints before this one were spurious: e = d, after an edge at least as long as the distance
  travelled; with one more error a meetpoint may have been missed on it.

A meetpoint that robots usually miss (Visits.usually_missed), as at a door that is shut for weeks, joins edges without
an error; a robot that sees it nevertheless finds it in its place.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Dict, List, Optional, Tuple

import numpy as np

from glass_nav.topology.atlas.atlas import twin
from glass_nav.topology.observations import UNKNOWN, Meetpoint, Traversal, refuse_rank
from glass_nav.topology.search.matching import Matcher

NO_PARENT = -1
_USUALLY_MISSED = 3  # on one traversal, at most


@dataclass(frozen=True)
class Row:
    """Active candidates of one depth with one number of errors, by ascending dart. Parents may be in earlier rows."""

    dart: np.ndarray  # (C,) arrival darts; at depth 0 reference darts
    parent: np.ndarray  # (C,) index in the parent's row, NO_PARENT where a search begins
    parent_depth: np.ndarray  # (C,)
    parent_errors: np.ndarray  # (C,)

    def __len__(self) -> int:
        return len(self.dart)


@dataclass
class _Found:
    """Parts of a row that is being built."""

    darts: List[np.ndarray] = field(default_factory=list)
    parents: List[np.ndarray] = field(default_factory=list)
    origins: List[Tuple[int, int]] = field(default_factory=list)  # depth and errors of the parents of each part

    def add(self, dart: np.ndarray, parent: np.ndarray, depth: int, errors: int) -> None:
        self.darts.append(dart)
        self.parents.append(parent)
        self.origins.append((depth, errors))

    def row(self, ruled_out: List[Row]) -> Row:
        """Each dart once, with its first parent; darts that other rows already have are left out."""
        sizes = [len(part) for part in self.darts]
        depth = np.repeat([origin[0] for origin in self.origins], sizes)
        errors = np.repeat([origin[1] for origin in self.origins], sizes)
        dart, first = np.unique(np.concatenate(self.darts), return_index=True)
        for other in ruled_out:
            new = np.isin(dart, other.dart, assume_unique=True, invert=True)
            dart, first = dart[new], first[new]
        return Row(dart, np.concatenate(self.parents)[first], depth[first], errors[first])


@dataclass(frozen=True)
class _Course:
    """Consecutive traversals along one edge, or along edges that a missed meetpoint joins."""

    traversal: Traversal  # all as one; its length is that between the ends
    farthest: Traversal  # the same, to the farthest point
    onward: bool  # it ended heading away from where it began
    turned_round: bool  # in between


class SearchForest:
    """The rows of one search. begin() it with the first meetpoint, step() with each edge."""

    def __init__(self, matcher: Matcher, max_errors: int) -> None:
        self._matcher = matcher
        self._max_errors = max_errors
        self._meetpoints: List[Meetpoint] = []
        self._traversals: List[Traversal] = []  # the one at d leads from depth d to d + 1
        self._rows: Dict[Tuple[int, int], Row] = {}  # by depth and errors
        self._errors = 0
        self._among: Optional[np.ndarray] = None  # darts, one of which is the first reference edge; None: any is

    @property
    def depth(self) -> int:
        """The document's current search depth; -1 before the search begins."""
        return len(self._meetpoints) - 1

    @property
    def errors(self) -> int:
        """Number of detection errors that are considered by now."""
        return self._errors

    @property
    def meetpoints(self) -> Tuple[Meetpoint, ...]:
        """The meetpoint of each depth."""
        return tuple(self._meetpoints)

    @property
    def traversals(self) -> Tuple[Traversal, ...]:
        """The edge from each depth to the next."""
        return tuple(self._traversals)

    def begin(self, meetpoint: Meetpoint, among: Optional[np.ndarray] = None) -> None:
        """Start over at a meetpoint.

        Args:
            meetpoint: where the robot stands.
            among: (D,) its reference edge is one of these darts; None: any.
        """
        self._meetpoints, self._traversals, self._rows, self._errors = [meetpoint], [], {}, 0
        self._among = among
        self._work_out_last_row()

    def step(self, traversal: Traversal, meetpoint: Meetpoint) -> None:
        """Take in an edge and the meetpoint at its end.

        Raises:
            ObservationError: the meetpoint it left has no such edge; nothing is changed.
        """
        refuse_rank(traversal.rank, self._meetpoints[-1].degree)
        self._traversals.append(traversal)
        self._meetpoints.append(meetpoint)
        self._work_out_last_row()

    def candidates(self) -> Tuple[np.ndarray, np.ndarray]:
        """(C,) active darts of the current depth, and (C,) the detection errors of each; fewest errors first."""
        rows = [self.row(self.depth, errors) for errors in range(self._errors + 1)]
        return (
            np.concatenate([row.dart for row in rows]),
            np.repeat(np.arange(self._errors + 1), [len(row) for row in rows]),
        )

    def row(self, depth: int, errors: int = 0) -> Row:
        """Active candidates of a depth with exactly this number of errors."""
        return self._rows[depth, errors]

    def between_meetpoints(self) -> bool:
        """Whether the robot may be on an edge, at a spurious meetpoint."""
        return self._between_meetpoints(self._errors)

    def path(self, dart: int) -> List[Tuple[int, int, bool]]:
        """The path of a candidate of the current depth.

        Returns:
            For each row on the path: depth, dart, and whether one edge without an error led there; the first is False.
        """
        errors = next(e for e in range(self._errors + 1) if dart in self.row(self.depth, e).dart)
        depth, index = self.depth, int(np.searchsorted(self.row(self.depth, errors).dart, dart))
        found: List[Tuple[int, int, bool]] = []
        while True:
            row = self.row(depth, errors)
            parent = int(row.parent[index])
            before = int(row.parent_depth[index]), int(row.parent_errors[index])
            plain = parent != NO_PARENT and before == (depth - 1, errors)
            found.append((depth, int(row.dart[index]), plain))
            if parent == NO_PARENT:
                return found[::-1]
            (depth, errors), index = before, parent

    def missed_along(self, dart: int) -> List[int]:
        """Nodes that a candidate of the current depth passed without seeing them, in order."""
        found: List[int] = []
        came = self.path(dart)
        for (depth, before, _), (after, arrival, _) in zip(came, came[1:]):
            if after == depth + 1:
                (departure,) = self._departures(np.array([before]), depth).tolist()
                found += self._between(departure, arrival, self._traversals[depth])
        return found

    def _between(self, departure: int, arrival: int, traversal: Traversal) -> List[int]:
        """Nodes on the path from a departure to an arrival that fits the length driven best; none on a plain edge."""
        atlas, most = self._matcher.atlas, self._max_errors + _USUALLY_MISSED
        best_m, best = math.inf, []
        ways: List[Tuple[int, float, List[int]]] = [(departure, 0.0, [])]
        for last, length_m, passed in ways:  # grows
            length_m += float(atlas.edges.length_m[last >> 1])
            off_m = abs(length_m - traversal.length_m)
            if last ^ 1 == arrival and off_m < best_m:
                best_m, best = off_m, passed
            if len(passed) < most and length_m < traversal.length_m:
                node = int(atlas.darts.node[last ^ 1])
                ways += [(each, length_m, [*passed, node]) for each in atlas.rings[node].tolist() if each != last ^ 1]
        return best

    def has_rival(self, dart: int) -> bool:
        """Whether the last traversal of a candidate also matches a path over a missed meetpoint to the next one."""
        came = self.path(dart)
        if not came[-1][2]:
            return False
        departure = self._departures(np.array([came[-2][1]]), self.depth - 1)
        _, arrival, _ = self._joined_edges(departure, self._traversals[-1], 1)
        return bool(self._matcher.at(arrival, self._meetpoints[-1]).any())

    # -- rows

    def _work_out_last_row(self) -> None:
        for errors in range(self._errors + 1):
            self._rows[self.depth, errors] = self._worked_out(self.depth, errors)
        while self._errors < self._max_errors and not self._alive():
            self._errors += 1
            for depth in range(self.depth + 1):
                self._rows[depth, self._errors] = self._worked_out(depth, self._errors)

    def _alive(self) -> bool:
        return any(len(self.row(self.depth, errors)) for errors in range(self._errors + 1)) or self._between_meetpoints(
            self._errors
        )

    def _between_meetpoints(self, errors: int) -> bool:
        for back in range(1, min(errors, self.depth) + 1):  # this number of the last meetpoints were spurious
            farthest = self._course(self.depth - back, self.depth).farthest
            for spent in range(errors - back + 1):
                row = self.row(self.depth - back, spent)
                departure = self._departures(row.dart, self.depth - back)
                if self._matcher.may_contain(departure, farthest).any():
                    return True
        return errors > self.depth  # all meetpoints were spurious

    def _worked_out(self, depth: int, errors: int) -> Row:
        found = _Found()
        if depth == 0 and errors == 0:
            dart = self._matcher.all_at(self._meetpoints[0])
            dart = dart if self._among is None else np.intersect1d(dart, self._among)
            found.add(dart, np.full(len(dart), NO_PARENT), 0, 0)
        for spurious in range(min(errors, depth - 1) + 1 if depth else 0):
            for missed in range(errors - spurious + 1):
                self._add_paths(found, depth, errors, spurious, missed)
        for spurious in range(1, min(errors, depth - 1) + 1):
            self._add_returns(found, depth, errors, spurious)
        if 1 <= depth <= errors:
            self._add_beginnings(found, depth, errors)
        if not found.darts:
            none = np.zeros(0, np.int64)
            found.add(none, none, 0, 0)
        return found.row([self._rows[depth, fewer] for fewer in range(errors)])

    def _departures(self, dart: np.ndarray, depth: int) -> np.ndarray:
        return self._matcher.departures(dart, self._traversals[depth].rank)

    def _add_paths(self, found: _Found, depth: int, errors: int, spurious: int, missed: int) -> None:
        """Paths of 1 + spurious traversals over 1 + missed edges."""
        origin = depth - 1 - spurious, errors - spurious - missed
        course = self._course(origin[0], depth)
        if not course.onward or (missed and course.turned_round):
            return
        traversal = course.traversal
        departure = self._departures(self._rows[origin].dart, origin[0])
        if not missed:
            along = self._matcher.edges_along(departure, traversal)
            self._add_arrivals(found, twin(departure[along]), along, depth, origin)
        if missed or (self._matcher.some_usually_missed and not course.turned_round):
            _, arrival, parent = self._joined_edges(departure, traversal, missed)
            self._add_arrivals(found, arrival, parent, depth, origin)

    def _add_arrivals(
        self, found: _Found, arrival: np.ndarray, parent: np.ndarray, depth: int, origin: Tuple[int, int]
    ) -> None:
        here = self._matcher.at(arrival, self._meetpoints[depth])
        found.add(arrival[here], parent[here], *origin)

    def _course(self, first: int, last: int) -> _Course:
        """The traversals between two depths; rank 0 at a meetpoint in between means that the robot turned round.

        The triangle inequality bounds the chord too loosely to be of use: it is not matched.
        """
        parts = self._traversals[first:last]
        if len(parts) == 1:
            return _Course(parts[0], parts[0], True, False)
        sigma = math.sqrt(sum(self._matcher.sigma_length_m(part) ** 2 for part in parts))
        ahead = np.array([-1.0 if part.rank == 0 and number else 1.0 for number, part in enumerate(parts)]).cumprod()
        at = np.cumsum(ahead * [part.length_m for part in parts])
        net, farthest = (
            Traversal(parts[0].rank, max(float(value), 1e-6), UNKNOWN, sigma_length_m=sigma)
            for value in (at[-1], at.max())
        )
        return _Course(net, farthest, bool(ahead[-1] > 0.0), bool(ahead.min() < 0.0))

    def _joined_edges(
        self, departure: np.ndarray, traversal: Traversal, missed: int
    ) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Paths over this number of missed meetpoints that match: departures, arrivals, indices of the departures.

        Meetpoints that are usually missed do not count.
        """
        atlas, matcher = self._matcher.atlas, self._matcher
        passes = missed + (_USUALLY_MISSED if matcher.some_usually_missed else 0)
        counts = ~atlas.visits.usually_missed
        longest = matcher.longest_m(traversal, passes + 1)
        parent, last, length = np.arange(len(departure)), departure, matcher.length_m[departure >> 1]
        variance = atlas.edges.sigma_m[departure >> 1] ** 2
        left = np.full(len(departure), missed)  # meetpoints still to be missed
        ends: List[Tuple[np.ndarray, ...]] = []
        for _ in range(passes):
            left = left - counts[atlas.darts.node[twin(last)]]
            going = np.flatnonzero((length < longest) & (left >= 0))
            last, beside = matcher.others(twin(last[going]))
            beside = going[beside]
            parent, left = parent[beside], left[beside]
            length = length[beside] + matcher.length_m[last >> 1]
            variance = variance[beside] + atlas.edges.sigma_m[last >> 1] ** 2
            near = (left == 0) & (length <= longest) & (length >= 2.0 * traversal.length_m - longest)
            ends.append((parent[near], last[near], length[near], variance[near]))
        parent, last, length, variance = (np.concatenate(part) for part in zip(*ends))
        fits = matcher.paths_along(departure[parent], twin(last), length, np.sqrt(variance), traversal)
        return departure[parent[fits]], twin(last[fits]), parent[fits]

    def _add_returns(self, found: _Found, depth: int, errors: int, spurious: int) -> None:
        """The robot turned round on an edge, at a spurious meetpoint, and is back where that edge began."""
        origin = depth - 1 - spurious, errors - spurious
        course = self._course(origin[0], depth)
        if course.onward or course.traversal.length_m > self._matcher.z * course.traversal.sigma_length_m:
            return
        departure = self._departures(self._rows[origin].dart, origin[0])
        fits = self._matcher.may_contain(departure, course.farthest)
        fits[fits] = self._matcher.at(departure[fits], self._meetpoints[depth])
        found.add(departure[fits], np.flatnonzero(fits), *origin)

    def _add_beginnings(self, found: _Found, depth: int, errors: int) -> None:
        """All meetpoints before this one were spurious: the search begins here, after an edge at least that long."""
        arrival = self._matcher.all_at(self._meetpoints[depth])
        course = self._course(0, depth)
        if not course.turned_round and errors == depth:
            arrival = arrival[self._matcher.may_contain(arrival, course.traversal)]
        found.add(arrival, np.full(len(arrival), NO_PARENT), 0, 0)
