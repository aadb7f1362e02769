#!/usr/bin/env python3
"""Glass learnt from real logs, against the cells that the logs' own beams pass through.

    python test/benchmark/glass_map.py                      uob_trace0 olin_mac mit_csail intel aces seattle
    python test/benchmark/glass_map.py --logs intel --seeds 3 --pictures DIR

Each log is replayed once per seed; then a cell counts as glass from --threshold percent on. Precision and recall are
within 0.15 m of see_through_mask.yaml beside the log: evidence of the same drive, so they measure agreement, not truth.
Logs without a mask only show the share of wall cells that counts as glass. The logs are in GLASS_NAV_DATA.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path
from typing import Any, Dict, List, Optional

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np

from glass_nav import params
from glass_nav.replay import replay_run
from glass_nav.evaluation.metrics import glass_agreement
from glass_nav.localization.localizer import Localizer
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.recording.log_file import open_log
from glass_nav.recording.recording import LogOptions
from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap

DATA = Path(os.environ.get("GLASS_NAV_DATA", Path(__file__).resolve().parents[3] / "shared" / "data"))
COVARIANCE = np.diag([0.25, 0.25, (np.pi / 12.0) ** 2])  # AMCL's default


def learnt(name: str, seed: int, settings: LocalizerParams) -> "tuple[GridMap, np.ndarray, Any]":
    """The map of a log, its glass map (H, W) [percent] after one replay, and the result."""
    folder = DATA / "logs" / name
    recording, grid_map = open_log(folder / f"{name}.bag", LogOptions()), map_file.load(folder / "map.yaml")
    truth = recording.ground_truth
    assert truth is not None
    localizer = Localizer(settings, grid_map, np.random.default_rng(seed))
    result = replay_run.run(
        recording, localizer, lambda stamp: localizer.set_pose(truth.at(np.int64(stamp)), COVARIANCE), seed
    )
    return grid_map, localizer.glass_map.occupancy(), result


def see_through(name: str) -> Optional[np.ndarray]:
    """(M, 2) [m] centres of the cells that the log's beams pass through; None without a mask."""
    path = DATA / "logs" / name / "see_through_mask.yaml"
    if not path.is_file():
        return None
    mask = map_file.load(path)
    return mask.centres(*np.nonzero(mask.occupied))


def draw(path: Path, grid_map: GridMap, percent: np.ndarray, other_m: Optional[np.ndarray], result: Any) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12, 10), dpi=90, constrained_layout=True)
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    walls = grid_map.centres(*np.nonzero(grid_map.occupied))
    axes.scatter(*walls.T, s=1, c="0.75", label="walls")
    rows, columns = np.nonzero(percent >= 0)
    points = axes.scatter(
        *grid_map.centres(rows, columns).T, s=4, c=percent[rows, columns], cmap="coolwarm", vmin=0, vmax=100
    )
    if other_m is not None:
        axes.scatter(*other_m.T, s=30, facecolors="none", edgecolors="k", linewidths=0.6, label="seen through")
    axes.plot(*result.map_from_base[:, :2].T, "g-", lw=0.6)
    figure.colorbar(points, label="glass [%]")
    axes.legend()
    axes.set_aspect("equal")
    centre = result.map_from_base[:, :2].mean(axis=0)
    axes.set_xlim(centre[0] - 20, centre[0] + 20)
    axes.set_ylim(centre[1] - 17, centre[1] + 17)
    figure.savefig(path)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--logs", nargs="+", default=["uob_trace0", "olin_mac", "mit_csail", "intel", "aces", "seattle"]
    )
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--threshold", type=float, default=50.0, help="percent from which a cell is called glass")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="one parameter")
    parser.add_argument("--pictures", type=Path, metavar="DIR")
    parser.add_argument("--out", type=Path, help="JSON")
    arguments = parser.parse_args()
    given = {name: json.loads(value) for name, _, value in (each.partition("=") for each in arguments.set)}
    settings = params.load(LocalizerParams, given, "glass_map")
    rows: List[Dict[str, Any]] = []
    print(
        "| log | seed | glass cells | share of walls | seen through | precision | recall | case 3 | case 4 | case 2 "
        "|\n"
        "|---|---|---|---|---|---|---|---|---|---|"
    )
    for name in arguments.logs:
        other_m = see_through(name)
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds):
            grid_map, percent, result = learnt(name, seed, settings)
            told_m = grid_map.centres(*np.nonzero(percent >= arguments.threshold))
            agreement = glass_agreement.of(
                told_m, np.zeros((0, 2)) if other_m is None else other_m, int(grid_map.occupied.sum())
            )
            share = result.metrics()["case_share"]
            rows.append({"log": name, "seed": seed, **agreement.summary(), "case_share": share})
            print(
                f"| {name} | {seed} | {agreement.reported} | {100 * agreement.wall_share:.2f} % | "
                + (
                    f"{agreement.other} | {agreement.precision:.2f} | {agreement.recall:.2f}"
                    if other_m is not None
                    else "no mask | – | –"
                )
                + f" | {share['3']:.3f} | {share['4']:.3f} | {share['2']:.3f} |",
                flush=True,
            )
            if arguments.pictures is not None:
                arguments.pictures.mkdir(parents=True, exist_ok=True)
                draw(arguments.pictures / f"{name}_{seed}.png", grid_map, percent, other_m, result)
    if arguments.out is not None:
        arguments.out.write_text(json.dumps({"params": params.as_mapping(settings), "runs": rows}, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
