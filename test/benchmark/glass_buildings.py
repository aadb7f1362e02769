#!/usr/bin/env python3
"""Our filter and baselines in simulated buildings of glass: cases, poses, scan_surfaces.

    python test/benchmark/glass_buildings.py --localizers ours ours_paper      cases, soft and the document's vote
    python test/benchmark/glass_buildings.py --first-seed 200 --mixed --jobs 2 --out glass_buildings.json
    python test/benchmark/glass_buildings.py --first-seed 200 --seeds 20 --mixed --localizers ours     lost share
    python test/benchmark/glass_buildings.py --buildings glass_office --lidars weak --changed 0.33 --set sample_count=19

Every building x lidar x seed is driven once, and every localizer gets the same scans, odometry and start. A seed
seeds the drive, the lidar, the odometry, the start and the localizer. Baselines: test/benchmark/baselines.py;
ours_oracle is given the true cases: it is no baseline but shows what the weights could reach. Ratios are those of the
means over lidars and seeds, against the best baseline of that figure in that building. Seeds from 100 on were used in
development; those from 200 on were not. Exit code 1 when a bar is missed.
"""

from __future__ import annotations

import argparse
import itertools
import json
import multiprocessing
import os
import sys
import time
from pathlib import Path
from typing import Any, Callable, Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):  # a process a core: threads would fight for them
    os.environ.setdefault(name, "1")

import numpy as np
import yaml

sys.path.append(str(Path(__file__).resolve().parent))

import baselines
import drives
from glass_nav import params
from glass_nav.evaluation.metrics import case_scores, pose_errors, replay_result
from glass_nav.evaluation.metrics.case_scores import CaseScores, SurfaceScores
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.localization.localizer import Estimate
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.vocabulary import CASES_IN_ORDER

START_DEVIATION = np.array(
    [0.1, 0.1, np.radians(3.0)]
)  # of the pose that the localizers are given, and what they assume
FIGURES = ("position_rmse_m", "position_median_m", "yaw_mean_deg")


class Job(NamedTuple):
    """One drive, for all localizers."""

    building: str
    lidar: str
    seed: int
    changed: float
    max_scans: Optional[int]
    localizers: Tuple[str, ...]
    settings: LocalizerParams


class Run(NamedTuple):
    """The results of one localizer on one drive."""

    building: str
    lidar: str
    seed: int
    localizer: str
    pose: Dict[str, Optional[float]]  # pose_errors.summary()
    cases: Optional[CaseScores]  # None: it tells none
    surfaces: Optional[SurfaceScores]
    scans: int
    updates: int
    cpu_s: float

    def as_json(self) -> Dict[str, Any]:
        values = {
            **self._asdict(),
            "cases": None if self.cases is None else self.cases.metrics(),
            "scan_surfaces": None if self.surfaces is None else self.surfaces.metrics(),
        }
        del values["surfaces"]
        return values


def run(job: Job) -> List[Run]:
    """All localizers on one drive."""
    drive = drives.drive(job.building, job.lidar, job.seed, job.changed, job.max_scans)
    return [follow(name, job, drive) for name in job.localizers]


def follow(name: str, job: Job, drive: drives.Drive, settings: Optional[baselines.Settings] = None) -> Run:
    """One localizer on one drive, from near its first pose; settings in place of the baseline's own."""
    rng = np.random.default_rng([job.seed, 1])
    localizer = baselines.localizer(name, job.settings, drive.grid_map, job.seed, settings)
    start = drive.frames[0].map_from_base + START_DEVIATION * rng.standard_normal(3)
    localizer.set_pose(start, np.diag(START_DEVIATION**2))
    poses: List[np.ndarray] = []
    cases, surfaces, cpu_s, updates = case_scores.none_yet(), SurfaceScores(), 0.0, 0
    for frame in drive.frames:
        if isinstance(localizer, baselines.OracleCases):
            localizer.true_case = frame.truth.case
        before = time.process_time()
        estimate = localizer.update(frame.scan, frame.odom_from_base)
        cpu_s += time.process_time() - before
        poses.append(estimate.map_from_base)
        if isinstance(estimate, Estimate):
            updates += estimate.updated
            cases += case_scores.of_cases(frame.truth.case, estimate.cases.case, frame.scan.answered)
            surface = getattr(estimate, "surface_scan", None)
            if surface is not None:
                surfaces += case_scores.of_surfaces(
                    frame.truth.crossing_m, surface.ranges_m, surface.cut, surface.trusted
                )
    stamps = np.array([frame.scan.stamp_ns for frame in drive.frames])
    true = Trajectory(stamps, np.array([frame.map_from_base for frame in drive.frames]))
    tells = name in baselines.OURS
    return Run(
        job.building,
        job.lidar,
        job.seed,
        name,
        pose_errors.summary(pose_errors.of(stamps, np.array(poses), true)),
        cases if tells else None,
        surfaces if tells and surfaces.scans else None,
        len(poses),
        updates,
        cpu_s,
    )


