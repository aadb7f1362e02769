#!/usr/bin/env python3
"""Finding the robot: from anywhere on the map, after it was kidnapped, and in a building that is not on the map.

    python test/benchmark/global_localization.py                       all tasks, 10 seeds, every log and building
    python test/benchmark/global_localization.py --tasks global --tracks intel glass_bridge --seeds 3
    python test/benchmark/global_localization.py --tasks kidnap --first-seed 200 --out figures.json

global: starts in the first third of the track without a guess; found when ~status first reports LOCALIZED, right if
that is within 0.7 m and 20 degrees. kidnap: kidnapped to another moment of the same track, at least two metres away or
turned; measures when LOCALIZED is left and when the right place is LOCALIZED again. elsewhere: the track with the map
of another one. Exit code 1 if a bar is missed.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import sys
import time
from pathlib import Path
from typing import Any, Dict, List, Optional, Tuple

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):  # a process a core: threads would fight for them
    os.environ.setdefault(name, "1")

import numpy as np

import tracks
from glass_nav.localization.localizer import Localizer
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.vocabulary import LocalizationState

MAX_M = 60.0  # of a search
KNOWN_M = 5.0  # driven with the right pose before the robot is kidnapped
LEFT_M = 3.0  # within which LOCALIZED has to be left
BACK_M = 30.0  # within which the right place has to be found again
COVARIANCE = np.diag([0.05, 0.05, 0.01])

Job = Tuple[str, str, int]


def find(track: tracks.Track, seed: int) -> Dict[str, Any]:
    """A start from anywhere."""
    rng = np.random.default_rng(seed)
    start = tracks.start_of(track, rng)
    localizer = Localizer(LocalizerParams(), track.grid_map, rng)
    localizer.scatter()
    found_m: Optional[float] = None
    wrong = right_now = False
    last_m = 0.0
    for way_m, moment in tracks.moments_of(track, start, MAX_M):
        estimate = localizer.update(moment.scan, moment.odom_from_base)
        right_now = tracks.is_right(estimate.map_from_base, moment.map_from_base)
        last_m = way_m
        if estimate.state == LocalizationState.LOCALIZED:
            wrong = wrong or not right_now
            found_m = way_m if found_m is None else found_m
            if way_m > found_m + 3.0:
                break
    return {
        "found_m": found_m,
        "right": found_m is not None and not wrong,
        "wrong": wrong,
        "leads": right_now,
        "driven_m": last_m,
        "start": start,
    }


def kidnap(track: tracks.Track, seed: int) -> Dict[str, Any]:
    """A kidnapped robot."""
    rng = np.random.default_rng(seed)
    moments, down = tracks.carried_away(track, rng, KNOWN_M)
    localizer = Localizer(LocalizerParams(), track.grid_map, rng)
    localizer.set_pose(moments[0].map_from_base, COVARIANCE)
    before = [localizer.update(moment.scan, moment.odom_from_base).state for moment in moments[:down]]
    left_m: Optional[float] = None
    back_m: Optional[float] = None
    for way_m, moment in zip(tracks.ways(moments[down:]), moments[down:]):
        if way_m > BACK_M:
            break
        estimate = localizer.update(moment.scan, moment.odom_from_base)
        right = tracks.is_right(estimate.map_from_base, moment.map_from_base)
        if left_m is None and (estimate.state != LocalizationState.LOCALIZED or right):
            left_m = float(way_m)
        if estimate.state == LocalizationState.LOCALIZED and right:
            back_m = float(way_m)
            break
    return {
        "localized_before": before[-1] == LocalizationState.LOCALIZED,
        "left_m": left_m,
        "back_m": back_m,
        "left": left_m is not None and left_m <= LEFT_M,
        "back": back_m is not None,
    }


def elsewhere(track: tracks.Track, seed: int) -> Dict[str, Any]:
    """With the map of the next track: the robot is nowhere on it."""
    rng = np.random.default_rng(seed)
    others = [name for name in tracks.names() if name != track.name and not _same_house(name, track.name)]
    other = others[int(rng.integers(len(others)))]
    grid_map = tracks.load(other, 0).grid_map
    localizer = Localizer(LocalizerParams(), grid_map, rng)
    localizer.scatter()
    wrong_m: Optional[float] = None
    way_m = 0.0
    for way_m, moment in tracks.moments_of(track, tracks.start_of(track, rng), 20.0):
        if localizer.update(moment.scan, moment.odom_from_base).state == LocalizationState.LOCALIZED:
            wrong_m = way_m
            break
    return {"map": other, "wrong": wrong_m is not None, "wrong_m": wrong_m, "driven_m": way_m}


def _same_house(name: str, other: str) -> bool:
    return name.startswith("wean") and other.startswith("wean")


TASKS = {"global": find, "kidnap": kidnap, "elsewhere": elsewhere}


def run(job: Job) -> Dict[str, Any]:
    """One task on one track with one seed."""
    task, name, seed = job
    began = time.process_time()
    track = tracks.load(name, seed if name not in tracks.LOGS else 0)
    loaded = time.process_time()
    figures = TASKS[task](track, seed)
    return {
        "task": task,
        "track": name,
        "seed": seed,
        **figures,
        "cpu_s": time.process_time() - loaded,
        "loading_s": loaded - began,
    }


def median(runs: List[Dict[str, Any]], key: str) -> str:
    values = [each[key] for each in runs if each[key] is not None]
    return f"{np.median(values):.1f}" if values else "-"


def count(runs: List[Dict[str, Any]], key: str) -> int:
    return sum(bool(each[key]) for each in runs)


def row(task: str, name: str, runs: List[Dict[str, Any]]) -> str:
    """A line of the table of a task."""
    if task == "global":
        return (
            f"| {name} | {count(runs, 'right')}/{len(runs)} | {count(runs, 'wrong')} | {median(runs, 'found_m')} | "
            f"{count(runs, 'leads')} | {median(runs, 'driven_m')} | {median(runs, 'cpu_s')} |"
        )
    if task == "kidnap":
        return (
            f"| {name} | {count(runs, 'localized_before')}/{len(runs)} | {count(runs, 'left')} | "
            f"{median(runs, 'left_m')} | {count(runs, 'back')} | {median(runs, 'back_m')} | "
            f"{median(runs, 'cpu_s')} |"
        )
    return f"| {name} | {count(runs, 'wrong')}/{len(runs)} | {median(runs, 'driven_m')} | {median(runs, 'cpu_s')} |"


HEADERS = {
    "global": "| track | right place | wrong LOCALIZED | found after m | right at the end | driven m | CPU s |\n"
    "|---|---|---|---|---|---|---|",
    "kidnap": "| track | LOCALIZED before | left within 3 m | left after m | right place again | after m | CPU s |\n"
    "|---|---|---|---|---|---|---|",
    "elsewhere": "| track | wrong LOCALIZED | driven m | CPU s |\n|---|---|---|---|",
}


def bars(task: str, runs: List[Dict[str, Any]]) -> bool:
    """Print the figures over all tracks against the bars; whether all are kept."""
    total = len(runs)

    def share(key: str) -> float:
        return count(runs, key) / total

    checks = {
        "global": [
            ("right place found", share("right") if task == "global" else 0.0, ">=", 0.95),
            ("wrong LOCALIZED", share("wrong") if "wrong" in runs[0] else 0.0, "<=", 0.0),
        ],
        "kidnap": [
            ("LOCALIZED left within 3 m", share("left") if task == "kidnap" else 0.0, ">=", 0.95),
            ("right place again", share("back") if task == "kidnap" else 0.0, ">=", 0.90),
        ],
        "elsewhere": [("wrong LOCALIZED", share("wrong") if "wrong" in runs[0] else 0.0, "<=", 0.0)],
    }[task]
    kept = True
    for what, value, sign, bar in checks:
        holds = value >= bar if sign == ">=" else value <= bar
        kept = kept and holds
        print(f"{task}: {what} {value:.3f} of {total} (bar {sign} {bar:g}): {'kept' if holds else 'MISSED'}")
    return kept


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tasks", nargs="+", choices=sorted(TASKS), default=["global", "kidnap", "elsewhere"])
    parser.add_argument("--tracks", nargs="+", choices=tracks.names(), default=tracks.names(), metavar="NAME")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, help="JSON with the figures of all runs")
    arguments = parser.parse_args()
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.seeds)
    everything: List[Dict[str, Any]] = []
    kept = True
    with multiprocessing.Pool(arguments.jobs) as pool:  # imap keeps the order: a row is printed when complete
        for task in arguments.tasks:
            print(f"\n{HEADERS[task]}", flush=True)
            jobs: List[Job] = [(task, name, seed) for name in arguments.tracks for seed in seeds]
            runs: List[Dict[str, Any]] = []
            for figures in pool.imap(run, jobs):
                runs.append(figures)
                if len(runs) % arguments.seeds == 0:
                    print(row(task, figures["track"], runs[-arguments.seeds :]), flush=True)
            kept = bars(task, runs) and kept
            everything += runs
    if arguments.out is not None:
        arguments.out.write_text(json.dumps(everything, indent=1))
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
