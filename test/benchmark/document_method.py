#!/usr/bin/env python3
"""The glass document alone (`method: document`) beside the default, and beside what lies between them.

    python test/benchmark/document_method.py                                       the simulated buildings
    python test/benchmark/document_method.py --log run.bag=floor.yaml --buildings  a log with ground truth alone
    python test/benchmark/document_method.py --seeds 1 --max-scans 100

A line for each building and log, and one for all buildings: means over the seeds. `paper` is the default with the plain
vote, `ranges` the default with weights by ranges cast for every particle: what is left between `document` and those is
scan registration and what comes with it. CPU is that of one scan. doc/method.md has the figures.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path
from typing import Callable, Dict, List, NamedTuple, Optional, Sequence

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np

sys.path.append(str(Path(__file__).resolve().parent))

import drives
import glass_buildings
from glass_nav import params
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.replay import prepared_replay
from glass_nav.replay.replay_options import ReplayOptions

METHODS = {  # name -> parameters, and its name in baselines.py
    "document": ("method: document", "document"),
    "paper": ("vote_mode: paper", "ours_paper"),
    "ranges": ("weight_mode: ranges", "ours_ranges"),
    "default": ("", "ours"),
}


class Result(NamedTuple):
    """Of one drive."""

    accuracy: Optional[float]  # None: the log does not have the truth about its beams
    macro_f1: Optional[float]
    position_mean_m: float
    position_p95_m: float
    yaw_mean_deg: float
    cpu_ms: float  # of a scan


def in_building(method: str, building: str, lidar: str, seed: int, max_scans: Optional[int]) -> Result:
    """One simulated drive."""
    settings = params.load(LocalizerParams, {}, "document_method")
    job = glass_buildings.Job(building, lidar, seed, 0.0, max_scans, (METHODS[method][1],), settings)
    (run,) = glass_buildings.run(job)
    assert run.cases is not None
    cases = run.cases.metrics()
    pose = {name: value if value is not None else np.nan for name, value in run.pose.items()}
    return Result(
        cases["accuracy_answered"],
        cases["macro_f1"],
        pose["position_mean_m"],
        pose["position_p95_m"],
        pose["yaw_mean_deg"],
        1e3 * run.cpu_s / run.scans,
    )


def in_log(method: str, log: Path, map_file: Path, seed: int) -> Result:
    """One replay of a log with ground truth."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "params.yaml"
        file.write_text(METHODS[method][0] + "\n")
        ready = prepared_replay.prepare(ReplayOptions((log,), map_file, file, seed))
        metrics = ready.run().metrics()
    return Result(
        None,
        None,
        metrics["position_mean_m"],
        metrics["position_p95_m"],
        metrics["yaw_mean_deg"],
        metrics["cpu_ms_per_scan"],
    )


def line(where: str, method: str, results: Sequence[Result]) -> str:
    def mean(field: str, digits: int) -> str:
        values = [getattr(each, field) for each in results if getattr(each, field) is not None]
        return f"{np.mean(values):.{digits}f}" if values else "-"

    figures = [mean(name, 3) for name in ("accuracy", "macro_f1", "position_mean_m", "position_p95_m", "yaw_mean_deg")]
    return f"| {where} | {method} | " + " | ".join([*figures, mean("cpu_ms", 1)]) + " |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--buildings", nargs="*", default=None, metavar="NAME", help="default: all in maps/")
    parser.add_argument("--lidar", default="weak", choices=drives.lidars())
    parser.add_argument("--log", action="append", default=[], metavar="LOG=MAP", help="a log with ground truth")
    parser.add_argument("--methods", nargs="+", default=list(METHODS), choices=list(METHODS))
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--max-scans", type=int, metavar="N", help="of each simulated drive")
    args = parser.parse_args()
    buildings = drives.buildings() if args.buildings is None else args.buildings
    seeds = range(args.first_seed, args.first_seed + args.seeds)
    drive: Dict[str, Callable[[str, int], Result]] = {
        name: lambda method, seed, name=name: in_building(method, name, args.lidar, seed, args.max_scans)  # type: ignore[misc]
        for name in buildings
    }
    for log, _, map_file in (text.partition("=") for text in args.log):
        drive[Path(log).stem] = lambda method, seed, log=log, on=map_file: in_log(method, Path(log), Path(on), seed)  # type: ignore[misc]
    print("| where | method | case accuracy | macro F1 | position mean m | p95 m | yaw mean deg | CPU ms |")
    print("|---|---|---|---|---|---|---|---|")
    pooled: Dict[str, List[Result]] = {method: [] for method in args.methods}
    for where, results_of in drive.items():
        for method in args.methods:
            results = [results_of(method, seed) for seed in seeds]
            pooled[method] += results if where in buildings else []
            print(line(where, method, results), flush=True)
    for method in args.methods if len(buildings) > 1 else ():
        print(line("all buildings", method, pooled[method]))


if __name__ == "__main__":
    main()
