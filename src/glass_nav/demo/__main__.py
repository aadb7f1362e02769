"""What scripts/demo shows of simulated robots: python -m glass_nav.demo --seeds N --out DIR; each seed repeats."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import List, Optional

import numpy as np

from glass_nav.demo import bridge_demo
from glass_nav.demo.simulated_robot import SimulatedRobot
from glass_nav.demo.wake_up_demo import WakeUpDemo, WakeUpDemoParams
from glass_nav.simulation import building_file, building_map, lidar, shipped_buildings, start_place
from glass_nav.simulation.simulation import Simulation
from glass_nav.topology.atlas import atlas_file, shipped_atlases

BUILDING = "glass_office"


def wake_up(seed: int, picture: Path) -> bool:
    """Runs one robot that wakes up at a random place; returns whether it found its place and drove the tour."""
    building = building_file.load(shipped_buildings.find(BUILDING))
    atlas = atlas_file.load(shipped_atlases.find(BUILDING))
    start = start_place.random_place(building, np.random.default_rng(seed))
    simulation = Simulation(building, lidar.preset("sensitive"), seed=seed, start=start)
    robot = SimulatedRobot(simulation, building_map.draw(building), atlas, seed, _say)
    p = WakeUpDemoParams(atlas=BUILDING, picture=str(picture), tour=3, seed=seed)
    return WakeUpDemo(atlas, p, robot.reports, robot).run()


def main(arguments: Optional[List[str]] = None) -> int:
    """Exit code 1 if a robot did not find its place or did not drive its tour."""
    parser = argparse.ArgumentParser(prog="python -m glass_nav.demo", description=__doc__)
    parser.add_argument("--seeds", type=int, default=3, metavar="N", help="seeds 1 to N (default 3)")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the pictures")
    given = parser.parse_args(arguments)
    for line in bridge_demo.lines(given.seeds):
        _say(line)
    succeeded = True
    for seed in range(1, given.seeds + 1):
        _say(f"\nA robot wakes up somewhere in {BUILDING}, seed {seed} of {given.seeds}")
        succeeded = wake_up(seed, given.out / f"wakeup_{seed}.png") and succeeded
    return 0 if succeeded else 1


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
