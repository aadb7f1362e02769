#!/usr/bin/env python3
"""Do the walls seen along an edge distinguish edges, and never rule out the true one? Simulated drives along edges.

    python test/benchmark/edge_segments.py
    python test/benchmark/edge_segments.py --seed 210 --edges 120 --changed 0.33

A robot drives edges of the atlases of the simulated buildings, with glass in them and lidars that see more or less of
it; dead reckoning has errors of 2 % in distance and 0.07 rad in heading over an edge. It collects its scans in the
local map of the driver and reports the walls that it saw as the driver does. The contradiction of walls is computed for
the true edge, and for all directed edges of the same atlas that match the report in length, chord and directions. If
the true edge is ruled out, the search would lose the robot: exit 1 if that happens once.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path
from typing import List, Tuple

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import numpy as np

sys.path.append(str(Path(__file__).resolve().parent))

import drives
from glass_nav.driving.edge_tracking import edge_report
from glass_nav.driving.edge_tracking.local_map import LocalMap
from glass_nav.geometry import se2
from glass_nav.sensing.scan import Scan
from glass_nav.simulation import building_file, lidar
from glass_nav.simulation.building import Building
from glass_nav.simulation.lidar import LidarModel
from glass_nav.topology.atlas import atlas_file
from glass_nav.topology.search import edge_segments
from glass_nav.topology.atlas.atlas import Atlas
from glass_nav.topology.search.edge_segments import SegmentTest
from glass_nav.topology.atlas.edge_views import poses_along
from glass_nav.topology.search.matching import Matcher, Tolerances
from glass_nav.topology.observations import Traversal

ATLASES = Path(__file__).resolve().parents[2] / "atlas"
STEP_M, SPEED_M_S = 0.25, 0.5
WAY_SIGMA, TURN_SIGMA_RAD = 0.02, 0.07


def driven(atlas: Atlas, building: Building, model: LidarModel, dart: int, rng: np.random.Generator) -> Traversal:
    """The report of a robot that drove the edge of a dart."""
    line = atlas.edges.polyline_m[dart >> 1]
    true = poses_along(line[::-1] if dart & 1 else line, STEP_M)
    length_m = max(float(np.hypot(*np.diff(line, axis=0).T).sum()), 1.0)
    scale, drift_rad_m = 1.0 + rng.normal(0.0, WAY_SIGMA), rng.normal(0.0, TURN_SIGMA_RAD) / length_m
    odom, local_map = [true[0]], LocalMap()
    for number, map_from_base in enumerate(true):
        if number:
            step = se2.compose(se2.inverse(true[number - 1]), map_from_base)
            step[2] += drift_rad_m * np.hypot(step[0], step[1])
            odom.append(se2.compose(odom[-1], step * [scale, scale, 1.0]))
        seen = lidar.scan(model, building, map_from_base, number * STEP_M / SPEED_M_S, rng)
        local_map.add(
            Scan(number, seen.ranges_m, model.angles_rad, model.range_min_m, model.range_max_m, np.zeros(3)), odom[-1]
        )
    return edge_report.traversal(np.array(odom)[:, :2], 0, local_map.grid())


def compare(
    arguments: argparse.Namespace, name: str
) -> Tuple[List[Tuple[float, float]], List[Tuple[float, float]], float]:
    """(share, metres) of true edges, and of others that match by numbers; CPU ms of a comparison."""
    atlas = atlas_file.load(ATLASES / name / "atlas.json")
    matcher = Matcher(atlas, Tolerances(), use_angles=True)
    rng = np.random.default_rng([arguments.seed, len(name)])
    building = building_file.load(drives.MAPS / name / "building.yaml")
    if arguments.changed:
        building = building.changed(arguments.changed, rng)
    darts = np.arange(len(atlas.darts))
    true: List[Tuple[float, float]] = []
    wrong: List[Tuple[float, float]] = []
    spent = 0.0
    for number, dart in enumerate(rng.permutation(darts)[: arguments.edges].tolist()):
        report = driven(atlas, building, lidar.preset(drives.lidars()[number % len(drives.lidars())]), dart, rng)
        others = darts[matcher.edges_along(darts, report)]
        others = rng.permutation(others[others != dart])[: arguments.others].tolist()
        began = time.process_time()
        true.append(matcher.contradiction(dart, report))
        wrong += [matcher.contradiction(other, report) for other in others]
        spent += time.process_time() - began
    return true, wrong, 1e3 * spent / (len(true) + len(wrong))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--buildings", nargs="+", default=drives.buildings())
    parser.add_argument("--seed", type=int, default=200)
    parser.add_argument("--edges", type=int, default=60, help="of each building, with their direction (default 60)")
    parser.add_argument("--others", type=int, default=20, help="candidates beside the true one (default 20)")
    parser.add_argument("--changed", type=float, default=0.0, help="share of the furniture that moved (default 0)")
    parser.add_argument(
        "--limit",
        type=float,
        default=SegmentTest().segments_max_contradiction,
        help="segments_max_contradiction (default as the node's)",
    )
    arguments = parser.parse_args()
    test = SegmentTest(segments_max_contradiction=arguments.limit)
    print(
        "| building | edges driven | ruled out | largest contradiction | others that match by numbers | ruled out | "
        "ms each |\n|---|---|---|---|---|---|---|"
    )
    lost, count, told_apart, others = 0, 0, 0, 0
    for name in arguments.buildings:
        true, wrong, each_ms = compare(arguments, name)
        out_true = sum(not edge_segments.matches(*each, test) for each in true)
        out_wrong = sum(not edge_segments.matches(*each, test) for each in wrong)
        print(
            f"| {name} | {len(true)} | {out_true} | {max(share for share, _ in true):.2f} | {len(wrong)} | "
            f"{out_wrong / max(len(wrong), 1):.2f} | {each_ms:.1f} |",
            flush=True,
        )
        lost, count = lost + out_true, count + len(true)
        told_apart, others = told_apart + out_wrong, others + len(wrong)
    print(f"| all | {count} | {lost} | | {others} | {told_apart / max(others, 1):.2f} | |")
    return 1 if lost else 0


if __name__ == "__main__":
    sys.exit(main())
