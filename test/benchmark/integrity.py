#!/usr/bin/env python3
"""Does the filter ever mislead? Real logs and simulated buildings, kidnaps and false starts: a table of the bars.

    python test/benchmark/integrity.py                                   every track and drive, one seed
    python test/benchmark/integrity.py --tracks intel glass_office --first-seed 20 --seeds 3 --drives tracked
    python test/benchmark/integrity.py --max-scans 300 --reference intel=0.08:1.5

Drives: `tracked` starts at the true pose; in `kidnapped` the robot is set down elsewhere after 5 m; `false-start` begins
with a wrong pose and the uncertainty that an operator would give. In a building, the seed also determines lidar preset and
noise. Misleading: LOCALIZED, and the error along, across or in heading exceeds its 99.9 % protection level.

The reference of a real log is another estimator's and errs itself. --reference gives its standard deviations [m:deg]; they
are added in quadrature to covariance and levels (integrity_scores.IntegrityTrace.with_reference_deviation), so that an
error that the reference may have made is not held against the filter. The same excuse hides errors of the filter of that
size: figures of real logs say nothing below it. `--reference NAME=0:0` scores without. In buildings the truth is exact.

The band is that of the median NEES of a consistent filter: 3 degrees of freedom, one independent error each INDEPENDENT_M.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import sys
from typing import Callable, Dict, List, NamedTuple, Tuple

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):  # a process a core: threads would fight for them
    os.environ.setdefault(name, "1")

import numpy as np
from scipy import stats

import global_localization
import reliability
import tracks
from glass_nav.evaluation.metrics import integrity_scores
from glass_nav.evaluation.metrics.integrity_scores import IntegrityTrace
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.localization.localizer import Localizer
from glass_nav.localization.localizer_params import LocalizerParams

Reference = Tuple[float, float]  # standard deviations [m, deg]
REFERENCE: Dict[str, Reference] = dict.fromkeys(tracks.LOGS, (0.03, 0.7))  # "some centimetres against the map"
REFERENCE.update({name: (0.15, 1.5) for name in tracks.LOGS if name.startswith("wean")})  # "good to 0.3 m only"
INDEPENDENT_M = 2.0  # distance after which errors are others


class Job(NamedTuple):
    """One drive."""

    track: str
    drive: str
    seed: int
    max_scans: int
    reference: Reference


class Row(NamedTuple):
    """What a drive came to."""

    job: Job
    claims: IntegrityTrace


def tracked(track: tracks.Track, rng: np.random.Generator) -> Tuple[Localizer, List[tracks.Moment]]:
    localizer = Localizer(LocalizerParams(), track.grid_map, rng)
    localizer.set_pose(track.moments[0].map_from_base, global_localization.COVARIANCE)
    return localizer, track.moments


def kidnapped(track: tracks.Track, rng: np.random.Generator) -> Tuple[Localizer, List[tracks.Moment]]:
    moments, _ = tracks.carried_away(track, rng, global_localization.KNOWN_M)
    localizer = Localizer(LocalizerParams(), track.grid_map, rng)
    localizer.set_pose(moments[0].map_from_base, global_localization.COVARIANCE)
    return localizer, moments


def false_start(track: tracks.Track, rng: np.random.Generator) -> Tuple[Localizer, List[tracks.Moment]]:
    rows, columns = np.nonzero(track.grid_map.free)
    cell = int(rng.integers(len(rows)))
    wrong = np.append(track.grid_map.centres(rows[cell], columns[cell]), rng.uniform(-np.pi, np.pi))
    localizer = Localizer(LocalizerParams(), track.grid_map, rng)
    localizer.set_pose(wrong, reliability.WRONG_START)
    return localizer, track.moments[tracks.start_of(track, rng) :]


Start = Callable[[tracks.Track, np.random.Generator], Tuple[Localizer, List[tracks.Moment]]]
DRIVES: Dict[str, Start] = {"tracked": tracked, "kidnapped": kidnapped, "false-start": false_start}


def run(job: Job) -> Row:
    """One drive through the filter."""
    track = tracks.load(job.track, 0 if job.track in tracks.LOGS else job.seed)
    localizer, moments = DRIVES[job.drive](track, np.random.default_rng(job.seed))
    moments = moments[: job.max_scans or None]
    estimates = [localizer.update(moment.scan, moment.odom_from_base) for moment in moments]
    stamps_ns, first = np.unique([moment.scan.stamp_ns for moment in moments], return_index=True)
    true = np.array([moment.map_from_base for moment in moments])
    claims = integrity_scores.trace(
        np.array([each.stamp_ns for each in estimates], np.int64),
        np.array([each.map_from_base for each in estimates]),
        np.array([moment.odom_from_base for moment in moments]),
        [each.state for each in estimates],
        np.array([each.covariance for each in estimates]),
        np.array([each.levels.p95 for each in estimates]),
        np.array([each.levels.p999 for each in estimates]),
        Trajectory(stamps_ns, true[first]),
    )
    position_m, heading_deg = job.reference
    return Row(job, claims.with_reference_deviation(position_m, np.radians(heading_deg)))


def nees_band(driven_m: float) -> Tuple[float, float]:
    """95 % of the medians of a consistent filter lie in it, after that distance."""
    count = max(driven_m / INDEPENDENT_M, 1.0)
    law = stats.chi2(3)
    half = 1.96 * 0.5 / (law.pdf(law.median()) * np.sqrt(count))
    return max(law.median() - half, 0.0), law.median() + half


def line(title: str, rows: List[Row]) -> str:
    """A row of the table, over some drives."""
    each = [integrity_scores.summary(row.claims) for row in rows]
    every = np.concatenate([row.claims.error for row in rows])
    misleading = np.concatenate([row.claims.misleading for row in rows])
    localized = np.concatenate([row.claims.localized for row in rows])
    nees = np.concatenate([row.claims.nees for row in rows])[localized]
    level = np.concatenate([row.claims.level_999 for row in rows])[localized]
    alarms = float(
        np.average([found["alarm_share"] or 0.0 for found in each], weights=[len(r.claims.error) for r in rows])
    )
    low, high = nees_band(sum(row.claims.driven_m[-1] for row in rows))
    size = np.abs(every[localized])
    ratio = np.median(level, axis=0) / np.percentile(size, 95, axis=0) if len(size) else np.full(3, np.nan)
    rmse_m = np.sqrt(np.mean(every[:, 0] ** 2 + every[:, 1] ** 2))
    return (
        f"| {title} | {len(every)} | {100 * misleading.mean():.2f} | "
        f"{max(found['misleading_max_s'] or 0.0 for found in each):.1f} | "
        f"{max(found['misleading_max_m'] or 0.0 for found in each):.2f} | "
        f"{np.median(nees) if len(nees) else np.nan:.2f} ({low:.1f} to {high:.1f}) | "
        f"{' '.join(f'{value:.1f}' for value in ratio)} | {100 * alarms:.2f} | {rmse_m:.3f} |"
    )


HEAD = """| drive | scans | misleading % | longest s | m | NEES median (band) | level / error | false alarms % | rmse m |
|---|---|---|---|---|---|---|---|---|"""


def reference(text: str) -> Tuple[str, Reference]:
    """NAME=METRES:DEGREES."""
    name, _, values = text.partition("=")
    metres, _, degrees = values.partition(":")
    if name not in tracks.names():
        raise argparse.ArgumentTypeError(f"unknown track {name!r}")
    return name, (float(metres), float(degrees))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tracks", nargs="+", choices=tracks.names(), default=tracks.names(), metavar="NAME")
    parser.add_argument("--drives", nargs="+", choices=list(DRIVES), default=list(DRIVES))
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--max-scans", type=int, default=0, help="of each drive; 0: all")
    parser.add_argument("--reference", type=reference, action="append", default=[], metavar="NAME=M:DEG")
    parser.add_argument("--jobs", type=int, default=1)
    arguments = parser.parse_args()
    deviations = {**REFERENCE, **dict(arguments.reference)}
    jobs = [
        Job(name, drive, seed, arguments.max_scans, deviations.get(name, (0.0, 0.0)))
        for name in arguments.tracks
        for drive in arguments.drives
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds)
    ]
    print(HEAD)
    rows: List[Row] = []
    with multiprocessing.Pool(arguments.jobs) as pool:
        for row in pool.imap(run, jobs):
            rows.append(row)
            print(line(f"{row.job.track} {row.job.drive} {row.job.seed}", [row]), flush=True)
    for drive in arguments.drives:
        for kind, chosen in (("logs", True), ("buildings", False)):
            some = [row for row in rows if row.job.drive == drive and (row.job.track in tracks.LOGS) == chosen]
            if some:
                print(line(f"**all {kind}, {drive}**", some))
    return 0


if __name__ == "__main__":
    sys.exit(main())
