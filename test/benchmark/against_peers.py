#!/usr/bin/env python3
"""This node, amcl and MRPT's pf-localization on the same drives, in turn and on one core: CPU, memory, error.

    source .build/env.bash && python test/benchmark/against_peers.py
    python test/benchmark/against_peers.py --drives uob_trace0 glass_office --seconds 20 --rounds 1

Each drive is played with `rosbag play` to one node at a time, from the first pose of the ground truth:

- ours: localization_node as it is;
- ours, 30 and 60 beams: the same node started as amcl is, with amcl's values of the parameters (2000 particles at most);
- amcl with these values and 60 beams, where `rosrun` finds one;
- pf-localization (apt's mrpt-apps), which reads the scans from a file: every scan, 2000 particles at most, the
  likelihood field of pf_localization.py.

CPU is that of the whole process, user and system, from the first scan to the last (pf-localization: also its start),
by the scans of the log; nobody listens to the nodes but to amcl_pose. Memory is resident, at the end (pf-localization:
the highest). Errors are of the poses that a localizer gave, against the ground truth. Medians over the rounds. All
localizers run on the last core of this machine, everything else on the others. Logs are read from GLASS_NAV_DATA,
buildings are simulated.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path
from typing import Callable, Dict, Iterator, List, NamedTuple, Optional, Sequence
from xmlrpc.client import ServerProxy

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1] / "support"))

import pf_localization
import tracks
from glass_nav.evaluation.metrics import pose_errors
from glass_nav.geometry import se2
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.recording.log_file import open_log
from glass_nav.recording.recording import LogOptions, Step
from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap

REPO = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("GLASS_NAV_DATA") or REPO.parent / "shared" / "data")
LOGS, BUILDINGS = ("uob_trace0", "olin_mac", "mit_csail"), ("glass_office", "glass_bridge")
CORE = max(os.sched_getaffinity(0))
START_S = 60.0  # that a node may take to be ready
QUIET_S = 1.0  # after the last scan
PARTICLES = 2000
AMCL = {  # amcl's own values of what this node takes too, but for the number of particles
    "min_particles": 100,
    "max_particles": PARTICLES,
    "update_min_d": 0.2,
    "update_min_a": 0.5236,
    "resample_interval": 2,
    "odom_model_type": "diff",
    **{f"odom_alpha{number}": 0.2 for number in range(1, 6)},
    "laser_model_type": "likelihood_field",
    "laser_z_hit": 0.95,
    "laser_z_rand": 0.05,
    "laser_sigma_hit": 0.2,
}
PF_CHANGES = {"particles_count": str(PARTICLES), "KLD_maxSampleSize": str(PARTICLES)}
PF_START = {"x": 0.5, "y": 0.5, "phi_deg": 15.0}  # half the box around the start that its particles begin in


class Drive(NamedTuple):
    """A bag, and what is in the part of it that is used."""

    name: str
    bag: Path
    map_yaml: Path
    grid_map: GridMap
    steps: List[Step]  # its scans
    truth: Trajectory

    def start(self) -> np.ndarray:
        """(3,) where the robot is at the first scan."""
        return self.truth.at(np.int64(self.steps[0].scan.stamp_ns))


class Figures(NamedTuple):
    """What one run took, and how good it was."""

    cpu_ms: float  # per scan
    memory_mb: float
    poses: int
    median_m: float
    rmse_m: float


class Node(NamedTuple):
    """A program that localizes in ROS."""

    package: str
    program: str
    parameters: Dict[str, object]


def nodes() -> Dict[str, Node]:
    """Those that rosrun finds here."""
    found = {
        "ours": Node("glass_nav", "localization_node", {}),
        "ours, amcl's settings, 60 beams": Node("glass_nav", "amcl", {**AMCL, "laser_max_beams": 60}),
        "ours, amcl's settings, 30 beams": Node("glass_nav", "amcl", {**AMCL, "laser_max_beams": 30}),
        "amcl, 60 beams": Node("amcl", "amcl", {**AMCL, "laser_max_beams": 60}),
    }
    asked = {package: _has_package(package) for package in {node.package for node in found.values()}}
    return {name: node for name, node in found.items() if asked[node.package]}


def _has_package(name: str) -> bool:
    done = subprocess.run(["rospack", "find", name], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return done.returncode == 0


# -- drives


def drive_of(name: str, seed: int, seconds: float, folder: Path) -> Drive:
    """The first seconds of a recorded log, or of a building, which is simulated into that folder."""
    if name in LOGS:
        bag, map_yaml = DATA / "logs" / name / f"{name}.bag", DATA / "logs" / name / "map.yaml"
    else:
        bag = folder / f"{name}.bag"
        map_yaml = bag.with_suffix(".map.yaml")
        command = [sys.executable, str(REPO / "scripts" / "glass_nav"), "simulate", name, "--seed", str(seed)]
        subprocess.run([*command, "--out", str(bag)], stdout=subprocess.DEVNULL, check=True)
    recording = open_log([bag], LogOptions())
    steps = [entry for entry in recording if isinstance(entry, Step)]
    end_ns = steps[0].scan.stamp_ns + int(1e9 * seconds)
    assert recording.ground_truth is not None
    used = [step for step in steps if step.scan.stamp_ns <= end_ns]
    return Drive(name, bag, map_yaml, map_file.load(map_yaml), used, recording.ground_truth)


def errors_of(drive: Drive, stamps_ns: Sequence[int], map_from_base: np.ndarray) -> "tuple[float, float]":
    """Median and root mean square [m]; NaN without a pose."""
    if not len(stamps_ns):
        return float("nan"), float("nan")
    found = pose_errors.of(np.array(stamps_ns, np.int64), map_from_base, drive.truth)
    off_m = found.position_m[found.matched]
    return float(np.median(off_m)), float(np.sqrt(np.mean(off_m**2)))


# -- nodes


def on_core(command: Sequence[str], log: Path) -> "subprocess.Popen[bytes]":
    """Start a program on the core of the localizers."""
    with log.open("ab") as out:
        return subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=out,
            preexec_fn=lambda: os.sched_setaffinity(0, {CORE}),
        )


@contextmanager
def running(command: Sequence[str], log: Path, start: Callable[..., "subprocess.Popen[bytes]"]) -> Iterator[None]:
    """A program that ends with the block."""
    process = start(command, log)
    try:
        yield
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(20.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def elsewhere(command: Sequence[str], log: Path) -> "subprocess.Popen[bytes]":
    """Start a program on the cores of this one."""
    with log.open("ab") as out:
        return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=out, stderr=out)


def run_node(node: Node, drive: Drive, rate: float, log: Path) -> Figures:
    """Play the drive to the node; roscore runs already."""
    import rosgraph
    import rospy
    from geometry_msgs.msg import PoseWithCovarianceStamped

    from glass_nav.ros import conversions

    heard: List[PoseWithCovarianceStamped] = []
    listener = rospy.Subscriber("amcl_pose", PoseWithCovarianceStamped, heard.append)
    start = dict(zip(("initial_pose_x", "initial_pose_y", "initial_pose_a"), drive.start().tolist()))
    parameters = [f"_{name}:={value}" for name, value in {**node.parameters, **start}.items()]
    command = ["rosrun", node.package, node.program, "__name:=localizer", *parameters]
    with running(["rosrun", "glass_nav", "map_node", str(drive.map_yaml)], log, elsewhere):
        rospy.wait_for_service("static_map", START_S)
        with running(command, log, on_core):
            _wait_until_ready()
            uri = rosgraph.Master(rospy.get_name()).lookupNode("/localizer")
            pid = int(ServerProxy(uri).getPid(rospy.get_name())[2])
            before_s = cpu_s(pid)
            play = ["rosbag", "play", "--clock", "-q", "-r", str(rate), str(drive.bag)]
            used_s = 1e-9 * (drive.steps[-1].scan.stamp_ns - drive.steps[0].scan.stamp_ns) + 0.5
            topics = ["--topics", "/scan", "/tf", "/tf_static"]
            with log.open("ab") as out:
                subprocess.run([*play, "-u", f"{used_s:.2f}", *topics], stdout=out, stderr=out, check=True)
            time.sleep(QUIET_S)
            used_s, memory_mb = cpu_s(pid) - before_s, resident_mb(pid)
    listener.unregister()
    stamps_ns = [conversions.ns_from_stamp(msg.header.stamp) for msg in heard]
    poses = np.array([conversions.planar_from_pose(msg.pose.pose) for msg in heard], float).reshape(-1, 3)
    known = np.array(stamps_ns) >= drive.steps[0].scan.stamp_ns
    errors = errors_of(drive, np.array(stamps_ns)[known], poses[known]) if len(poses) else errors_of(drive, [], poses)
    return Figures(1e3 * used_s / len(drive.steps), memory_mb, int(np.sum(known)), *errors)


def _wait_until_ready() -> None:
    """The node takes requests: it has its map."""
    import rospy
    from std_srvs.srv import Empty

    rospy.wait_for_service("request_nomotion_update", START_S)
    end_s = time.monotonic() + START_S
    while True:
        try:
            rospy.ServiceProxy("request_nomotion_update", Empty)()
            return
        except rospy.ServiceException:
            if time.monotonic() > end_s:
                raise
            time.sleep(0.2)


def cpu_s(pid: int) -> float:
    """CPU seconds of a process, user and system."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def resident_mb(pid: int) -> float:
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") * 1e-6


