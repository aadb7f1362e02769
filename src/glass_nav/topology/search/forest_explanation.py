"""The search forest as text, row by row as in the document, with the reason why a search node is inactive.

Seed document: global_localization_procedure.txt, "Building the search forest" to "Updating the Search Forest". A row
holds a search node for every edge of every active search node of the row before.
"""

from __future__ import annotations

from typing import Iterator, List, Optional

import numpy as np

from glass_nav.topology.atlas.atlas import Atlas, twin
from glass_nav.topology.observations import Meetpoint, Traversal, turn_name
from glass_nav.topology.search import vote
from glass_nav.topology.search.atlas_localizer import AtlasLocalizer
from glass_nav.topology.search.search_estimate import SearchEstimate
from glass_nav.topology.search.search_forest import NO_PARENT

MAX_LINES = 40  # of a row; large atlases have rows of thousands


def row(localizer: AtlasLocalizer, estimate: SearchEstimate) -> Iterator[str]:
    """Lines on the current depth of a search: what was seen, its search nodes, the estimate."""
    forest, atlas = localizer.forest, localizer.atlas
    depth, here = forest.depth, forest.meetpoints[-1]
    yield f"Search depth {depth}"
    if depth:
        left = forest.meetpoints[-2] if depth > 1 else None
        yield f"  match edge E{depth - 1}: {_edge_seen(forest.traversals[-1], left)}"
    yield f"  match node M{depth}: degree {here.degree}, r {here.r_m:.2f} m"
    yield from _shortened(list(_first_row(localizer, here)) if not depth else list(_expanded_row(localizer)))
    for errors in range(1, forest.errors + 1):
        found = forest.row(depth, errors)
        yield from _shortened(
            [
                f"  node {atlas.darts.node[dart]:3d}  {'from the start' if parent == NO_PARENT else ''}"
                f"  active with {errors} detection error{'s' * (errors > 1)}"
                for dart, parent in zip(found.dart.tolist(), found.parent.tolist())
            ]
        )
    if localizer.params.document and depth and here.degree > 2 and len(estimate.dart) > 1:
        left_right_votes = vote.left_right_votes(localizer.matcher, estimate.dart)
        yield f"  votes: {left_right_votes[0]} left, {left_right_votes[1]} right"
    turn = ""
    if estimate.choice:
        turn = f"; turn {estimate.choice.name}" if depth else "; leave by any edge"
    yield f"  {estimate.state}: {estimate.reason}{turn}"


def _edge_seen(traversal: Traversal, left: Optional[Meetpoint]) -> str:
    turn = f"turn {turn_name(traversal.rank, left.degree)}" if left else "any of the node"
    return f"length {traversal.length_m:.2f} m, chord {traversal.chord_m:.2f} m, {turn}"


def _first_row(localizer: AtlasLocalizer, here: Meetpoint) -> Iterator[str]:
    """Row 0: every node of the atlas."""
    atlas = localizer.atlas
    active = set(atlas.darts.node[localizer.forest.row(0).dart].tolist())
    for node in range(len(atlas.nodes)):
        yield f"  node {node:3d}  {'active' if node in active else 'x  ' + _node_mismatch(atlas, node, here)}"


def _expanded_row(localizer: AtlasLocalizer) -> Iterator[str]:
    """The next row: every edge of every active search node of the row before."""
    forest, atlas, matcher = localizer.forest, localizer.atlas, localizer.matcher
    traversal, here, depth = forest.traversals[-1], forest.meetpoints[-1], forest.depth
    before = forest.row(depth - 1).dart
    if depth == 1:  # there is no arrival edge yet: search nodes are nodes, and any edge may have been taken
        node = np.unique(atlas.darts.node[before])
        departures = np.concatenate([atlas.rings[int(each)] for each in node] or [np.zeros(0, np.int64)])
        right_turn = np.isin(departures, matcher.departures(before, traversal.rank))
    else:
        rings = [
            atlas.clockwise(np.full(forest.meetpoints[-2].degree, dart), np.arange(forest.meetpoints[-2].degree))
            for dart in before.tolist()
        ]
        departures = np.concatenate(rings or [np.zeros(0, np.int64)])
        right_turn = np.isin(departures, matcher.departures(before, traversal.rank))
    along = np.isin(np.arange(len(departures)), matcher.edges_along(departures, traversal))
    at = matcher.at(twin(departures), here)
    for departure, turn, edge, node_fits in zip(departures.tolist(), right_turn, along, at):
        end = int(atlas.darts.node[departure ^ 1])
        wrong = []
        if not node_fits:
            wrong.append(_node_mismatch(atlas, end, here))
        if not edge:
            wrong.append(
                f"edge: length {atlas.edges.length_m[departure >> 1]:.2f} m, "
                f"chord {atlas.edges.chord_m[departure >> 1]:.2f} m"
            )
        if not turn:
            wrong.append(_turn_mismatch(atlas, departure, before))
        yield (
            f"  node {int(atlas.darts.node[departure]):3d} - edge {departure >> 1:3d} -> node {end:3d}  "
            f"{'x  ' + '; '.join(wrong) if wrong else 'active'}"
        )


def _node_mismatch(atlas: Atlas, node: int, here: Meetpoint) -> str:
    degree = int(atlas.degree[node])
    if degree != here.degree:
        return f"node: degree {degree}"
    return f"node: r {atlas.nodes.r_m[node]:.2f} m"


def _turn_mismatch(atlas: Atlas, departure: int, before: np.ndarray) -> str:
    node = atlas.darts.node[departure]
    arrivals = before[atlas.darts.node[before] == node]
    degree = int(atlas.degree[node])
    turns = sorted({(int(atlas.rank[departure]) - int(atlas.rank[arrival])) % degree for arrival in arrivals.tolist()})
    return f"turn {' or '.join(turn_name(turn, degree) for turn in turns)}"


def _shortened(lines: List[str]) -> List[str]:
    """At most so many lines, active ones first, and a count of the omitted ones."""
    if len(lines) <= MAX_LINES:
        return lines
    active = [line for line in lines if "  x  " not in line]
    shown = active[:MAX_LINES]
    return [*shown, f"  ... and {len(active) - len(shown)} more active, {len(lines) - len(active)} inactive"]
