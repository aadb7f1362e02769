#!/usr/bin/env python3
"""Is the confidence in ~status calibrated? Of the poses reported as right at 90 %, 90 % should be right.

    python test/benchmark/reliability.py --out reliability/              every track, 3 seeds: table, plot, figures
    python test/benchmark/reliability.py --tracks intel glass_office --first-seed 200

Each track and seed has three drives: one in which the robot is kidnapped after 5 m, one that starts with a wrong
pose (AMCL's default uncertainty around a free cell drawn at random) and one without a guess. A pose is right within
0.7 m and 20 degrees. Prints the reported against the true share in ten classes, the mean difference weighted by counts
(expected calibration error), and the share of wrong poses among those reported LOCALIZED.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import sys
from pathlib import Path
from typing import List, NamedTuple, Tuple

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):  # a process a core: threads would fight for them
    os.environ.setdefault(name, "1")

import numpy as np

import global_localization
import tracks
from glass_nav.localization.localizer import Localizer
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.vocabulary import LocalizationState

AFTER_M = 10.0  # driven after each beginning
WRONG_START = np.diag([0.25, 0.25, (np.pi / 12.0) ** 2])
CLASSES = np.linspace(0.0, 1.0, 11)


class Told(NamedTuple):
    """One pose that was published."""

    reliability: float
    right: bool
    localized: bool


def carried(track: tracks.Track, rng: np.random.Generator) -> List[Told]:
    moments, down = tracks.carried_away(track, rng, global_localization.KNOWN_M)
    localizer = Localizer(LocalizerParams(), track.grid_map, rng)
    localizer.set_pose(moments[0].map_from_base, global_localization.COVARIANCE)
    after = int(np.searchsorted(tracks.ways(moments[down:]), AFTER_M))
    return _follow(localizer, moments[: down + after])


def started_wrong(track: tracks.Track, rng: np.random.Generator) -> List[Told]:
    localizer = Localizer(LocalizerParams(), track.grid_map, rng)
    rows, columns = np.nonzero(track.grid_map.free)
    cell = int(rng.integers(len(rows)))
    localizer.set_pose(
        np.append(track.grid_map.centres(rows[cell], columns[cell]), rng.uniform(-np.pi, np.pi)), WRONG_START
    )
    start = tracks.start_of(track, rng)
    return _follow(localizer, [moment for _, moment in tracks.moments_of(track, start, AFTER_M)])


def without_guess(track: tracks.Track, rng: np.random.Generator) -> List[Told]:
    localizer = Localizer(LocalizerParams(), track.grid_map, rng)
    localizer.scatter()
    start = tracks.start_of(track, rng)
    return _follow(localizer, [moment for _, moment in tracks.moments_of(track, start, AFTER_M)])


def _follow(localizer: Localizer, moments: List[tracks.Moment]) -> List[Told]:
    reported = []
    for moment in moments:
        estimate = localizer.update(moment.scan, moment.odom_from_base)
        if estimate.updated:
            reported.append(
                Told(
                    float(estimate.confidence),
                    tracks.is_right(estimate.map_from_base, moment.map_from_base),
                    estimate.state == LocalizationState.LOCALIZED,
                )
            )
    return reported


def run(job: Tuple[str, int]) -> List[Told]:
    """All three drives of one track and seed."""
    name, seed = job
    track = tracks.load(name, seed if name not in tracks.LOGS else 0)
    rng = np.random.default_rng(seed)
    return carried(track, rng) + started_wrong(track, rng) + without_guess(track, rng)


def table(reported: np.ndarray, right: np.ndarray) -> Tuple[List[str], float]:
    """Rows of the table, and the expected calibration error."""
    which = np.clip(np.digitize(reported, CLASSES) - 1, 0, len(CLASSES) - 2)
    rows, error = [], 0.0
    for index in range(len(CLASSES) - 1):
        chosen = which == index
        if chosen.any():
            rows.append(
                f"| {CLASSES[index]:.1f} to {CLASSES[index + 1]:.1f} | {reported[chosen].mean():.2f} | "
                f"{right[chosen].mean():.2f} | {int(chosen.sum())} |"
            )
            error += chosen.mean() * abs(reported[chosen].mean() - right[chosen].mean())
    return rows, float(error)


def draw(reported: np.ndarray, right: np.ndarray, path: Path) -> None:
    """The reliability plot: reported against true, and how often each was reported."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    which = np.clip(np.digitize(reported, CLASSES) - 1, 0, len(CLASSES) - 2)
    used = [index for index in range(len(CLASSES) - 1) if np.any(which == index)]
    figure, (axes, counts) = plt.subplots(2, 1, figsize=(5, 6), sharex=True, gridspec_kw={"height_ratios": [3, 1]})
    axes.plot([0, 1], [0, 1], color="0.6", label="reported = true")
    axes.plot(
        [reported[which == index].mean() for index in used], [right[which == index].mean() for index in used], "o-"
    )
    axes.set(ylabel="share of the poses that are right", ylim=(-0.02, 1.02))
    axes.legend()
    counts.hist(reported, bins=CLASSES, color="0.5")
    counts.set(xlabel="reliability that is reported", ylabel="poses", yscale="log")
    figure.tight_layout()
    figure.savefig(str(path), dpi=110)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tracks", nargs="+", choices=tracks.names(), default=tracks.names(), metavar="NAME")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, help="folder for reliability.png and reliability.json")
    arguments = parser.parse_args()
    jobs = [
        (name, seed)
        for name in arguments.tracks
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds)
    ]
    with multiprocessing.Pool(arguments.jobs) as pool:
        everything = [reported for each in pool.imap(run, jobs) for reported in each]
    reported = np.array([each.reliability for each in everything])
    right = np.array([each.right for each in everything])
    localized = np.array([each.localized for each in everything])
    rows, error = table(reported, right)
    print("| reported | mean reported | right | poses |\n|---|---|---|---|\n" + "\n".join(rows))
    print(
        f"\nexpected calibration error {error:.3f} over {len(reported)} poses; wrong among LOCALIZED "
        f"{np.mean(~right[localized]):.4f} of {int(localized.sum())}"
    )
    if arguments.out is not None:
        arguments.out.mkdir(parents=True, exist_ok=True)
        draw(reported, right, arguments.out / "reliability.png")
        (arguments.out / "reliability.json").write_text(
            json.dumps({"error": error, "reported": reported.tolist(), "right": right.tolist()})
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