@contextmanager
def master(log: Path) -> Iterator[None]:
    """A roscore of our own, on simulated time, that this process is a node of."""
    with socket.socket() as free:
        free.bind(("localhost", 0))
        port = free.getsockname()[1]
    os.environ["ROS_MASTER_URI"] = f"http://localhost:{port}"
    with running(["roscore", "-p", str(port)], log, elsewhere):
        import ros_master
        import rospy

        ros_master.wait_until_online(os.environ["ROS_MASTER_URI"], START_S, log)
        rospy.set_param("/use_sim_time", False)  # of this process; the localizers are started with true
        rospy.init_node("against_peers", disable_signals=True)
        rospy.set_param("/use_sim_time", True)
        yield


# -- pf-localization


def run_pf(drive: Drive, folder: Path) -> Figures:
    """The drive from a file through pf-localization."""
    moments = [
        tracks.Moment(step.scan, step.odom_from_base, drive.truth.at(np.int64(step.scan.stamp_ns)))
        for step in drive.steps
    ]
    folder.mkdir()
    steps = [pf_localization.Step(0.0, moment) for moment in moments]
    config = pf_localization.write(folder, drive.grid_map, steps, pf_localization.settings_with(PF_CHANGES))
    grid_from_base = se2.compose(se2.inverse(drive.grid_map.map_from_grid), drive.start())
    config.write_text(started_around(config.read_text(), grid_from_base))
    log = config.with_name("log.txt")
    process = on_core(["pf-localization", str(config)], log)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = status
    if status:
        raise RuntimeError(f"pf-localization: exit status {status}:\n{log.read_text()[-2000:]}")
    found = se2.compose(drive.grid_map.map_from_grid, pf_localization.means_in(log.read_text()))
    stamps_ns = [step.scan.stamp_ns for step in drive.steps[: len(found)]]
    cpu_ms = 1e3 * (usage.ru_utime + usage.ru_stime) / len(drive.steps)
    return Figures(cpu_ms, usage.ru_maxrss * 1024e-6, len(found), *errors_of(drive, stamps_ns, found))


