#!/usr/bin/env python3
"""Screenshots of rviz while a robot wakes up in one of two wings that look alike, for doc/wake-up.md.

    python test/support/wakeup_screenshots.py                        wakeup_5.png, _20.png and _60.png in doc/pictures
    python test/support/wakeup_screenshots.py --at 5 20 --out /tmp/s

Needs rviz, Xvfb and ImageMagick's import (apt: rviz xvfb imagemagick), and a shell with .build/env.bash. rviz draws
without a graphics card, on a display of its own; nothing of the desktop is touched.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import List

import numpy as np
import ros_master
import rospy
import twin_wings
from rosgraph_msgs.msg import Clock

from glass_nav.geometry import se2
from glass_nav.simulation import building_map
from glass_nav.topology.atlas import atlas_builder, atlas_file

REPO = Path(__file__).resolve().parents[2]
PORT = 11731
SIZE = "1400x900"
START_LIMIT_S = 60.0  # of the wall clock, until the simulator runs
FLOOR_SEED = 3
START = (9.0, 0.2, 0.3)  # x, y from the hall into the first wing, yaw


def shots(at_s: List[float], folder: Path, seed: int, speed: float) -> None:
    """One wake-up, with a picture at each simulated time [s]."""
    with tempfile.TemporaryDirectory() as made:
        floor = twin_wings.build(twin_wings.TWIN_WINGS, FLOOR_SEED)
        start = se2.compose(floor.start, np.array(START))
        building = Path(made) / "building.yaml"
        building.write_text(twin_wings.as_file(floor), encoding="utf-8")
        grid_map = building_map.draw(floor)
        atlas_file.save(atlas_builder.build(grid_map, "twin wings", "twin wings")[0], Path(made) / "atlas.json")
        processes: List["subprocess.Popen[bytes]"] = []
        environment = {**os.environ, **_display(processes), "ROS_LOG_DIR": f"{made}/log"}
        try:
            launch = [
                *("roslaunch", "-p", str(PORT), str(REPO / "launch" / "wakeup.launch"), "demo:=false"),
                *(f"building:={building}", f"atlas:={made}/atlas.json", f"seed:={seed}", f"speed_factor:={speed}"),
                "start:=" + " ".join(map(str, start)),
            ]
            with open(folder / "wakeup.log", "wb") as log:
                processes.append(subprocess.Popen(launch, env=environment, stdout=log, stderr=log))
            _photograph(at_s, folder, environment)
        finally:
            for process in reversed(processes):
                process.send_signal(signal.SIGINT)
                process.wait()


def _display(processes: List["subprocess.Popen[bytes]"]) -> "dict[str, str]":
    """Variables for a new display, whose server is added to the processes."""
    reading, writing = os.pipe()
    command = ["Xvfb", "-displayfd", str(writing), "-screen", "0", f"{SIZE}x24"]
    processes.append(
        subprocess.Popen(command, pass_fds=[writing], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    )
    os.close(writing)
    with os.fdopen(reading) as numbers:
        number = numbers.readline().strip()
    return {
        "DISPLAY": f":{number}",
        "LIBGL_ALWAYS_SOFTWARE": "1",
        "QT_X11_NO_MITSHM": "1",
        "ROS_MASTER_URI": f"http://localhost:{PORT}",
        "ROS_HOSTNAME": "localhost",
    }


def _photograph(at_s: List[float], folder: Path, environment: "dict[str, str]") -> None:
    os.environ.update({name: environment[name] for name in ("ROS_MASTER_URI", "ROS_HOSTNAME")})
    deadline_s = time.monotonic() + START_LIMIT_S
    ros_master.wait_until_online(environment["ROS_MASTER_URI"], START_LIMIT_S, folder / "wakeup.log")
    times_s: List[float] = []
    rospy.init_node("wakeup_screenshots", anonymous=True, disable_signals=True)
    rospy.Subscriber("/clock", Clock, lambda msg: times_s.append(msg.clock.to_sec()))
    for wanted_s in sorted(at_s):
        while not times_s or times_s[-1] - times_s[0] < wanted_s:
            if not times_s and time.monotonic() > deadline_s:
                raise SystemExit(f"no /clock within {START_LIMIT_S:g} s: see {folder / 'wakeup.log'}")
            time.sleep(0.05)
        path = folder / f"wakeup_{wanted_s:g}.png"
        subprocess.run(
            ["import", "-window", "root", "-dither", "None", "-colors", "128", f"PNG8:{path}"],
            env=environment,
            check=True,
        )
        print(path, flush=True)


def main() -> None:
    """Take them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--at", type=float, nargs="+", default=[5.0, 20.0, 60.0], metavar="S", help="simulated times")
    parser.add_argument("--out", type=Path, default=REPO / "doc" / "pictures", metavar="DIR")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--speed", type=float, default=0.5, help="simulated seconds in a second; software drawing is slow"
    )
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    shots(given.at, given.out, given.seed, given.speed)


if __name__ == "__main__":
    sys.exit(main())
