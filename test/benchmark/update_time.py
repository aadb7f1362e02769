#!/usr/bin/env python3
"""Does the filter keep up?  CPU time of one update, and of the classification alone, on a map of the data folder.

    python test/benchmark/update_time.py
    python test/benchmark/update_time.py --map ../shared/data/logs/intel/map.yaml --beams 541 --particles 2000

A robot is placed on free cells, scans are cast from there (with noise), and the number of particles is fixed as given.
Prints the median CPU milliseconds of the process, one thread. Then, along a drive in a simulated building of glass, in
alternation: whole updates of our filter, of the same filter weighted by a likelihood field, and of plain Monte Carlo
localization with that field; and the time to classify all beams of a scan between two updates. The first --settle scans
are not counted: a given pose is compared with all places of the map before it is trusted, which takes longer. Exit 1 if a
whole update takes more than --limit-ms or --limit-ratio times as long as with the field, or classifying more than
--limit-classify-ms.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Callable, Dict, List

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import numpy as np

sys.path.append(str(Path(__file__).resolve().parent))

import baselines
import drives
from glass_nav import params
from glass_nav.localization.particle_filter.importance_weights import BeamMixture
from glass_nav.localization.localizer import Localizer
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.localization.particle_filter.resampling import ParticleCount
from glass_nav.sensing.raycast import RayCaster
from glass_nav.sensing.scan import Scan
from glass_nav.simulation import lidar
from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap

REPO = Path(__file__).resolve().parents[2]
MAX_RANGE_M = 30.0
CLASSIFY = "classify"


def scan_at(caster: RayCaster, pose: np.ndarray, beams: int, stamp_ns: int, rng: np.random.Generator) -> Scan:
    """What a lidar of 270 degrees would measure there."""
    angles_rad = np.radians(np.linspace(-135.0, 135.0, beams))
    ranges_m = caster.cast(pose[None], angles_rad, MAX_RANGE_M)[0] + rng.normal(0.0, 0.01, beams)
    return Scan(stamp_ns, ranges_m, angles_rad, 0.02, MAX_RANGE_M, np.zeros(3))


def places(grid_map: GridMap, count: int, rng: np.random.Generator) -> np.ndarray:
    """Poses (count, 3) in free cells."""
    rows, columns = np.nonzero(grid_map.free)
    chosen = rng.integers(len(rows), size=count)
    return np.column_stack([grid_map.centres(rows[chosen], columns[chosen]), rng.uniform(-np.pi, np.pi, count)])


def cpu_ms(work: Callable[[], object]) -> float:
    started = time.process_time()
    work()
    return 1e3 * (time.process_time() - started)


def compare(arguments: argparse.Namespace) -> Dict[str, float]:
    """Median CPU ms of a whole update of each filter, and of the vote on --classified-beams, along a drive."""
    model = lidar.preset("weak")  # sees panes least: the most beams behind glass
    drive = drives.drive_with(replace(model, beams=arguments.compared_beams), arguments.building, arguments.seed)
    fine = drives.drive_with(replace(model, beams=arguments.classified_beams), arguments.building, arguments.seed)
    count = ParticleCount(min_particles=arguments.particles, max_particles=arguments.particles)
    settings = LocalizerParams(count=count, mixture=BeamMixture(laser_max_beams=arguments.compared_beams))
    field = baselines.SETTINGS["ours_field"]._replace(max_beams=None)

    def rng() -> np.random.Generator:
        return np.random.default_rng(arguments.seed)

    likelihood = baselines.LikelihoodField(drive.grid_map, field)
    filters: Dict[str, baselines.PoseFilter] = {
        "ours": Localizer(settings, drive.grid_map, rng()),
        "ours, weights of the field": Localizer(
            settings, drive.grid_map, rng(), particle_filter=partial(baselines.OtherWeights, model=likelihood)
        ),
        "plain, weights of the field": baselines.PlainMcl(settings, drive.grid_map, rng(), likelihood, count),
    }
    classifier = Localizer(LocalizerParams(), drive.grid_map, rng())
    covariance = np.diag([0.03, 0.03, 0.01]) ** 2
    for localizer in (*filters.values(), classifier):
        localizer.set_pose(drive.frames[0].map_from_base, covariance)
    times: Dict[str, List[float]] = {name: [] for name in [*filters, CLASSIFY]}
    for frame, still in list(zip(drive.frames, fine.frames))[: arguments.settle + arguments.runs]:
        for name, localizer in filters.items():
            localizer.request_update()
            times[name].append(
                cpu_ms(lambda localizer=localizer, frame=frame: localizer.update(frame.scan, frame.odom_from_base))
            )
        classifier.request_update()
        classifier.update(still.scan, still.odom_from_base)  # the next one has not moved: cases only, no particles
        times[CLASSIFY].append(cpu_ms(lambda still=still: classifier.update(still.scan, still.odom_from_base).report))
    return {name: float(np.median(each[arguments.settle :])) for name, each in times.items()}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    data = Path(os.environ.get("GLASS_NAV_DATA", REPO.parent / "shared" / "data"))
    parser.add_argument("--map", type=Path, default=data / "logs" / "intel" / "map.yaml")
    parser.add_argument("--beams", type=int, default=360)
    parser.add_argument("--weighted-beams", type=int, default=60)
    parser.add_argument("--particles", type=int, default=2000)
    parser.add_argument("--runs", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--limit-ms", type=float, default=100.0)
    parser.add_argument("--building", default="glass_office", help="of maps/, for the comparison")
    parser.add_argument("--compared-beams", type=int, default=180, help="of a scan, all of them weighted")
    parser.add_argument("--classified-beams", type=int, default=541)
    parser.add_argument("--settle", type=int, default=40, help="scans of the drive before those that count")
    parser.add_argument("--limit-ratio", type=float, default=2.0)
    parser.add_argument("--limit-classify-ms", type=float, default=30.0)
    arguments = parser.parse_args()

    grid_map = map_file.load(arguments.map)
    settings = params.load(
        LocalizerParams,
        {
            "min_particles": arguments.particles,
            "max_particles": arguments.particles,
            "laser_max_beams": arguments.weighted_beams,
        },
        "update_time",
    )
    rng = np.random.default_rng(arguments.seed)
    caster = RayCaster(grid_map)
    localizer = Localizer(settings, grid_map, rng)
    whole: List[float] = []
    classified: List[float] = []
    for pose in places(grid_map, arguments.runs, rng):
        localizer.set_pose(pose, np.diag([0.05, 0.05, 0.02]) ** 2)
        localizer.update(scan_at(caster, pose, arguments.beams, 0, rng), np.zeros(3))
        scan = scan_at(caster, pose, arguments.beams, 1, rng)
        localizer.request_update()
        whole.append(cpu_ms(lambda scan=scan: localizer.update(scan, np.zeros(3))))
        classified.append(
            cpu_ms(lambda scan=scan: localizer.update(scan, np.zeros(3)).report)
        )  # it has not moved: cases only

    print(
        f"{arguments.map}: {arguments.beams} beams classified by {settings.samples.sample_count} samples, "
        f"{arguments.particles} particles weighted on {arguments.weighted_beams} beams; "
        f"CPU ms, {arguments.runs} places"
    )
    for name, times in ((CLASSIFY, classified), ("whole update", whole)):
        print(f"  {name:12s}  median {np.median(times):6.1f}  min {min(times):6.1f}  max {max(times):6.1f}")
    limits = [(f"{arguments.limit_ms:g} ms for a whole update", float(np.median(whole)) <= arguments.limit_ms)]
    found = compare(arguments)
    print(
        f"{arguments.building}: {arguments.compared_beams} beams, all weighted, {arguments.particles} particles; "
        f"median CPU ms of a whole update, {arguments.runs} scans"
    )
    for name, each in found.items():
        if name != CLASSIFY:
            print(f"  {name:28s} {each:6.1f}   ours is {found['ours'] / each:.2f} times that")
    print(f"  {arguments.classified_beams} beams classified, reported and cut: {found[CLASSIFY]:.1f} ms")
    limits += [
        (
            f"{arguments.limit_ratio:g} times the same filter with the field's weights",
            found["ours"] <= arguments.limit_ratio * found["ours, weights of the field"],
        ),
        (
            f"{arguments.limit_classify_ms:g} ms for {arguments.classified_beams} beams",
            found[CLASSIFY] <= arguments.limit_classify_ms,
        ),
    ]
    for limit, kept in limits:
        print(f"  limit {limit}: {'kept' if kept else 'missed'}")
    return 0 if all(kept for _, kept in limits) else 1


if __name__ == "__main__":
    sys.exit(main())
