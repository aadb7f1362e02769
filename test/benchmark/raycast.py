#!/usr/bin/env python3
"""How fast and how correct are the rays? Exact backend, corrected mrpt backend and MRPT's simulateScanRay as it is.

    test/benchmark/raycast.py [MAP]      MAP: below GLASS_NAV_DATA or a path; default maps/willow-full-0.05.yaml

All cast the same rays on the same cells to the same range, in one thread: P poses anywhere in the free cells times B
beams, as a filter does when it searches the whole map. Rates are rays per CPU second, of the fastest of several
alternating rounds. A ray is wrong if it differs from the slow traversal of test/unit/sensing by more than a millionth
of a metre (simulateScanRay: by more than two cells; its step is 0.8). Exit code 1 if a bar is missed.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path
from typing import Callable, Dict

import numpy as np

REPO = Path(__file__).resolve().parents[2]
sys.path.append(str(REPO / "test" / "support"))

import slow_raycast
from glass_nav.geometry import se2
from glass_nav.sensing.raycast import RayCaster
from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap

POSES, BEAMS, TURNS = 2000, 60, 9
CHECKED_RAYS = 4000
MIN_SPEED_UP = 2.0  # of exact over simulateScanRay


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("map", nargs="?", default="maps/willow-full-0.05.yaml")
    parser.add_argument("--max-range-m", type=float, default=30.0)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    data_dir = Path(os.environ.get("GLASS_NAV_DATA", REPO.parent / "shared" / "data"))
    world = map_file.load(data_dir / args.map)
    rng = np.random.default_rng(args.seed)
    poses = poses_in(world, rng, POSES)
    angles_rad = np.linspace(-np.pi, np.pi, BEAMS, endpoint=False)
    exact, mrpt = RayCaster(world), RayCaster(world, backend="mrpt")
    casts: Dict[str, Callable[[], np.ndarray]] = {
        "exact": lambda: exact.cast(poses, angles_rad, args.max_range_m),
        "simulateScanRay": lambda: mrpt.simulate_scan_ray_raw(poses, angles_rad, args.max_range_m),
        "mrpt, corrected": lambda: mrpt.cast(poses, angles_rad, args.max_range_m),
    }
    rates = alternate(casts, POSES * BEAMS)
    ranges_m = casts["exact"]()
    checked = rng.choice(ranges_m.size, CHECKED_RAYS, replace=False)
    truth_m = slow_ranges(world, poses, angles_rad, args.max_range_m, checked)
    wrong = {
        name: count_wrong(
            cast().ravel()[checked], truth_m, 2.0 * world.resolution_m if name == "simulateScanRay" else 1e-6
        )
        for name, cast in casts.items()
    }
    height, width = world.occupancy.shape
    print(
        f"{args.map}: {width} x {height} cells of {world.resolution_m} m, {POSES} poses x {BEAMS} beams "
        f"to {args.max_range_m:g} m, mean {ranges_m[np.isfinite(ranges_m)].mean():.1f} m"
    )
    print(f"{'':17}{'million rays / CPU s':>21}{'wrong of ' + str(CHECKED_RAYS):>16}")
    for name in casts:
        print(f"{name:17}{rates[name] / 1e6:21.1f}{wrong[name]:16d}")
    print_surfaces(world, exact, rng, args.max_range_m)

    speed_up = rates["exact"] / rates["simulateScanRay"]
    passed = speed_up >= MIN_SPEED_UP and wrong["exact"] == 0
    print(
        f"exact is {speed_up:.1f} times simulateScanRay (bar {MIN_SPEED_UP:g}), {wrong['exact']} rays wrong (bar 0): "
        f"{'passed' if passed else 'MISSED'}"
    )
    return 0 if passed else 1


def poses_in(world: GridMap, rng: np.random.Generator, count: int) -> np.ndarray:
    """(P, 3) poses anywhere in the free cells, facing anywhere."""
    rows, columns = np.nonzero(world.free)
    picked = rng.integers(len(rows), size=count)
    offset = rng.uniform(-0.5, 0.5, (2, count))
    points_m = world.centres(rows[picked] + offset[0], columns[picked] + offset[1])
    return np.c_[points_m, rng.uniform(-np.pi, np.pi, count)]


def alternate(casts: Dict[str, Callable[[], np.ndarray]], rays: int) -> Dict[str, float]:
    """Rays per CPU second of each, in alternation, so that a busy machine affects all alike."""
    best = dict.fromkeys(casts, np.inf)
    for _ in range(TURNS):
        for name, cast in casts.items():
            start = time.process_time()
            cast()
            best[name] = min(best[name], time.process_time() - start)
    return {name: rays / seconds for name, seconds in best.items()}


def slow_ranges(
    world: GridMap, poses: np.ndarray, angles_rad: np.ndarray, max_range_m: float, rays: np.ndarray
) -> np.ndarray:
    """(N,) ranges of the rays with these flat indices, by the slow traversal."""
    in_grid = se2.compose(se2.inverse(world.map_from_grid), poses)
    in_grid[:, :2] /= world.resolution_m
    occupied, t_max = world.occupied, max_range_m / world.resolution_m
    lengths = [
        slow_raycast.first_hit(occupied, *in_grid[pose, :2], in_grid[pose, 2] + angles_rad[beam], t_max)[0]
        for pose, beam in zip(*np.divmod(rays, len(angles_rad)))
    ]
    return np.array(lengths) * world.resolution_m


def count_wrong(ranges_m: np.ndarray, truth_m: np.ndarray, tolerance_m: float) -> int:
    with np.errstate(invalid="ignore"):  # inf - inf: equal, not close
        return int(np.sum(~((ranges_m == truth_m) | (np.abs(ranges_m - truth_m) <= tolerance_m))))


def print_surfaces(world: GridMap, caster: RayCaster, rng: np.random.Generator, max_range_m: float) -> None:
    start = time.process_time()
    caster.normals()
    print(f"normals of the whole map: {1e3 * (time.process_time() - start):.0f} ms")
    near = poses_in(world, rng, 1) + rng.normal(0.0, [0.1, 0.1, 0.05], (60, 3))
    batches = {
        f"{POSES} x {BEAMS} anywhere": (poses_in(world, rng, POSES), BEAMS),
        "60 x 720 around one pose": (near, 720),
    }
    for name, (poses, beams) in batches.items():
        angles_rad = np.linspace(-np.pi, np.pi, beams, endpoint=False)
        rate = alternate(
            {name: lambda p=poses, a=angles_rad: caster.cast_surfaces(p, a, max_range_m).first_m}, len(poses) * beams
        )[name]
        print(f"cast_surfaces, {name}: {rate / 1e6:.1f} million rays / CPU s, {1e3 * len(poses) * beams / rate:.1f} ms")


if __name__ == "__main__":
    sys.exit(main())
