#!/usr/bin/env python3
"""Stock move_base with four localizations, in the same buildings, to the same goals, in simulated time.

    python test/benchmark/navigation.py --buildings glass_bridge --lidars weak --seeds 1
    python test/benchmark/navigation.py --out nav --speed-factor 0.5          # slower, on a busy machine
    python test/benchmark/navigation.py --stacks amcl glass_nav --busy 2      # beside two processes that never rest

Needs move_base, navfn, dwa_local_planner and amcl: from apt on Noetic, else built from their public source and in
ROS_PACKAGE_PATH. A goal counts as reached if the robot truly stands within 0.3 m of it when it ends; `wrong` are goals
that move_base says it reached and did not. `tf` counts move_base's lines about transforms that came too late, `late` the
share of asks for the newest map -> odom, ten times a second and without waiting, that had no answer. Glass is the share of
it within 1.5 m, and from there to 2.25 m, that is in the local costmap, once it was in view; `phantom` the share of local
costmaps with a cell more than 0.2 m from everything that is or was there, `outdated` with a cell where the map shows a
closed door or furniture that is gone, `drifted` with one that was right when it was marked, before a wheel slipped: the
local costmap moves with the odometry. Writes a JSON file per run to --out.
"""

from __future__ import annotations

import argparse
import contextlib
import itertools
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, Dict, Iterator, List, NamedTuple, Sequence

REPO = Path(__file__).resolve().parents[2]
NAVIGATION = REPO / "test" / "navigation"
LONGEST_RUN_S = 3600.0
COLUMNS = {
    "reached": "reached", "said": "said", "wrong": "said_wrongly", "contacts": "contacts", "time, s": "time_s",
    "mean, m": "error_mean_m", "max, m": "error_max_m", "recoveries": "recoveries", "tf": "tf_errors",
    "late": "unanswered", "glass": "glass_near", "far": "glass_far", "phantom": "phantoms", "outdated": "outdated", "drifted": "drifted", "CPU": "cpu",
}  # fmt: skip


class Stack(NamedTuple):
    """A localization, and what the costmaps see."""

    launch: Path
    arguments: "tuple[str, ...]"
    node: str


OURS, AMCL = REPO / "launch" / "navigation.launch", NAVIGATION / "amcl.launch"
STACKS = {
    "amcl": Stack(AMCL, (), "/amcl"),
    "amcl_tuned": Stack(AMCL, (f"amcl_params:={NAVIGATION / 'amcl_tuned.yaml'}",), "/amcl"),
    "glass_nav": Stack(OURS, (), "/glass_localization"),
    "glass_nav_both": Stack(OURS, (f"costmap_glass:={NAVIGATION / 'costmap_both.yaml'}",), "/glass_localization"),
    "glass_nav_scan": Stack(OURS, ("glass:=false",), "/glass_localization"),
}


NEEDED = ("amcl", "move_base", "navfn", "dwa_local_planner")


def missing_packages(needed: Sequence[str] = NEEDED) -> List[str]:
    """Of those that the stacks need."""
    return [name for name in needed if subprocess.run(["rospack", "find", name], capture_output=True).returncode]


def run(stack: Stack, building: str, lidar: str, seed: int, goals: int, speed_factor: float, folder: Path) -> Any:
    """One run, with a master of its own: its row; None if it did not end."""
    out = folder / "row.json"
    with socket.socket() as probe:
        probe.bind(("localhost", 0))
        port = str(probe.getsockname()[1])
    environment = {**os.environ, "ROS_MASTER_URI": f"http://localhost:{port}", "ROS_HOSTNAME": "localhost"}
    environment["ROS_LOG_DIR"] = str(folder / "log")
    ride = [str(NAVIGATION / "ride.py"), building, lidar, "--seed", str(seed), "--goals", str(goals)]
    with contextlib.ExitStack() as processes, (folder / "launch.log").open("w") as log:
        launch = ["roslaunch", "-p", port, str(stack.launch), *stack.arguments]
        launch += [f"building:={building}", f"lidar:={lidar}", f"seed:={seed}", f"speed_factor:={speed_factor}"]
        processes.enter_context(_running(launch, environment, log))
        done = processes.enter_context(
            _running([sys.executable, *ride, "--node", stack.node, "--out", str(out)], environment, log)
        )
        with contextlib.suppress(subprocess.TimeoutExpired):
            done.wait(LONGEST_RUN_S)
    return json.loads(out.read_text()) if out.is_file() else None


@contextlib.contextmanager
def _running(command: List[str], environment: Dict[str, str], log: Any) -> Iterator[subprocess.Popen]:
    process = subprocess.Popen(command, env=environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        try:
            process.wait(30.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


@contextlib.contextmanager
def _busy(count: int) -> Iterator[None]:
    """Processes that use a core each."""
    idlers = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in idlers:
            process.kill()
            process.wait()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stacks", nargs="+", choices=list(STACKS), default=["amcl", "amcl_tuned", "glass_nav"])
    parser.add_argument(
        "--buildings", nargs="+", default=["glass_bridge", "glass_office", "glass_atrium", "changed_rooms"]
    )
    parser.add_argument("--lidars", nargs="+", default=["weak", "sensitive"])
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--goals", type=int, default=8)
    parser.add_argument("--speed-factor", type=float, default=1.0, help="simulated seconds in a second (default 1)")
    parser.add_argument("--busy", type=int, default=0, help="processes that use a core each (default 0)")
    parser.add_argument("--out", type=Path, help="folder for a file per run")
    options = parser.parse_args()
    missing = missing_packages()
    if missing:
        print(f"navigation.py: not in ROS_PACKAGE_PATH: {', '.join(missing)}", file=sys.stderr)
        return 2
    print(f"{'building':14} {'lidar':9} seed {'stack':15}" + "".join(f"{name:>11}" for name in COLUMNS), flush=True)
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    failed = 0
    for building, lidar, seed, stack in itertools.product(options.buildings, options.lidars, seeds, options.stacks):
        with tempfile.TemporaryDirectory() as scratch, _busy(options.busy):
            folder = options.out / f"{building}-{lidar}-{seed}-{stack}" if options.out else Path(scratch)
            folder.mkdir(parents=True, exist_ok=True)
            row = run(STACKS[stack], building, lidar, seed, options.goals, options.speed_factor, folder)
        failed += row is None
        figures = "  did not end" if row is None else "".join(f"{row[key]!s:>11}" for key in COLUMNS.values())
        print(f"{building:14} {lidar:9} {seed:4} {stack:15}{figures}", flush=True)
    return min(failed, 1)


if __name__ == "__main__":
    sys.exit(main())