def started_around(config: str, grid_from_base: np.ndarray) -> str:
    """A config of pf-localization whose particles begin in a box around a pose (3,) in the frame of its grid."""
    middle = dict(zip(PF_START, (grid_from_base[0], grid_from_base[1], np.degrees(grid_from_base[2]))))
    box = [
        f"init_PDF_{end}_{axis} = {middle[axis] + sign * half:.6f}"
        for axis, half in PF_START.items()
        for end, sign in (("min", -1.0), ("max", 1.0))
    ]
    section = "[LocalizationExperiment]\n"
    others = re.sub(r"(?m)^init_PDF_m.*\n", "", config)
    return others.replace(section, section + "\n".join(["init_PDF_mode = 1", *box, ""]))


# -- the table


HEADER = (
    "| drive | localizer | CPU ms a scan | of pf-localization's | memory MB | poses | median m | rmse m |\n"
    "|---|---|---|---|---|---|---|---|"
)


def row(drive: str, name: str, figures: Figures, pf: Optional[Figures]) -> str:
    """A line of the table."""
    ratio = "" if pf is None else f"{figures.cpu_ms / pf.cpu_ms:.2f}"
    return (
        f"| {drive} | {name} | {figures.cpu_ms:.1f} | {ratio} | {figures.memory_mb:.0f} | {figures.poses} | "
        f"{figures.median_m:.3f} | {figures.rmse_m:.3f} |"
    )


def main() -> int:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--drives", nargs="+", default=[*LOGS, *BUILDINGS], metavar="NAME")
    parser.add_argument("--seconds", type=float, default=40.0, help="of each drive (default 40)")
    parser.add_argument("--rate", type=float, default=1.0, help="of playing (default 1, the drive's own speed)")
    parser.add_argument("--rounds", type=int, default=3, help="runs of each, in turn (default 3)")
    parser.add_argument("--seed", type=int, default=0, help="of the simulated buildings")
    arguments = parser.parse_args()
    os.sched_setaffinity(0, (os.sched_getaffinity(0) - {CORE}) or {CORE})
    found, has_pf = nodes(), shutil.which("pf-localization") is not None
    if has_pf:
        pf_localization.writer()
    else:
        print("no pf-localization here: apt-get install mrpt-apps")
    if not any(node.package == "amcl" for node in found.values()):
        print("rosrun finds no amcl here")
    print(HEADER, flush=True)
    with tempfile.TemporaryDirectory(prefix="against_peers_") as temporary:
        folder = Path(temporary)
        log = folder / "programs.log"
        with master(log):
            for name in arguments.drives:
                drive = drive_of(name, arguments.seed, arguments.seconds, folder)
                runs: Dict[str, List[Figures]] = {}
                for number in range(arguments.rounds):
                    for each, node in found.items():
                        runs.setdefault(each, []).append(run_node(node, drive, arguments.rate, log))
                    if has_pf:
                        runs.setdefault("pf-localization", []).append(run_pf(drive, folder / f"pf_{name}_{number}"))
                median = {each: Figures(*np.median(np.array(all_of), axis=0)) for each, all_of in runs.items()}
                for each, figures in median.items():
                    print(row(name, each, figures._replace(poses=int(figures.poses)), median.get("pf-localization")))
                sys.stdout.flush()
    return 0


if __name__ == "__main__":
    sys.exit(main())