def print_cases(runs: Sequence[Run], ways: Sequence[Callable[[Run], str]]) -> None:
    """A line for each group of runs, for each grouping in turn, and each method of classification."""
    print(
        "| runs | vote | accuracy | answering | macro F1 | "
        + " | ".join(f"P {case}" for case in range(1, 5))
        + " | "
        + " | ".join(f"R {case}" for case in range(5))
        + " | true share of 0..4 % | used |\n|---|---|"
        + "---|" * 14
    )
    groups = [(by, group) for by in ways for group in unique(by(each) for each in runs)]
    for (by, group), localizer in itertools.product(groups, ("ours", "ours_paper")):
        parts = [
            each.cases for each in runs if by(each) == group and each.localizer == localizer and each.cases is not None
        ]
        if not parts:
            continue
        figures = sum(parts, case_scores.none_yet()).metrics()
        shares = " ".join(f"{100 * (share or 0.0):.0f}" for share in figures["true_share"])
        print(
            f"| {group} | {'paper' if localizer == 'ours_paper' else 'soft'} | {number(figures['accuracy'])} | "
            f"{number(figures['accuracy_answered'])} | {number(figures['macro_f1'])} | "
            + " | ".join(number(value) for value in figures["precision"][1:] + figures["recall"])
            + f" | {shares} | {number(figures['used_share'])} |",
            flush=True,
        )


def print_confusion(runs: Sequence[Run]) -> None:
    """Of all our runs: rows true cases, columns reported cases, per cent of the true beams."""
    parts = [each.cases for each in runs if each.localizer == "ours" and each.cases is not None]
    if not parts:
        return
    confusion = sum(parts, case_scores.none_yet()).confusion
    print(
        "| true \\ reported | " + " | ".join(case.label for case in CASES_IN_ORDER) + " | beams |\n|---|" + "---|" * 6
    )
    for true in CASES_IN_ORDER:
        row = confusion[true]
        print(
            f"| {true.label} | "
            + " | ".join(f"{100 * row[reported] / max(row.sum(), 1):.1f} %" for reported in CASES_IN_ORDER)
            + f" | {row.sum()} |"
        )


def print_poses(runs: Sequence[Run]) -> None:
    """A line for each building and localizer, then the ratio of ours to the best baseline."""
    print(
        "| building | localizer | rmse m | median m | yaw mean deg | lost (max) | ms CPU/scan | ms CPU/update |\n|"
        + "---|" * 8
    )
    for building in unique(each.building for each in runs):
        for localizer in unique(each.localizer for each in runs):
            own = [each for each in runs if (each.building, each.localizer) == (building, localizer)]
            if own:
                lost = [each.pose["lost_share"] or 0.0 for each in own]
                cpu_ms, updates = 1e3 * sum(each.cpu_s for each in own), sum(each.updates for each in own)
                print(
                    f"| {building} | {localizer} | "
                    + " | ".join(f"{mean(own, figure):.3f}" for figure in FIGURES)
                    + f" | {np.mean(lost):.3f} ({max(lost):.3f}) | {cpu_ms / sum(each.scans for each in own):.1f} | "
                    + (f"{cpu_ms / updates:.1f} |" if updates else "|")
                )
    if not {"ours"} < {each.localizer for each in runs} & {"ours", *baselines.BASELINES}:
        return
    print(
        "\n| building | "
        + " | ".join(f"{figure}: ours / best baseline | / oracle" for figure in FIGURES)
        + " |\n|---|"
        + "---|" * 6
    )
    for building in unique(each.building for each in runs):
        cells = []
        for figure in FIGURES:
            ratio, best = to_best_baseline(runs, building, figure)
            cells += [f"{ratio:.2f} ({best})", f"{to(runs, building, figure, 'ours_oracle'):.2f}"]
        print(f"| {building} | {' | '.join(cells)} |")


