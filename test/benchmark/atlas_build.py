#!/usr/bin/env python3
"""CPU time and memory to build an atlas.

    python test/benchmark/atlas_build.py
    python test/benchmark/atlas_build.py --map ../shared/data/maps/huge_map.yaml
    /usr/bin/time -v python test/benchmark/atlas_build.py

The map is a generated office floor of --cells x --cells cells of 0.05 m (corridors, rooms with doors and furniture, 30
% of the cells along the walls rough), or --map. Prints CPU seconds of the graph and of the segment maps on one thread,
the peak memory, and with --others the cost of alternatives: scipy's Voronoi instead of Delaunay, and the feature
transform that thinning of the free space would start from. Exit 1 if --limit-s or --limit-mb is exceeded.
"""

from __future__ import annotations

import argparse
import os
import resource
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from typing import Callable, Iterator

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import numpy as np
from scipy import ndimage
from scipy.spatial import Delaunay, Voronoi

from glass_nav.topology.atlas import atlas_builder
from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap

CELL_M = 0.05
BLOCK = 200  # cells of a block of rooms with the corridors around it: 10 m


def office(cells: int, rng: np.random.Generator) -> GridMap:
    """Blocks of four rooms between corridors of 2 m."""
    block = np.zeros((BLOCK, BLOCK), np.int8)
    block[20:180, 20:180] = 100
    for row in (24, 102):
        for column in (24, 102):
            block[row : row + 74, column : column + 74] = 0
    for column in (50, 130):
        block[20:24, column : column + 20] = block[176:180, column : column + 20] = 0
    occupancy = np.tile(block, (cells // BLOCK + 1, cells // BLOCK + 1))[:cells, :cells]
    for row, column in zip(*(rng.integers(0, cells, cells // 8) for _ in range(2))):  # furniture
        height, width = rng.integers(8, 25, 2)
        occupancy[row : row + height, column : column + width] = 100
    free = occupancy == 0
    wall_edge, free_edge = ~free & ndimage.binary_dilation(free), free & ndimage.binary_dilation(~free)
    rough = rng.random(occupancy.shape) < 0.3
    occupancy[wall_edge & rough], occupancy[free_edge & rough] = 0, 100
    occupancy[[0, -1]] = occupancy[:, [0, -1]] = 100
    return GridMap(occupancy, CELL_M, np.zeros(3))


def cpu_s(work: Callable[[], object]) -> float:
    started = time.process_time()
    work()
    return time.process_time() - started


def peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--map", type=Path, help="instead of the generated floor")
    parser.add_argument("--cells", type=int, default=4000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--others", action="store_true", help="time the alternatives as well")
    parser.add_argument("--limit-s", type=float, default=60.0)
    parser.add_argument("--limit-mb", type=float, default=2000.0)
    arguments = parser.parse_args()

    if arguments.map is None:
        grid_map = office(arguments.cells, np.random.default_rng(arguments.seed))
    else:
        grid_map = map_file.load(arguments.map)
    before_mb, spent_s = peak_mb(), {}

    @contextmanager
    def watch(what: str, steps: int) -> Iterator[Callable[[], None]]:
        started = time.process_time()
        yield lambda: None
        spent_s[what] = time.process_time() - started

    built = []
    total_s = cpu_s(lambda: built.append(atlas_builder.build(grid_map, "benchmark", "benchmark", watch=watch)[0]))
    used_mb, atlas = peak_mb(), built[0]
    rows, columns = grid_map.occupancy.shape
    print(
        f"{rows} x {columns} cells: {len(atlas.nodes)} nodes, {len(atlas.edges)} edges, "
        f"{atlas.components()[0]} parts, {atlas.edges.length_m.sum():.0f} m, "
        f"{len(atlas.darts.segments_m.values)} segments"
    )
    print(f"  CPU {total_s:.1f} s: " + ", ".join(f"{what} {seconds:.1f} s" for what, seconds in spent_s.items()))
    print(f"  peak memory {used_mb:.0f} MB, {before_mb:.0f} MB of them before")
    if arguments.others:
        free = grid_map.free
        points = np.argwhere(ndimage.binary_dilation(free, np.ones((3, 3), bool)) & ~free).astype(float)
        print(
            f"  of {len(points)} cells that bound free space: Delaunay {cpu_s(lambda: Delaunay(points)):.1f} s, "
            f"Voronoi {cpu_s(lambda: Voronoi(points)):.1f} s; feature transform of the grid "
            f"{cpu_s(lambda: ndimage.distance_transform_edt(free, return_indices=True)):.1f} s; "
            f"peak now {peak_mb():.0f} MB"
        )
    limits = [
        (f"{arguments.limit_s:g} s CPU", total_s <= arguments.limit_s),
        (f"{arguments.limit_mb:g} MB", used_mb <= arguments.limit_mb),
    ]
    for limit, kept in limits:
        print(f"  limit {limit}: {'kept' if kept else 'missed'}")
    return 0 if all(kept for _, kept in limits) else 1


if __name__ == "__main__":
    sys.exit(main())
