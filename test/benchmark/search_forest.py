#!/usr/bin/env python3
"""CPU time and memory of a step of the search forest in a large atlas, on one thread.

    python test/benchmark/search_forest.py
    python test/benchmark/search_forest.py --nodes 10000 --trials 200

Atlases are Voronoi graphs of random points. Robots wake up anywhere, report with the noise of the tolerances, and drive
as the search says until it is over; then the same with a detector that misses meetpoints and reports spurious ones, so
that the search considers detection errors. Prints the CPU time of the slowest step and the median of each trial's
slowest, the memory of the atlas, and the peak memory of the process. Exit 1 if a step without detection errors takes
longer than its limit: 10, 60, 300 ms at 10^4, 10^5, 10^6 nodes.
"""

from __future__ import annotations

import argparse
import os
import resource
import sys
import time
from pathlib import Path
from typing import Tuple

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import numpy as np

REPO = Path(__file__).resolve().parents[2]
sys.path.append(str(REPO / "test" / "support"))

import made_atlases
from glass_nav.topology.search import wake_up_trials
from glass_nav.topology.atlas.atlas import Atlas
from glass_nav.topology.search.atlas_localizer import AtlasLocalizer
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.topology.search.atlas_robot import Surroundings, TrialParams

LIMITS_MS = {10_000: 10.0, 100_000: 60.0, 1_000_000: 300.0}


def slowest_steps_ms(
    localizer: AtlasLocalizer, world: Surroundings, p: TrialParams, trials: int, seed: int
) -> Tuple[np.ndarray, float, float]:
    """(trials,) the slowest step of each; mean number of edges; share of trials in which errors were considered."""
    slowest, edges, errors = [], [], []
    for number in range(trials):
        done = wake_up_trials.run(localizer, world, p, np.random.default_rng([seed, number]))
        slowest.append(max(done.step_ms))
        edges.append(done.edges)
        errors.append(localizer.forest.errors > 0)
    return np.array(slowest), float(np.mean(edges)), float(np.mean(errors))


def size_mb(atlas: Atlas) -> float:
    """Memory of the arrays of an atlas."""
    parts = [atlas.nodes, atlas.edges, atlas.darts, atlas.rings, atlas.visits]
    arrays = [value for part in parts for value in vars(part).values()]
    return sum(value.nbytes for value in arrays if isinstance(value, np.ndarray)) / 1e6


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--nodes", type=int, nargs="+", default=list(LIMITS_MS))
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()

    kept = True
    for nodes in arguments.nodes:
        atlas = made_atlases.voronoi(nodes, arguments.seed)
        started = time.process_time()
        localizer, world = AtlasLocalizer(atlas, SearchParams()), Surroundings.of(atlas)
        ready_s = time.process_time() - started
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
        print(
            f"{len(atlas.nodes)} nodes, {len(atlas.edges)} edges: arrays {size_mb(atlas):.0f} MB, process "
            f"{memory:.0f} MB at most, ready in {ready_s:.2f} s"
        )
        limit = LIMITS_MS.get(nodes)
        for what, p in (
            ("no errors", TrialParams()),
            ("10 % missed, 5 % spurious", TrialParams(missed=0.1, spurious=0.05)),
        ):
            slowest, edges, considered = slowest_steps_ms(localizer, world, p, arguments.trials, arguments.seed)
            verdict = ""
            if limit is not None and what == "no errors":
                met = bool(slowest.max() <= limit)
                kept &= met
                verdict = f"   limit {limit:g} ms: {'kept' if met else 'missed'}"
            print(
                f"  {what:26s} worst step {slowest.max():7.1f} ms, median of trials {np.median(slowest):7.1f} ms, "
                f"{edges:.1f} edges, errors considered in {100 * considered:.0f} %{verdict}"
            )
    print(f"process {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3:.0f} MB at most")
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
