"""Why search nodes were ruled out: the first test that each failed, with the values of atlas and observation.

The tests and their tolerances are those of matching.py. D darts.
"""

from __future__ import annotations

import math
from typing import List, Optional, Tuple

import numpy as np

from glass_nav.geometry import angles
from glass_nav.topology.atlas.atlas import twin
from glass_nav.topology.observations import Meetpoint, Traversal
from glass_nav.topology.search.belief import RuledOut
from glass_nav.topology.search.matching import Matcher, poses_at
from glass_nav.topology.search.search_forest import SearchForest

MAX_LISTED = 100

Failed = Tuple[str, float, float, str]  # test, value of the atlas, value seen, unit


def of_last_row(matcher: Matcher, forest: SearchForest) -> List[RuledOut]:
    """The search nodes that the last meetpoint and the edge to it ruled out, one for each dart, at most MAX_LISTED.

    At the first meetpoint one for each node of the atlas without a dart that is left.
    """
    if forest.depth < 0:
        return []
    alive, _ = forest.candidates()
    atlas, here = matcher.atlas, forest.meetpoints[-1]
    traversal: Optional[Traversal] = None
    if forest.depth:
        traversal = forest.traversals[-1]
        before = forest.row(forest.depth - 1).dart
        arrival = twin(matcher.departures(before, traversal.rank))
        arrival = arrival[~np.isin(arrival, alive)]
    else:
        gone = ~np.isin(np.arange(len(atlas.nodes)), atlas.darts.node[alive])
        arrival = atlas.rings.values[atlas.rings.offsets[:-1][gone]]
    found: List[RuledOut] = []
    for dart in arrival[:MAX_LISTED].tolist():
        failed = _along(matcher, dart, traversal) if traversal is not None else None
        test, expected, seen, unit = failed or _at(matcher, dart, here) or ("scan", 1.0, math.nan, "")
        found.append(RuledOut(poses_at(atlas, np.array([dart]), here)[0], dart, test, expected, seen, unit))
    return found


def words(gone: RuledOut) -> str:
    """The mismatch in words: "length 8.00 m, driven 11.20 m"."""
    if gone.test == "scan":
        return "the scan does not fit" if math.isnan(gone.seen) else f"explains {gone.seen:.0%} of the scan"
    verb = "driven" if gone.test in ("length", "chord", "turn") else "seen"
    if gone.unit == "rad":
        return f"{gone.test} {math.degrees(gone.expected):.0f} deg, {verb} {math.degrees(gone.seen):.0f} deg"
    if gone.test == "segments":
        return f"{gone.seen:.0%} of the walls seen stand in free space"
    places = 2 if gone.unit else 0
    unit = f" {gone.unit}" if gone.unit else ""
    return f"{gone.test} {gone.expected:.{places}f}{unit}, {verb} {gone.seen:.{places}f}{unit}"


def _along(matcher: Matcher, arrival: int, traversal: Traversal) -> Optional[Failed]:
    """The first test of the edge that a dart fails; None if it passes all."""
    departure = np.array([arrival ^ 1])
    if len(matcher.edges_along(departure, traversal)):
        return None
    edges, edge, z = matcher.atlas.edges, arrival >> 1, matcher.z
    length_m, chord_m, sigma_m = (float(value[edge]) for value in (edges.length_m, edges.chord_m, edges.sigma_m))
    if abs(length_m - traversal.length_m) > z * math.hypot(matcher.sigma_length_m(traversal), sigma_m):
        return "length", length_m, traversal.length_m, "m"
    if abs(chord_m - traversal.chord_m) > z * math.hypot(matcher.sigma_chord_m(traversal), sigma_m):
        return "chord", chord_m, traversal.chord_m, "m"  # never of a chord that was not measured: NaN
    bearing = matcher.atlas.darts.bearing_rad
    turned = float(angles.wrap(bearing[arrival] + np.pi - bearing[arrival ^ 1]))
    share, _ = matcher.contradiction(arrival ^ 1, traversal) if len(traversal.segments_m) else (0.0, 0.0)
    if share > 0.0 and matcher.directions_fit(departure, traversal)[0]:
        return "segments", 0.0, share, ""
    return "turn", turned, float(angles.wrap(traversal.turn_rad)), "rad"


def _at(matcher: Matcher, dart: int, here: Meetpoint) -> Optional[Failed]:
    """The first test of the node that a dart fails; None if it passes all."""
    atlas = matcher.atlas
    node = int(atlas.darts.node[dart])
    degree, r_m = int(atlas.degree[node]), float(atlas.nodes.r_m[node])
    if degree != here.degree:
        return "degree", float(degree), float(here.degree), ""
    if abs(r_m - here.r_m) > matcher.z * math.hypot(matcher.sigma_r_m(here), float(atlas.nodes.sigma_r_m[node])):
        return "r", r_m, here.r_m, "m"
    if matcher.use_angles and len(here.bearings_rad) > 1:
        bearing = atlas.darts.bearing_rad
        around = atlas.clockwise(np.full(degree - 1, dart), np.arange(1, degree))
        gaps = np.mod(bearing[dart] - bearing[around], 2.0 * np.pi)
        off = np.abs(angles.wrap(gaps - here.gaps_rad[1:]))
        worst = int(off.argmax())
        if off[worst] > matcher.z * math.sqrt(2.0) * matcher.tolerances.bearing_sigma_rad:
            return "angles", float(gaps[worst]), float(here.gaps_rad[1 + worst]), "rad"
    return None
