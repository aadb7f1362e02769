"""glass_nav atlas wake-up: simulates robots that search in an atlas."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Dict, Optional

from glass_nav import params
from glass_nav.cli import out_file, search_params
from glass_nav.cli.progress import Progress
from glass_nav.evaluation.metrics import replay_result
from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.topology.search import wake_up_trials
from glass_nav.topology.search.atlas_robot import TrialParams

HELP = "simulate robots that wake up in an atlas"
DESCRIPTION = """Simulates robots that wake up anywhere in an atlas, measure with the errors that the tolerances assume,
and take the turns that the search chooses. Writes metrics.json: shares of robots that end CONFIRMED at the right or at a
wrong place, AMBIGUOUS, LOST, or still searching; edges driven; CPU time of the slowest step."""
EXAMPLES = (
    "glass_nav atlas wake-up glass_office --trials 100",
    "glass_nav atlas wake-up atlas/floor --missed 0.1 --out results",
)

FILE = "metrics.json"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the subcommand."""
    parser.add_argument(
        "atlas", metavar="ATLAS", help="atlas.json, atlas.npz, the folder of one, or the name of a shipped one"
    )
    parser.add_argument("--trials", type=int, default=1000, metavar="N", help="number of robots (default 1000)")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of the random numbers (default 0)")
    parser.add_argument("--missed", type=float, default=0.0, metavar="P", help="probability of missing a meetpoint")
    parser.add_argument(
        "--spurious",
        type=float,
        default=0.0,
        metavar="P",
        help="probability of a spurious meetpoint on an edge",
    )
    parser.add_argument(
        "--noise",
        type=float,
        default=1.0,
        metavar="X",
        help="measurement errors as a multiple of those that the tolerances assume (default 1)",
    )
    parser.add_argument(
        "--elsewhere",
        action="store_true",
        help="put the robots into another building, made of the same parts put together differently",
    )
    parser.add_argument(
        "--max-edges",
        type=int,
        default=100,
        metavar="N",
        help="a robot gives up after this number of edges (default 100)",
    )
    parser.add_argument("--params", type=Path, metavar="FILE", help="yaml of parameters, names as for topology_node")
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("."),
        metavar="DIR",
        help=f"folder for {FILE}, or the file (default .)",
    )


def usage_error(arguments: argparse.Namespace) -> Optional[str]:
    """What is wrong with the options as such, before any file is opened."""
    for name, least in (("trials", 1), ("seed", 0), ("max_edges", 1)):
        if getattr(arguments, name) < least:
            return f"--{name.replace('_', '-')} must be >= {least}, got {getattr(arguments, name)}"
    for name in ("missed", "spurious"):
        if not 0.0 <= getattr(arguments, name) < 1.0:
            return f"--{name} must be in [0, 1), got {getattr(arguments, name)}"
    if not 0.0 <= arguments.noise < 100.0:
        return f"--noise must be in [0, 100), got {arguments.noise}"
    return None


def main(arguments: argparse.Namespace) -> None:
    """Run, write, print.

    Raises:
        AtlasError, ParamError, OSError: bad input; one line.
    """
    search = search_params.load(arguments.params)
    path = shipped_atlases.find(arguments.atlas)
    atlas = atlas_file.load(path)
    robots = TrialParams(
        noise=search.tolerances,
        noise_gain=arguments.noise,
        missed=arguments.missed,
        spurious=arguments.spurious,
        max_edges=arguments.max_edges,
    )
    progress = Progress("wake-up", arguments.trials, unit="robots")
    done = []
    try:
        for trial in wake_up_trials.trials(
            atlas, search, robots, arguments.trials, arguments.seed, arguments.elsewhere
        ):
            done.append(trial)
            progress.step()
    finally:
        progress.finish()
    figures = wake_up_trials.metrics(done)
    out = out_file.in_folder(arguments.out, FILE)
    replay_result.write_json(
        out,
        {
            **figures,
            "atlas": str(path),
            "seed": arguments.seed,
            "elsewhere": arguments.elsewhere,
            "missed": arguments.missed,
            "spurious": arguments.spurious,
            "noise": arguments.noise,
            "params": params.as_mapping(search),
        },
    )
    print(_table(figures))
    print(f"written to {out}")


def _table(figures: Dict[str, float]) -> str:
    shares = ", ".join(
        f"{name} {100.0 * figures[f'{name}_share']:.2f} %"
        for name in ("confirmed", "wrong", "ambiguous", "lost", "undecided")
    )
    return (
        f"{figures['trials']:.0f} robots: {shares}\n{figures['edges_mean']:.1f} edges on average, 95 % within "
        f"{figures['edges_p95']:.0f}; slowest step {figures['step_ms_max']:.1f} ms CPU"
    )
