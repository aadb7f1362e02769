"""The progress of a search as log lines: one at each meetpoint, and some in between."""

from __future__ import annotations

from glass_nav.topology.observations import turn_name
from glass_nav.topology.search.belief import Belief
from glass_nav.topology.search.search_estimate import SearchEstimate
from glass_nav.topology.search.search_forest import SearchForest


def after(estimate: SearchEstimate, forest: SearchForest, stamp_ns: int) -> str:
    """A line with what was seen, what is known now, and the next turn.

    Args:
        estimate: that follows from it.
        forest: with the last meetpoint.
        stamp_ns: of the estimate; not that of the last meetpoint where a scan on the way decided.
    """
    asked = f"; next turn {estimate.choice.name}" if estimate.choice is not None else ""
    return f"{_seen(forest, stamp_ns)}: {estimate.state}, {estimate.reason}{asked}"


def on_the_way(belief: Belief, risk: float) -> str:
    """How many places are left between meetpoints."""
    left = len(belief.left(risk))
    if not left:
        return f"after {belief.driven_m:.1f} m: no place of the map fits what was seen so far; driving on to see more"
    places = f"{left} place{'s' * (left != 1)} of the map fit{'s' * (left == 1)}"
    return f"after {belief.driven_m:.1f} m: {places}, the best has {belief.share[0]:.0%}; driving on to see more"


def _seen(forest: SearchForest, stamp_ns: int) -> str:
    meetpoints = forest.meetpoints
    if not meetpoints or (stamp_ns and stamp_ns != meetpoints[-1].stamp_ns):
        return "on the way"
    here = meetpoints[-1]
    place = f"with {here.degree} edge{'s' * (here.degree != 1)}, {here.r_m:.2f} m from the walls"
    if not forest.depth:
        return f"meetpoint {place}"
    driven = forest.traversals[-1]
    turn = turn_name(driven.rank, meetpoints[-2].degree)
    return f"meetpoint {forest.depth + 1} {place}, {driven.length_m:.1f} m after {turn}"