def to(runs: Sequence[Run], building: str, figure: str, rival: str) -> float:
    """Ours over the rival's, means of the building; NaN when one of them did not run."""
    ours, other = (
        mean([each for each in runs if (each.building, each.localizer) == (building, name)], figure)
        for name in ("ours", rival)
    )
    return ours / other


def to_best_baseline(runs: Sequence[Run], building: str, figure: str) -> Tuple[float, str]:
    """Ours over the best baseline's, and its name."""
    rivals = [name for name in unique(each.localizer for each in runs) if name in baselines.BASELINES]
    return max((to(runs, building, figure, name), name) for name in rivals)


def print_surfaces(runs: Sequence[Run]) -> None:
    """A line for each building and lidar."""
    print(
        "| building | lidar | beams at panes | of them cut within 0.15 m | cut elsewhere | of the others cut | "
        "scans trusted |\n|" + "---|" * 7
    )
    reported = [each for each in runs if each.localizer == "ours" and each.surfaces is not None]
    groups = unique((each.building, each.lidar) for each in reported)
    for group in [*groups, ("all", "all")]:
        parts = [each.surfaces for each in reported if group in ((each.building, each.lidar), ("all", "all"))]
        figures = sum((part for part in parts if part is not None), SurfaceScores()).metrics()
        elsewhere = figures["at_pane_cut"] - figures["at_pane_cut_near"]
        print(
            f"| {group[0]} | {group[1]} | {figures['at_pane']} | {number(figures['cut_at_pane_share'])} | "
            f"{number(elsewhere / figures['at_pane'] if figures['at_pane'] else None)} | "
            f"{number(figures['cut_wrongly_share'], 4)} | {number(figures['trusted_share'])} |"
        )


def print_bars(runs: Sequence[Run]) -> bool:
    """Print the bars for ours and whether each is met; returns whether all are."""
    own = [each for each in runs if each.localizer == "ours"]
    cases = {
        building: sum(
            (each.cases for each in own if each.building == building and each.cases is not None), case_scores.none_yet()
        )
        for building in unique(each.building for each in own)
    }
    figures = sum(cases.values(), case_scores.none_yet()).metrics()
    surfaces = sum((each.surfaces for each in own if each.surfaces is not None), SurfaceScores()).metrics()
    bars = [Bar("case accuracy", figures["accuracy"], 0.93), Bar("macro F1", figures["macro_f1"], 0.85)]
    bars += [
        Bar(f"precision of case {case}", figures["precision"][case], least)
        for case, least in ((1, 0.95), (2, 0.8), (3, 0.95), (4, 0.95))
    ]
    bars += [
        Bar("cut within 0.15 m of the pane", surfaces["cut_at_pane_share"], 0.95),
        Bar("cut of other beams", surfaces["cut_wrongly_share"], most=0.01),
        Bar("largest lost share", max((each.pose["lost_share"] or 0.0 for each in own), default=None), most=0.0),
    ]
    if any(each.localizer in baselines.BASELINES for each in runs):
        for building, scores in cases.items():
            glass = scores.confusion[2:].sum() > 0.01 * scores.confusion.sum()
            bars += [
                Bar(
                    f"{building}: {figure} / best baseline",
                    to_best_baseline(runs, building, figure)[0],
                    most=0.7 if glass else 1.0,
                )
                for figure in ("position_rmse_m", "yaw_mean_deg")
            ]
    print("| bar | asked | found | |\n|---|---|---|---|")
    for bar in bars:
        asked = f">= {bar.least:g}" if bar.least is not None else f"<= {bar.most:g}"
        verdict = "not measured" if bar.found is None else "kept" if bar.kept else "MISSED"
        print(f"| {bar.what} | {asked} | {number(bar.found, 4)} | {verdict} |")
    return all(bar.kept for bar in bars)


class Bar(NamedTuple):
    """The bar for one figure."""

    what: str
    found: Optional[float]  # None: there was nothing to measure it by
    least: Optional[float] = None
    most: Optional[float] = None

    @property
    def kept(self) -> bool:
        return self.found is None or (
            (self.least is None or self.found >= self.least) and (self.most is None or self.found <= self.most)
        )


def mean(runs: Sequence[Run], figure: str) -> float:
    values = [each.pose[figure] for each in runs]
    return float(np.mean([np.inf if value is None else value for value in values])) if values else float("nan")


