#!/usr/bin/env python3
r"""Which settings suit each baseline best? This chose those in baselines.SETTINGS.

    python test/benchmark/tune_baselines.py --buildings glass_office glass_bridge glass_atrium --lidars weak \
        --max-scans 150
    python test/benchmark/tune_baselines.py --localizers amcl_field60 --buildings glass_office

A table for each baseline, best first: by the geometric mean of position rmse and mean yaw error over all drives.
"""

from __future__ import annotations

import argparse
import itertools
import multiprocessing
import sys
from pathlib import Path
from typing import Dict, List, Tuple

sys.path.append(str(Path(__file__).resolve().parent))

import glass_buildings  # first: it limits the threads of numpy

import drives
import numpy as np
from baselines import Settings
from glass_nav.localization.localizer_params import LocalizerParams

SIGMAS_M = (0.05, 0.1, 0.2)
HITS = {"field": ((0.95, 0.05, 0.0), (0.5, 0.5, 0.0)), "beam": ((0.7, 0.2, 0.1), (0.5, 0.5, 0.0))}  # hit, random, short
BEAMS = {
    "amcl_field60": ((60, None), (60, 20.0)),
    "amcl_beam60": ((60, None), (60, 20.0)),  # at most, independent
    "amcl_field_all": ((None, None), (None, 120.0), (None, 40.0)),
    "amcl_beam_all": ((None, 120.0), (None, 40.0)),
    "ours_field": ((60, 40.0), (None, 120.0)),
    "ours_beam": ((60, 40.0), (None, 120.0)),
}


def candidates(name: str) -> List[Settings]:
    hits = HITS["field" if "field" in name else "beam"]
    return [
        Settings(sigma, hit, rand, beams, independent, short)
        for sigma, (hit, rand, short), (beams, independent) in itertools.product(SIGMAS_M, hits, BEAMS[name])
    ]


def run(job: glass_buildings.Job) -> List[Tuple[str, Settings, float, float]]:
    """Position rmse [m] and mean yaw error [deg] of all candidates on one drive."""
    drive = drives.drive(job.building, job.lidar, job.seed, job.changed, job.max_scans)
    found = []
    for name in job.localizers:
        for settings in candidates(name):
            pose = glass_buildings.follow(name, job, drive, settings).pose
            found.append((name, settings, pose["position_rmse_m"] or np.inf, pose["yaw_mean_deg"] or np.inf))
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--buildings", nargs="+", default=drives.buildings(), metavar="NAME")
    parser.add_argument("--lidars", nargs="+", default=drives.lidars(), metavar="PRESET")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--first-seed", type=int, default=100)
    parser.add_argument("--localizers", nargs="+", choices=list(BEAMS), default=list(BEAMS), metavar="NAME")
    parser.add_argument("--max-scans", type=int, metavar="N")
    parser.add_argument("--jobs", type=int, default=1)
    arguments = parser.parse_args()
    jobs = [
        glass_buildings.Job(
            building, lidar, seed, 0.0, arguments.max_scans, tuple(arguments.localizers), LocalizerParams()
        )
        for building in arguments.buildings
        for lidar in arguments.lidars
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds)
    ]
    figures: Dict[Tuple[str, Settings], List[Tuple[float, float]]] = {}
    with multiprocessing.Pool(arguments.jobs) as pool:
        for found in pool.imap_unordered(run, jobs):
            for name, settings, position_m, yaw_deg in found:
                figures.setdefault((name, settings), []).append((position_m, yaw_deg))
    for name in arguments.localizers:
        print(
            f"\n{name}\n| sigma m | z hit | z rand | z short | beams | count as | rmse m | yaw mean deg | "
            "worst rmse m |\n|" + "---|" * 9
        )
        rows = {settings: np.array(figures[name, settings]) for settings in candidates(name)}
        for settings, values in sorted(rows.items(), key=lambda row: np.log(row[1].mean(axis=0)).sum()):
            print(
                f"| {settings.sigma_hit_m:g} | {settings.z_hit:g} | {settings.z_rand:g} | {settings.z_short:g} | "
                f"{settings.max_beams or 'all'} | {settings.independent_beams or 'as many'} | "
                f"{values[:, 0].mean():.4f} | {values[:, 1].mean():.3f} | {values[:, 0].max():.3f} |"
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
