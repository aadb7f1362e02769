"""glass_nav atlas explain: prints a search forest row by row, as in the document."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Optional

import numpy as np

from glass_nav.cli import search_params
from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.topology.atlas.atlas import AtlasError
from glass_nav.topology.search import forest_explanation
from glass_nav.topology.search.atlas_localizer import AtlasLocalizer
from glass_nav.topology.search.atlas_robot import AtlasRobot, Surroundings, TrialParams
from glass_nav.topology.search.search_params import SearchParams

HELP = "print a search forest row by row"
DESCRIPTION = """Simulates a robot without measurement errors and prints its search forest: each row has every edge of
every search node that was active in the row before, with the reason if it is ruled out. Without arguments this is the
worked example of the document on the global localization procedure."""
EXAMPLES = (
    "glass_nav atlas explain",
    "glass_nav atlas explain glass_office --dart 5 --best",
)

EXAMPLE = "document_example"
DEEPEST = 50


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the subcommand."""
    parser.add_argument(
        "atlas",
        metavar="ATLAS",
        nargs="?",
        default=EXAMPLE,
        help=f"atlas.json, atlas.npz, the folder of one, or the name of a shipped one (default {EXAMPLE})",
    )
    parser.add_argument(
        "--dart",
        type=int,
        default=0,
        metavar="N",
        help="first edge of the robot: 2e to leave along edge e from its begin, 2e + 1 from its end (default 0)",
    )
    parser.add_argument(
        "--best",
        action="store_true",
        help="search as topology_node does by default: best turn, confirming edges, proof of ambiguity",
    )
    parser.add_argument("--params", type=Path, metavar="FILE", help="yaml of parameters, names as for topology_node")


def usage_error(arguments: argparse.Namespace) -> Optional[str]:
    """What is wrong with the options as such, before any file is opened."""
    return f"--dart must be >= 0, got {arguments.dart}" if arguments.dart < 0 else None


def main(arguments: argparse.Namespace) -> None:
    """Search and print.

    Raises:
        AtlasError, ParamError: bad input; one line.
    """
    params = search_params.load(arguments.params)
    if not arguments.best:
        params = replace(params, vote_mode="seed", confirm_edges=0)
    path = shipped_atlases.find(arguments.atlas)
    atlas = atlas_file.load(path)
    if arguments.dart >= len(atlas.darts):
        raise AtlasError(f"{path}: there is no dart {arguments.dart}, allowed 0 to {len(atlas.darts) - 1}")
    localizer = AtlasLocalizer(atlas, params)
    robot = AtlasRobot(Surroundings.of(atlas), _exact(params), np.random.default_rng(0))
    estimate = localizer.start(robot.wake_up(arguments.dart))
    _print_row(localizer)
    while estimate.choice is not None and estimate.depth < DEEPEST:
        estimate = localizer.update(*robot.drive(estimate.choice.rank if estimate.depth else 0))
        _print_row(localizer)
    if len(estimate.dart) == 1:
        passed = " -> ".join(str(atlas.darts.node[dart]) for dart in localizer.path(int(estimate.dart[0])).tolist())
        print(f"The robot came by the nodes {passed}.")


def _exact(params: SearchParams) -> TrialParams:
    return TrialParams(noise_limit=0.0, angles=params.use_edge_angles and not params.document)


def _print_row(localizer: AtlasLocalizer) -> None:
    assert localizer.estimate is not None
    for line in forest_explanation.row(localizer, localizer.estimate):
        print(line)
    print()
