"""Compares the nodes of an atlas that a robot passed with those that it detected: seen, missed, false positives.

Both by one rule: a node is passed if the robot came within `near(r)` of it, in sight. Passing it again, after the robot
has been `linger_m` further away than that, counts again. What was seen belongs to a node of the atlas if it lies within
MATCH_M of it in the map, the nearest first, one for one.

S scans, N nodes and E edges of an atlas.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

# A node of the local map moves by 0.3 m at most from one graph to the next, and meetpoints closer than that are one;
# the reference of a recorded drive is some 0.1 to 0.2 m off.
MATCH_M = 0.5

SEEN, MISSED, INVENTED = "seen", "missed", "invented"
DOUBTFUL, UNSTEADY, NOTHING = "doubtful", "unsteady", "nothing"  # why missed: what was there instead


class Passing(NamedTuple):
    """When a node counts as passed."""

    near: Callable[[np.ndarray], np.ndarray]  # equidistances (...) -> how near (...) [m]
    linger_m: float
    sees: Callable[[np.ndarray, np.ndarray], bool]  # whether nothing of the map stands between two points (2,)


@dataclass(frozen=True)
class KnownNodes:
    """The nodes of an atlas to compare with, in the frame map."""

    position_m: np.ndarray  # (N, 2)
    r_m: np.ndarray  # (N,)
    degree: np.ndarray  # (N,)
    edge_node: np.ndarray  # (E, 2) nodes that each edge joins
    length_m: np.ndarray  # (E,)
    chord_m: np.ndarray  # (E,)


@dataclass(frozen=True)
class SeenNode:
    """A node that the robot detected."""

    stamp_ns: int  # when it was nearest
    first_ns: int  # while it was about
    last_ns: int
    position_m: np.ndarray  # (2,) in the frame map
    away_m: float  # of the robot, at the nearest
    degree: int
    r_m: float
    doubtful: bool  # what it is equidistant from may be elsewhere
    steady: bool  # graphs agreed on it


@dataclass(frozen=True)
class Visit:
    """A node of the atlas that the robot passed."""

    node: int
    stamp_ns: int  # when it was nearest
    first_ns: int
    last_ns: int
    away_m: float


@dataclass(frozen=True)
class Meeting:
    """A node passed, known or seen or both."""

    verdict: str  # SEEN, MISSED, INVENTED
    stamp_ns: int
    visit: Optional[Visit]  # None: INVENTED
    seen: Optional[int]  # row of what was seen; None: MISSED
    why: str = ""  # MISSED


@dataclass(frozen=True)
class DrivenEdge:
    """Two nodes seen one after the other that an edge of the atlas joins."""

    edge: int
    length_m: float  # as driven
    chord_m: float


@dataclass(frozen=True)
class TopologyScore:
    """The nodes of an atlas that a drive passed, and which it detected."""

    known: KnownNodes
    seen: List[SeenNode]
    meetings: List[Meeting]  # in the order of time
    edges: List[DrivenEdge]

    def of_kind(self, verdict: str, dead_ends: Optional[bool] = None) -> List[Meeting]:
        """The nodes with a verdict; of dead ends or of meetpoints only, by the atlas where it has them."""
        return [
            each for each in self.meetings if each.verdict == verdict and dead_ends in (None, self._degree(each) == 1)
        ]

    def _degree(self, meeting: Meeting) -> int:
        if meeting.visit is not None:
            return int(self.known.degree[meeting.visit.node])
        assert meeting.seen is not None
        return self.seen[meeting.seen].degree

    def pairs(self) -> List[Tuple[int, SeenNode]]:
        """Node of the atlas and what was seen of it, each time."""
        return [
            (each.visit.node, self.seen[each.seen])
            for each in self.meetings
            if each.visit is not None and each.seen is not None
        ]

    def metrics(self) -> Dict[str, Any]:
        """Plain numbers and None, ready for JSON."""
        pairs, known = self.pairs(), self.known
        off_m = [float(np.hypot(*(seen.position_m - known.position_m[node]))) for node, seen in pairs]
        r_off_m = [seen.r_m - float(known.r_m[node]) for node, seen in pairs]
        length_off = [driven.length_m - float(known.length_m[driven.edge]) for driven in self.edges]
        chord_off = [driven.chord_m - float(known.chord_m[driven.edge]) for driven in self.edges]
        missed = self.of_kind(MISSED)
        return {
            **_counts(self, None),
            "meetpoints": _counts(self, False),
            "dead_ends": _counts(self, True),
            "missed_why": {why: sum(each.why == why for each in missed) for why in (DOUBTFUL, UNSTEADY, NOTHING)},
            "position_off_m": _spread(off_m),
            "r_off_m": _spread(r_off_m),
            "edges_driven": len(self.edges),
            "edge_length_off_m": _spread(length_off),
            "edge_chord_off_m": _spread(chord_off),
        }


def _counts(score: TopologyScore, dead_ends: Optional[bool]) -> Dict[str, Any]:
    seen, missed, invented = (score.of_kind(verdict, dead_ends) for verdict in (SEEN, MISSED, INVENTED))
    right = sum(
        score.seen[each.seen].degree == score.known.degree[each.visit.node]
        for each in seen
        if each.seen is not None and each.visit is not None
    )
    passed = len(seen) + len(missed)
    return {
        "passed": passed,
        "seen": len(seen),
        "missed": len(missed),
        "invented": len(invented),
        "degree_right": int(right),
        "seen_share": len(seen) / passed if passed else None,
        "degree_right_share": float(right / len(seen)) if seen else None,
    }


def _spread(off: Sequence[float]) -> Dict[str, Optional[float]]:
    """Signed median; median and 95th percentile of the absolute values."""
    if not len(off):
        return dict.fromkeys(("median", "median_abs", "p95_abs"))
    return {
        "median": float(np.median(off)),
        "median_abs": float(np.median(np.abs(off))),
        "p95_abs": float(np.percentile(np.abs(off), 95)),
    }


def visits(known: KnownNodes, stamps_ns: np.ndarray, map_from_base: np.ndarray, passing: Passing) -> List[Visit]:
    """Nodes of the atlas that a robot passed.

    Args:
        known: the atlas.
        stamps_ns: (S,) ascending.
        map_from_base: (S, 3) NaN where it is not known.
        passing: what counts.
    """
    found: List[Visit] = []
    at = np.where(np.isfinite(map_from_base[:, :2]), map_from_base[:, :2], np.inf)  # nowhere near
    for node, (position, near_m) in enumerate(zip(known.position_m, passing.near(known.r_m).tolist())):
        away = np.hypot(*(at - position).T)
        about = np.flatnonzero(away <= near_m + passing.linger_m)
        for rows in np.split(about, np.flatnonzero(np.diff(about) > 1) + 1):
            near = rows[away[rows] <= near_m]
            in_sight = [
                row for row in near[np.argsort(away[near], kind="stable")].tolist() if passing.sees(at[row], position)
            ][:1]
            found += [
                Visit(node, int(stamps_ns[row]), int(stamps_ns[rows[0]]), int(stamps_ns[rows[-1]]), float(away[row]))
                for row in in_sight
            ]
    return sorted(found, key=lambda visit: (visit.stamp_ns, visit.node))


def compare(known: KnownNodes, passed: Sequence[Visit], seen: Sequence[SeenNode], passing: Passing) -> List[Meeting]:
    """Assigns detections to nodes, in the order of time.

    Seen nodes at the edge of what is near, or beside a node of the atlas that is, are neither right nor wrong.
    """
    counts = [not node.doubtful and node.steady for node in seen]
    visit_of, seen_of = _matched(known, passed, seen, counts)
    rest = _matched(
        known,
        [visit for number, visit in enumerate(passed) if number not in seen_of],
        seen,
        [not each for each in counts],
    )[0]
    why = {number: DOUBTFUL if seen[number].doubtful else UNSTEADY for number in rest}
    lost = {id(visit): why[number] for number, visit in rest.items()}
    found = [
        Meeting(SEEN, visit.stamp_ns, visit, seen_of[number])
        if number in seen_of
        else Meeting(MISSED, visit.stamp_ns, visit, None, lost.get(id(visit), NOTHING))
        for number, visit in enumerate(passed)
    ]
    taken = [passed[number] for number in seen_of]
    for row, node in enumerate(seen):
        if not counts[row] or row in visit_of or node.away_m > float(passing.near(np.array(node.r_m))):
            continue
        beside = np.flatnonzero(np.hypot(*(known.position_m - node.position_m).T) <= MATCH_M).tolist()
        if not beside or any(visit.node in beside and _overlap(visit, node) for visit in taken):
            found.append(Meeting(INVENTED, node.stamp_ns, None, row))
    return sorted(found, key=lambda meeting: meeting.stamp_ns)


def _matched(
    known: KnownNodes, passed: Sequence[Visit], seen: Sequence[SeenNode], counts: Sequence[bool]
) -> Tuple[Dict[int, Visit], Dict[int, int]]:
    """Row of what was seen -> visit, and number of that visit -> row; the nearest pairs are matched first."""
    pairs = []
    for row, node in enumerate(seen):
        for number, visit in enumerate(passed):
            if counts[row] and _overlap(visit, node):
                off_m = float(np.hypot(*(known.position_m[visit.node] - node.position_m)))
                if off_m <= MATCH_M:
                    pairs.append((off_m, row, number))
    visit_of: Dict[int, Visit] = {}
    seen_of: Dict[int, int] = {}
    for _, row, number in sorted(pairs):
        if row not in visit_of and number not in seen_of:
            visit_of[row], seen_of[number] = passed[number], row
    return visit_of, seen_of


def _overlap(visit: Visit, node: SeenNode) -> bool:
    return visit.first_ns <= node.last_ns and node.first_ns <= visit.last_ns


def driven_edges(
    known: KnownNodes, meetings: Sequence[Meeting], line_between: Callable[[int, int], np.ndarray]
) -> List[DrivenEdge]:
    """Edges between nodes that were seen in succession, with no miss and no false positive between them.

    Args:
        known: the atlas.
        meetings: in the order of time.
        line_between: rows of two seen nodes -> (n, 2) the path that the robot took from node to node.
    """
    found = []
    for before, after in zip(meetings, meetings[1:]):
        if before.visit is None or before.seen is None or after.visit is None or after.seen is None:
            continue
        ends = sorted((before.visit.node, after.visit.node))
        edges = np.flatnonzero((np.sort(known.edge_node, axis=1) == ends).all(axis=1))
        if not len(edges):
            continue
        line = line_between(before.seen, after.seen)
        length_m = float(np.hypot(*np.diff(line, axis=0).T).sum())
        edge = int(edges[np.abs(known.length_m[edges] - length_m).argmin()])
        found.append(DrivenEdge(edge, length_m, float(np.hypot(*(line[-1] - line[0])))))
    return found


def write(path: Path, score: TopologyScore) -> None:
    """topology.csv: a row for each node passed; what is not known is empty."""
    known = score.known
    with path.open("w", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(
            [
                "stamp_ns",
                "verdict",
                "why",
                "node",
                "x_m",
                "y_m",
                "degree",
                "r_m",
                "seen_x_m",
                "seen_y_m",
                "seen_degree",
                "seen_r_m",
                "off_m",
                "away_m",
            ]
        )
        for each in score.meetings:
            node = None if each.visit is None else each.visit.node
            seen = None if each.seen is None else score.seen[each.seen]
            atlas: List[Any] = (
                [""] * 5
                if node is None
                else [
                    node,
                    *(f"{value:.3f}" for value in known.position_m[node]),
                    int(known.degree[node]),
                    f"{known.r_m[node]:.3f}",
                ]
            )
            robot: List[Any] = (
                [""] * 4
                if seen is None
                else [*(f"{value:.3f}" for value in seen.position_m), seen.degree, f"{seen.r_m:.3f}"]
            )
            off = (
                ""
                if node is None or seen is None
                else f"{float(np.hypot(*(seen.position_m - known.position_m[node]))):.3f}"
            )
            away_m = each.visit.away_m if each.visit is not None else seen.away_m if seen is not None else np.nan
            rows.writerow([each.stamp_ns, each.verdict, each.why, *atlas, *robot, off, f"{away_m:.3f}"])