def unique(values: Iterable[Any]) -> List[Any]:
    return list(dict.fromkeys(values))


def number(value: Optional[float], digits: int = 3) -> str:
    return "" if value is None else f"{value:.{digits}f}"


def baselines_from(path: Path, jobs: Sequence[Job]) -> List[Run]:
    """The results of the baselines, and no other localizer, on the drives of these jobs in an earlier benchmark."""
    found = json.loads(path.read_text())
    wanted = {(job.building, job.lidar, job.seed): job for job in jobs}
    runs = []
    for each in found["runs"]:
        job = wanted.get((each["building"], each["lidar"], each["seed"]))
        if (
            job is not None
            and found["changed"] == job.changed
            and each["localizer"] in baselines.BASELINES
            and each["localizer"] not in job.localizers
        ):
            runs.append(
                Run(
                    job.building,
                    job.lidar,
                    job.seed,
                    each["localizer"],
                    each["pose"],
                    None,
                    None,
                    each["scans"],
                    each["updates"],
                    each["cpu_s"],
                )
            )
    return runs


def settings_from(assignments: Sequence[str]) -> LocalizerParams:
    pairs = (assignment.partition("=") for assignment in assignments)
    return params.load(LocalizerParams, {name: yaml.safe_load(value) for name, _, value in pairs}, "glass_buildings")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--buildings", nargs="+", default=None, metavar="NAME", help="default: all in maps/")
    parser.add_argument("--lidars", nargs="+", default=None, metavar="PRESET", help="default: all presets")
    parser.add_argument("--mixed", action="store_true", help="one lidar for each seed, in turn, not all of them")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--first-seed", type=int, default=100)
    parser.add_argument(
        "--changed", type=float, default=0.0, metavar="SHARE", help="of the furniture, moved since the map was drawn"
    )
    parser.add_argument(
        "--localizers",
        nargs="+",
        choices=baselines.LOCALIZERS,
        default=list(baselines.LOCALIZERS),
        metavar="NAME",
        help=" ".join(baselines.LOCALIZERS),
    )
    parser.add_argument("--max-scans", type=int, metavar="N", help="of each drive")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="one parameter of our filter")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, help="JSON with all figures of all runs")
    parser.add_argument(
        "--reuse",
        type=Path,
        metavar="JSON",
        help="an earlier --out: its baselines, where they drove "
        "the same drives and are not to run again (as long as the simulator is the same)",
    )
    arguments = parser.parse_args()
    settings = settings_from(arguments.set)
    lidars = arguments.lidars or drives.lidars()
    jobs = [
        Job(building, lidar, seed, arguments.changed, arguments.max_scans, tuple(arguments.localizers), settings)
        for building in arguments.buildings or drives.buildings()
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds)
        for lidar in ([lidars[seed % len(lidars)]] if arguments.mixed else lidars)
    ]
    runs: List[Run] = []
    began = time.monotonic()
    with multiprocessing.Pool(arguments.jobs) as pool:
        for done, found in enumerate(pool.imap(run, jobs), 1):
            runs += found
            first = found[0]
            print(
                f"{done} of {len(jobs)} drives, {time.monotonic() - began:.0f} s: {first.building} {first.lidar} "
                f"{first.seed}, {first.scans} scans",
                file=sys.stderr,
            )
    if arguments.reuse is not None:
        runs += baselines_from(arguments.reuse, jobs)
    print("\nCases (P precision, R recall)\n")
    print_cases(runs, (lambda each: each.building, lambda each: each.lidar, lambda each: "all"))
    print()
    print_confusion(runs)
    print("\nPoses, means over lidars and seeds\n")
    print_poses(runs)
    if any(each.surfaces is not None for each in runs):
        print("\nscan_surfaces\n")
        print_surfaces(runs)
    if arguments.out is not None:
        replay_result.write_json(
            arguments.out,
            {
                "seeds": [arguments.first_seed, arguments.first_seed + arguments.seeds - 1],
                "changed": arguments.changed,
                "params": params.as_mapping(settings),
                "baselines": {name: baselines.SETTINGS[name]._asdict() for name in baselines.SETTINGS},
                "runs": [each.as_json() for each in runs],
            },
        )
    print("\nBars\n")
    return 0 if print_bars(runs) else 1


if __name__ == "__main__":
    sys.exit(main())
