"""glass_nav atlas check: validates an atlas, and lists indistinguishable places."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import FrozenSet, List, Optional

import numpy as np

from glass_nav.cli import search_params
from glass_nav.cli.progress import Progress
from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.topology.atlas.atlas import KINDS, Atlas, AtlasError
from glass_nav.topology.search import distinguishability, learnt_atlas
from glass_nav.topology.search.distinguishability import Distinguishability
from glass_nav.topology.search.matching import Tolerances
from glass_nav.world import map_file

HELP = "validate an atlas, and list places that look alike"
DESCRIPTION = """Checks every rule of an atlas. Then simulates the search of a robot without measurement errors from all
starts, and reports which places are indistinguishable and how many edges a robot needs at most and on average."""
EXAMPLES = (
    "glass_nav atlas check glass_office",
    "glass_nav atlas check atlas/floor --map floor.yaml",
)

MAX_STARTS = 2000
MAX_LISTED = 20


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the subcommand."""
    parser.add_argument(
        "atlas", metavar="ATLAS", help="atlas.json, atlas.npz, the folder of one, or the name of a shipped one"
    )
    parser.add_argument("--map", type=Path, help="also check that the atlas was made from this map")
    parser.add_argument("--params", type=Path, metavar="FILE", help="yaml of parameters, names as for topology_node")
    parser.add_argument(
        "--starts",
        type=int,
        default=MAX_STARTS,
        metavar="N",
        help=f"maximum number of starts, spread over the atlas (default {MAX_STARTS})",
    )


def usage_error(arguments: argparse.Namespace) -> Optional[str]:
    """What is wrong with the options as such, before any file is opened."""
    return f"--starts must be >= 1, got {arguments.starts}" if arguments.starts < 1 else None


def main(arguments: argparse.Namespace) -> None:
    """Load, search, print.

    Raises:
        AtlasError, MapError, ParamError: bad input; one line.
    """
    params = search_params.load(arguments.params)
    path = shipped_atlases.find(arguments.atlas)
    atlas, warning = atlas_file.load(path), ""
    if arguments.map is not None:
        try:
            warning = atlas.check_map(map_file.load(arguments.map), str(arguments.map))
        except AtlasError as err:
            raise AtlasError(f"{path}: {err}") from err
    print(f"{path}: in order" + (f", but it {warning}" if warning else ""))
    for line in summary(atlas, params.tolerances):
        print(f"  {line}")
    count = len(atlas.darts)
    starts = np.unique(np.linspace(0, count - 1, min(count, arguments.starts)).astype(np.int64))
    progress = Progress("check", len(starts), unit="starts")
    try:
        found = distinguishability.of(atlas, params, starts, progress.step)
    finally:
        progress.finish()
    for line in verdict(atlas, found):
        print(f"  {line}")


def summary(atlas: Atlas, tolerances: Tolerances) -> List[str]:
    """The contents of an atlas, and its statistics."""
    counts = np.bincount(atlas.nodes.kind, minlength=len(KINDS)).tolist()
    kinds = ", ".join(
        f"{count} {KINDS[kind].replace('_', ' ')}{'s' * (count != 1)}" for kind, count in enumerate(counts) if count
    )
    components = atlas.components()[0]
    return [
        f"map: {atlas.source.name or 'not known'}",
        f"{len(atlas.nodes)} nodes ({kinds}), {len(atlas.edges)} edges of {atlas.edges.length_m.sum():.0f} m, "
        f"{components} component{'s' * (components != 1)}",
        f"visits by robots: {atlas.visits.node_count.sum()} of nodes, {atlas.visits.edge_count.sum()} of edges",
        *learnt(atlas, tolerances),
    ]


def learnt(atlas: Atlas, tolerances: Tolerances) -> List[str]:
    """What robots have learnt, one line for each node or edge; none without enough visits."""
    known, lines = learnt_atlas.of(atlas, tolerances), []
    for what, value, of_map, sigma, of_map_sigma, count in (
        ("r", known.nodes.r_m, atlas.nodes.r_m, known.nodes.sigma_r_m, atlas.nodes.sigma_r_m, atlas.visits.node_count),
        (
            "length",
            known.edges.length_m,
            atlas.edges.length_m,
            known.edges.sigma_m,
            atlas.edges.sigma_m,
            atlas.visits.edge_count,
        ),
    ):
        owner = "node" if what == "r" else "edge"
        lines += [
            f"{owner} {at}: {count[at]} visits, {what} {of_map[at]:.3f} -> {value[at]:.3f} m, standard deviation "
            f"{of_map_sigma[at]:.3f} -> {sigma[at]:.3f} m"
            for at in np.flatnonzero(count >= learnt_atlas.MIN_VISITS).tolist()
        ]
    missed = np.flatnonzero(atlas.visits.usually_missed).tolist()
    if missed:
        lines.append(f"usually missed by robots, and expected to be: nodes {', '.join(map(str, missed))}")
    if len(lines) > MAX_LISTED:
        lines = [*lines[:MAX_LISTED], f"... and {len(lines) - MAX_LISTED} more"]
    return [f"learnt: {line}" for line in lines]


def verdict(atlas: Atlas, found: Distinguishability) -> List[str]:
    """Which places are indistinguishable, and how many edges are needed."""
    tried = len(found.starts)
    of = "everywhere" if tried == len(atlas.darts) else f"{tried} of {len(atlas.darts)} places"
    lines = (
        [
            f"a robot that wakes up ({of}) knows its place after at most {found.edges[found.confirmed].max()} edges, "
            f"{found.edges[found.confirmed].mean():.1f} on average, those that confirm it included"
        ]
        if found.confirmed.any()
        else [f"no robot that wakes up ({of}) can find out where it is"]
    )
    if not found.alike:
        lines.append("no two places are indistinguishable")
    else:
        lines.append(
            f"{len(found.alike)} sets of places are indistinguishable; a robot knows so after at most "
            f"{found.edges[~found.confirmed].max()} edges:"
        )
        lines += [f"  {_places(atlas, alike)}" for alike in found.alike[:MAX_LISTED]]
        if len(found.alike) > MAX_LISTED:
            lines.append(f"  ... and {len(found.alike) - MAX_LISTED} more")
    if len(found.unresolved):
        lines.append(
            f"from {len(found.unresolved)} places the search did not end, the first is node "
            f"{atlas.darts.node[found.unresolved[0]]}"
        )
    return lines


def _places(atlas: Atlas, alike: FrozenSet[int]) -> str:
    """Text: the nodes, each with the directions of the darts in question."""
    darts = np.array(sorted(alike))
    shown = [
        f"node {atlas.darts.node[dart]} looking {np.degrees(atlas.darts.bearing_rad[dart]):.0f} deg"
        for dart in darts[:MAX_LISTED]
    ]
    return ", ".join(shown) + (f" and {len(darts) - MAX_LISTED} more" if len(darts) > MAX_LISTED else "")
