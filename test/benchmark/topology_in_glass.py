#!/usr/bin/env python3
"""How far glass changes which meetpoints a robot sees, with lidar and odometry alone.

A simulated robot drives a random tour along the edges of each building's atlas. The nodes that the observer of the
driver's local map saw are compared with those of the atlas. The same building with film on all its glass (opaque) is
the reference for the lidars whose beams pass through panes.

    test/benchmark/topology_in_glass.py                     # all buildings, opaque and all lidars
    test/benchmark/topology_in_glass.py --buildings glass_office --lidars weak --seeds 2
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, Dict, List, NamedTuple

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from glass_nav.replay import replay_topology
from glass_nav.driving.edge_tracking.passing import PassingObserver, PassingParams
from glass_nav.simulation import building_file, building_map, lidar, shipped_buildings
from glass_nav.simulation.simulation import Simulation
from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.topology.atlas.atlas import MEETPOINT, Atlas, twin

OPAQUE = "opaque"  # beside the presets: film on all glass, the lidar "sensitive"
SCAN_RATE_HZ = 5.0  # a scan every 0.12 m
ROOM_M = 0.4  # on each side of an edge that it drives along
SUMMED = ("passed", "seen", "missed", "invented", "degree_right")


class Job(NamedTuple):
    """One drive."""

    building: str
    lidar: str
    seed: int
    length_m: float


def tour(atlas: Atlas, length_m: float, rng: np.random.Generator) -> np.ndarray:
    """(n, 2) waypoints along edges from meetpoint to meetpoint, never straight back; the longest of 20 tries."""
    wide = np.repeat(atlas.edges.clearance_m >= ROOM_M, 2)
    wide &= (atlas.nodes.kind[atlas.darts.node] == MEETPOINT) & (
        atlas.nodes.kind[atlas.darts.node[twin(np.arange(len(atlas.darts)))]] == MEETPOINT
    )
    tries = [_walk(atlas, wide, length_m, rng) for _ in range(20)]
    return max(tries, key=lambda line: float(np.hypot(*np.diff(line, axis=0).T).sum()))


def _walk(atlas: Atlas, wide: np.ndarray, length_m: float, rng: np.random.Generator) -> np.ndarray:
    dart = int(rng.choice(np.flatnonzero(wide)))
    parts, driven_m = [], 0.0
    while True:
        line = atlas.edges.polyline_m[dart // 2]
        parts.append(line[::-1] if dart % 2 else line)
        driven_m += float(atlas.edges.length_m[dart // 2])
        back = int(twin(np.array(dart)))
        onward = [int(other) for other in atlas.rings[int(atlas.darts.node[back])] if wide[other] and other != back]
        if driven_m >= length_m or not onward:
            return np.concatenate(parts)
        dart = int(rng.choice(onward))


def run(job: Job) -> Dict[str, Any]:
    """The figures of one drive."""
    building = building_file.load(shipped_buildings.find(job.building))
    grid_map = building_map.draw(building)
    atlas = atlas_file.load(shipped_atlases.find(job.building))
    name = "sensitive" if job.lidar == OPAQUE else job.lidar
    simulation = Simulation(
        building.opaque() if job.lidar == OPAQUE else building,
        lidar.preset(name),
        seed=job.seed,
        scan_rate_hz=SCAN_RATE_HZ,
    )
    observer = PassingObserver(PassingParams())
    stamps_ns, poses = [], []
    for frame in simulation.drive(tour(atlas, job.length_m, np.random.default_rng([job.seed, 1]))):
        stamps_ns.append(frame.stamp_ns)
        poses.append(frame.map_from_base)
        observer.see(frame.scan, frame.odom_from_base)
    score = replay_topology.score(atlas, grid_map, observer, np.array(stamps_ns), np.array(poses))
    return {"building": job.building, "lidar": job.lidar, "seed": job.seed, **score.metrics()}


def line(name: str, lidar_name: str, rows: List[Dict[str, Any]]) -> str:
    """One row of the table, over all drives."""
    total = {key: sum(row[key] for row in rows) for key in SUMMED}
    why = {key: sum(row["missed_why"][key] for row in rows) for key in rows[0]["missed_why"]}
    off = [row["position_off_m"]["median_abs"] for row in rows if row["position_off_m"]["median_abs"] is not None]
    length = [
        row["edge_length_off_m"]["median_abs"] for row in rows if row["edge_length_off_m"]["median_abs"] is not None
    ]
    return (
        f"| {name} | {lidar_name} | {total['passed']} | {total['seen']} | {total['missed']} | "
        f"{why['doubtful']} / {why['unsteady']} / {why['nothing']} | {total['invented']} | "
        f"{total['degree_right']} | {np.mean(off) if off else np.nan:.2f} | "
        f"{np.mean(length) if length else np.nan:.2f} |"
    )


def main() -> None:
    """Run all, print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--buildings", nargs="+", default=list(shipped_buildings.shipped()))
    parser.add_argument("--lidars", nargs="+", default=[OPAQUE, *lidar.PRESETS], choices=[OPAQUE, *lidar.PRESETS])
    parser.add_argument("--seeds", type=int, default=1, help="drives in each building with each lidar")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--length", type=float, default=60.0, metavar="M", help="of a tour (default 60)")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, help="file for all figures, json")
    arguments = parser.parse_args()
    jobs = [
        Job(building, name, seed, arguments.length)
        for building in arguments.buildings
        for name in arguments.lidars
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds)
    ]
    rows: List[Dict[str, Any]] = []
    with ProcessPoolExecutor(arguments.jobs) as pool:
        for job, found in zip(jobs, pool.map(run, jobs)):
            rows.append(found)
            print(f"{job.building} {job.lidar} seed {job.seed}", file=sys.stderr, flush=True)
            if arguments.out:
                arguments.out.write_text(json.dumps(rows, indent=1))
    print(
        "| building | lidar | passed | seen | missed | doubtful / unsteady / nothing | false positives | "
        "degree right | nodes off, m | edge length off, m |\n"
        "|---|---|---|---|---|---|---|---|---|---|"
    )
    for building in [*arguments.buildings, "all"]:
        for name in arguments.lidars:
            of_both = [row for row in rows if building in ("all", row["building"]) and row["lidar"] == name]
            print(line(building, name, of_both))


if __name__ == "__main__":
    main()
