#!/usr/bin/env python3
"""All real logs x seeds through the filter, next to AMCL's figures: a markdown table and a JSON file.

    python test/benchmark/replay_logs.py                         5 seeds, one process
    python test/benchmark/replay_logs.py --jobs 2 --seeds 3 --logs uob_trace0 olin_mac --out figures.json
    python test/benchmark/replay_logs.py --set laser_max_beams=90 --set vote_mode=paper
    python test/benchmark/replay_logs.py --even                  maps of the even scans, errors of the odd ones

Starts as AMCL did for its figures: at the first reference pose. The logs are in GLASS_NAV_DATA (default
../shared/data beside the repository), the rawlog comes with apt's mrpt-common. A log is read once per process.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import sys
import time
from functools import lru_cache
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Tuple

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):  # a process a core: threads would fight for them
    os.environ.setdefault(name, "1")

import numpy as np
import yaml

from glass_nav import params
from glass_nav.replay import replay_run
from glass_nav.evaluation.metrics import pose_errors
from glass_nav.localization.localizer import Localizer
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.recording.log_file import open_log
from glass_nav.recording.recording import LogOptions, Recording
from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap

DATA = Path(os.environ.get("GLASS_NAV_DATA", Path(__file__).resolve().parents[3] / "shared" / "data"))
MRPT_DATA = Path("/usr/share/mrpt/datasets")
COVARIANCE = np.diag([0.25, 0.25, (np.pi / 12.0) ** 2])  # AMCL's default


class Peer(NamedTuple):
    """The results of another localizer on the log, from INDEX.md beside the data."""

    rmse_m: float
    lost_1m_share: float


PEERS = {  # AMCL 1.17.3, the better of two parameter sets; on the uwb log MRPT's pf-localization
    "intel": Peer(0.247, 0.006),
    "mit_csail": Peer(0.182, 0.0),
    "aces": Peer(0.147, 0.0),
    "acapulco": Peer(0.284, 0.006),
    "seattle": Peer(0.611, 0.066),
    "uob_trace0": Peer(0.085, 0.0),
    "wean1": Peer(0.154, 0.0),
    "wean2": Peer(0.185, 0.0),
    "wean4": Peer(0.229, 0.0),
    "olin_mac": Peer(0.059, 0.0),
    "mit_racecar2": Peer(0.097, 0.0),
    "uwb": Peer(0.149, 0.0),
}


def files(name: str, even: bool) -> Tuple[Path, Path]:
    """The log and its map, or the map drawn by only the even scans of the log."""
    if name == "uwb":
        stem = "uwb_ro-localization_demo"
        return MRPT_DATA / f"{stem}.rawlog", MRPT_DATA / f"{stem}_map.gridmap.gz"
    return DATA / "logs" / name / f"{name}.bag", DATA / "logs" / name / ("map_even.yaml" if even else "map.yaml")


@lru_cache(maxsize=None)
def load(name: str, even: bool) -> Tuple[Recording, GridMap]:
    log, grid = files(name, even)
    return open_log(log, LogOptions()).in_memory(), map_file.load(grid)


def run(job: Tuple[str, int, LocalizerParams, bool]) -> Dict[str, Any]:
    """One log, one seed."""
    name, seed, settings, even = job
    recording, grid_map = load(name, even)
    truth = recording.ground_truth
    assert truth is not None
    localizer = Localizer(settings, grid_map, np.random.default_rng(seed))
    result = replay_run.run(
        recording, localizer, lambda stamp: localizer.set_pose(truth.at(np.int64(stamp)), COVARIANCE), seed
    )
    figures = {"log": name, **result.metrics()}
    if even:
        errors = result.errors
        figures.update(pose_errors.summary(pose_errors.PoseErrors(errors.position_m[1::2], errors.yaw_rad[1::2])))
    return figures


def row(name: str, runs: List[Dict[str, Any]]) -> str:
    """A line of the table: means over the seeds."""

    def mean(key: str) -> float:
        return float(np.mean([np.inf if each[key] is None else each[key] for each in runs]))

    rmse = [np.inf if each["position_rmse_m"] is None else each["position_rmse_m"] for each in runs]
    lost = [each["lost_1m_share"] for each in runs]
    peer = PEERS[name]
    ratio = float(np.mean(rmse)) / peer.rmse_m
    marks = "".join([" > peer" if ratio > 1.0 else "", " LOST" if max(lost) > peer.lost_1m_share else ""])
    return (
        f"| {name} | {np.mean(rmse):.3f} ({min(rmse):.3f}..{max(rmse):.3f}) | {mean('position_median_m'):.3f} | "
        f"{mean('position_p95_m'):.3f} | {mean('yaw_mean_deg'):.2f} | {np.mean(lost):.3f} ({max(lost):.3f}) | "
        f"{peer.rmse_m:.3f} | {peer.lost_1m_share:.3f} | {ratio:.2f}{marks} | {mean('cpu_ms_per_scan'):.1f} |"
    )


HEADER = (
    "| log | rmse m (min..max) | median m | p95 m | yaw mean deg | > 1 m (max) | AMCL rmse m | AMCL > 1 m | "
    "ratio | ms/scan |\n|---|---|---|---|---|---|---|---|---|---|"
)


def settings_from(path: Optional[Path], assignments: List[str]) -> LocalizerParams:
    mapping: Dict[str, Any] = {}
    if path is not None:
        mapping.update(yaml.safe_load(path.read_text()) or {})
    for assignment in assignments:
        name, _, value = assignment.partition("=")
        mapping[name] = yaml.safe_load(value)
    known = set(params.names(LocalizerParams))
    if path is not None:  # a node's file has names of the node as well
        mapping = {
            name: value
            for name, value in mapping.items()
            if name in known or name in {each.partition("=")[0] for each in assignments}
        }
    return params.load(LocalizerParams, mapping, "replay_logs")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--logs", nargs="+", choices=sorted(PEERS), default=list(PEERS), metavar="NAME", help=" ".join(PEERS)
    )
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--even", action="store_true", help="only the logs that have a map_even.yaml, with it")
    parser.add_argument("--params", type=Path, help="yaml of parameters")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="one parameter")
    parser.add_argument("--out", type=Path, help="JSON with all figures of all runs")
    arguments = parser.parse_args()
    settings = settings_from(arguments.params, arguments.set)
    logs = [
        name
        for name in arguments.logs
        if not arguments.even or files(name, True)[1].name == "map_even.yaml" and files(name, True)[1].is_file()
    ]
    jobs = [
        (name, seed, settings, arguments.even)
        for name in logs
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds)
    ]
    runs: Dict[str, List[Dict[str, Any]]] = {name: [] for name in logs}
    began = time.monotonic()
    print(HEADER, flush=True)
    with multiprocessing.Pool(arguments.jobs) as pool:  # imap keeps the order: a row is printed when complete
        for figures in pool.imap(run, jobs):
            runs[figures["log"]].append(figures)
            if len(runs[figures["log"]]) == arguments.seeds:
                print(row(figures["log"], runs[figures["log"]]), flush=True)
    print(
        f"\n{arguments.seeds} seeds, {time.monotonic() - began:.0f} s with {arguments.jobs} processes", file=sys.stderr
    )
    if arguments.out is not None:
        arguments.out.write_text(json.dumps({"params": params.as_mapping(settings), "runs": runs}, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
