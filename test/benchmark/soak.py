#!/usr/bin/env python3
"""Does the node last?  The real node on a simulated robot, fed faster than it can compute, with faults of all kinds.

    python test/benchmark/soak.py                 # 30 simulated minutes, some 7 minutes by the clock
    python test/benchmark/soak.py --minutes 3     # what CI runs, about one minute

Starts a ROS master on a free port and one localization_node (source .build/env.bash first). The robot drives back and
forth through a building of glass. Each simulated minute has: other parameters by dynamic_reconfigure, bad ones too;
seconds without scans; seconds without odometry; another map with set_map; scans with invalid values, stamps and frames;
a clock that jumps back; a global search ended by initialpose; and, at the speed of the clock, some seconds without
faults in which the age of tf is measured.

Prints what it found, and exits with 1 if the node ended, or lost or added a thread; if its resident memory after the
last third is more than 5 % above that after the second; if it used a scan although a newer one had arrived before it
finished the previous one; if tf at the speed of the clock was stamped longer than one scan period ago when the next
scan came; or if the pose was wrong at the end of a minute. The age of tf depends on the machine, too: run it on an idle
one.
"""

from __future__ import annotations

import argparse
import math
import os
import queue
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Tuple

import numpy as np

REPO = Path(__file__).resolve().parents[2]
BUILDING = "glass_office"
SCAN_RATE_HZ = 10.0
STEP_S = 0.02
TOLERANCE_NS = 100_000_000  # ~transform_tolerance
POSE_BAR_M = 0.3
LOOK_BACK = 50  # scans
TRANSPORT_S = 0.1  # of a scan to the node, on a busy machine


def master() -> "Tuple[subprocess.Popen[bytes], str]":
    """A ROS master on a free port, and its address."""
    with socket.socket() as probe:
        probe.bind(("localhost", 0))
        port = probe.getsockname()[1]
    process = subprocess.Popen(
        ["rosmaster", "--core", "-p", str(port)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        stdin=subprocess.DEVNULL,
    )
    return process, f"http://localhost:{port}"


@dataclass
class Watch:
    """Observations of the node."""

    memory_kb: List[Tuple[float, int]] = field(default_factory=list)  # simulated time [s], resident
    threads: List[int] = field(default_factory=list)  # at the end of each minute
    passed_over: List[int] = field(default_factory=list)  # newer scans that lay before the node when it took one
    age_s: List[float] = field(default_factory=list)  # of the stamp of tf when a scan comes, at the clock's speed
    pose_off_m: List[float] = field(default_factory=list)  # at the end of each minute
    update_s: List[float] = field(default_factory=list)  # the longest of each second
    used: int = 0
    received: int = 0


class Soak:
    """The robot, the faults and the observations; one thread drives, callbacks store."""

    def __init__(self, node_pid: int, minutes: float, speed: float) -> None:
        import rospy
        from diagnostic_msgs.msg import DiagnosticArray
        from geometry_msgs.msg import PoseWithCovarianceStamped
        from rosgraph_msgs.msg import Clock
        from sensor_msgs.msg import LaserScan
        from tf2_msgs.msg import TFMessage

        from glass_nav.simulation import building_file, building_map, lidar, shipped_buildings
        from glass_nav.simulation.path_follower import PathFollowerParams
        from glass_nav.simulation.simulation import Simulation

        self._pid, self._end_s, self._speed = node_pid, 60.0 * minutes, speed
        building = building_file.load(shipped_buildings.find(BUILDING))
        self._simulation = Simulation(building, lidar.preset("sensitive"), seed=5, scan_rate_hz=SCAN_RATE_HZ)
        self._follower = self._simulation.follower("first", PathFollowerParams(speed_m_s=0.8))
        changed = building.changed(0.5, np.random.default_rng(3))
        self._maps = [building_map.draw(each) for each in (building, changed)]
        self._offset_ns = 0
        self._sent: List[Tuple[int, float]] = []  # stamp, when [s]: scans that the node can use
        self._last_tf: Optional[Tuple[int, Any]] = None  # its stamp
        self._done_s = -math.inf  # when it came
        self._errands: "queue.Queue[Callable[[], None]]" = queue.Queue()
        self.watch = Watch()
        self.notes: List[str] = []
        self._clock = rospy.Publisher("/clock", Clock, queue_size=500, tcp_nodelay=True)
        self._tf = rospy.Publisher("/tf", TFMessage, queue_size=500, tcp_nodelay=True)
        self._scans = rospy.Publisher("scan", LaserScan, queue_size=100, tcp_nodelay=True)
        self._starts = rospy.Publisher("initialpose", PoseWithCovarianceStamped, queue_size=5)
        rospy.Subscriber("/tf", TFMessage, self._hear_tf, queue_size=500, tcp_nodelay=True)
        rospy.Subscriber("/diagnostics", DiagnosticArray, self._hear_diagnostics, queue_size=10)
        threading.Thread(target=self._run_errands, daemon=True).start()

    # -- what is heard

    def _hear_tf(self, msg: Any) -> None:
        from glass_nav.ros import conversions

        now_s = time.monotonic()
        for transform in msg.transforms:
            if transform.header.frame_id == "map":
                valid_ns = conversions.ns_from_stamp(transform.header.stamp)
                newer = sum(
                    1
                    for stamp_ns, sent_s in self._sent[-LOOK_BACK:]
                    if stamp_ns > valid_ns - TOLERANCE_NS + 1000 and sent_s < self._done_s - TRANSPORT_S
                )
                self.watch.passed_over.append(newer)
                self._last_tf, self._done_s = (valid_ns, transform.transform), now_s

    def _hear_diagnostics(self, msg: Any) -> None:
        for status in msg.status:
            values = {each.key: each.value for each in status.values}
            if status.name.endswith(": timing") and "longest update [ms]" in values:
                self.watch.update_s.append(1e-3 * float(values["longest update [ms]"]))
            if status.name.endswith(": scans") and "used" in values:  # not "Node starting up"
                self.watch.used, self.watch.received = int(values["used"]), int(values["received"])

    # -- faults

    def _run_errands(self) -> None:
        import rospy
        from dynamic_reconfigure import DynamicReconfigureCallbackException

        while True:
            errand = self._errands.get()
            try:
                errand()
            except (
                ValueError,
                rospy.ROSException,
                rospy.ServiceException,
                DynamicReconfigureCallbackException,
            ) as err:  # what counts is that the node goes on
                self.notes.append(f"{type(err).__name__}: {' '.join(str(err).split())[:150]}")

    def _reconfigure(self, minute: int) -> None:
        from dynamic_reconfigure import DynamicReconfigureCallbackException
        from dynamic_reconfigure.client import Client

        client = Client("/glass_localization", timeout=20.0)
        client.update_configuration(
            {"laser_z_hit": 0.9 + 0.05 * (minute % 2), "max_particles": 3000 + 500 * (minute % 4)}
        )
        try:
            client.update_configuration({"laser_z_hit": -1.0})
        except DynamicReconfigureCallbackException:  # refused, as it must be
            return
        finally:
            client.close()
        self.notes.append("a bad parameter was not refused")

    def _set_map(self, number: int) -> None:
        import rospy
        from nav_msgs.srv import SetMap, SetMapRequest

        from glass_nav.ros import conversions

        msg = conversions.msg_from_map(self._maps[number % 2], rospy.Time(1), "map")
        if not rospy.ServiceProxy("set_map", SetMap)(SetMapRequest(msg, self._start_msg())).success:
            self.notes.append("set_map was refused")

    def _start_msg(self) -> Any:
        from glass_nav.ros import conversions
        from glass_nav.ros.simulator import frame_messages

        frame = replace(self._frame, map_from_base=self._simulation.map_from_base)
        msg = frame_messages.initial_pose_msg(frame, frame_messages.FrameNames())
        msg.header.stamp = conversions.stamp_from_ns(self._simulation.stamp_ns + self._offset_ns)
        return msg

    def _search(self) -> None:
        import rospy
        from std_srvs.srv import Empty

        rospy.ServiceProxy("global_localization", Empty)()

    def _spoilt(self, msg: Any, number: int) -> Any:
        """Corrupt a scan, in each way in turn."""
        import rospy

        ways: List[Dict[str, Any]] = [
            {"ranges": [math.nan] * len(msg.ranges)},
            {"ranges": []},
            {"range_max": 0.0},
            {"angle_increment": math.nan},
            {"ranges": [0.3] * len(msg.ranges)},
            {"time_increment": -1.0},
            {"ranges": [math.inf] * len(msg.ranges)},
        ]
        way = number % (len(ways) + 3)
        if way < len(ways):
            for name, value in ways[way].items():
                setattr(msg, name, value)
        elif way == len(ways):
            msg.header.stamp = rospy.Time(0)
        elif way == len(ways) + 1:
            msg.header.frame_id = f"nowhere_{number}"
        else:
            msg.header.stamp += rospy.Duration(-20.0)
        return msg

    # -- the drive

    def run(self, is_alive: Callable[[], bool]) -> None:
        """Run until the simulated time or the node ends."""
        import rospy
        from rosgraph_msgs.msg import Clock
        from tf2_msgs.msg import TFMessage

        from glass_nav.ros import conversions
        from glass_nav.ros.simulator import frame_messages

        simulation = self._simulation
        self._frame = simulation.look()
        began_ns = simulation.stamp_ns
        due_s, next_scan_s, scans, last_event = time.monotonic(), 0.0, 0, -1
        while is_alive() and not rospy.is_shutdown():
            run_s = (simulation.stamp_ns - began_ns) * 1e-9
            if run_s >= self._end_s:
                return
            minute, second = divmod(run_s, 60.0)
            if int(run_s) != last_event:
                last_event = int(run_s)
                self._second(int(minute), int(second), run_s)
            stamp_ns = simulation.stamp_ns + self._offset_ns
            self._clock.publish(Clock(conversions.stamp_from_ns(stamp_ns)))
            transforms = [conversions.transform_stamped(stamp_ns, "base_link", "laser", simulation.base_from_laser)]
            if not 18.0 <= second < 21.0:
                transforms.append(
                    conversions.transform_stamped(stamp_ns, "odom", "base_link", simulation.reading.odom_from_base)
                )
            self._tf.publish(TFMessage(transforms))
            if run_s >= next_scan_s:
                next_scan_s += 1.0 / SCAN_RATE_HZ
                scans += 1
                self._frame = simulation.look()
                msg = frame_messages.scan_msg(self._frame.scan, 1.0 / SCAN_RATE_HZ, "laser")
                msg.header.stamp = conversions.stamp_from_ns(self._frame.stamp_ns + self._offset_ns)
                if 32.0 <= second < 34.0:
                    self._scans.publish(self._spoilt(msg, scans))
                elif not 10.0 <= second < 13.0:
                    if self._is_calm(second) and self._last_tf is not None:
                        age_ns = self._frame.stamp_ns + self._offset_ns - self._last_tf[0]
                        self.watch.age_s.append(max(0.0, age_ns * 1e-9))
                    self._scans.publish(msg)
                    if not 17.0 <= second < 22.0:
                        self._sent.append((self._frame.stamp_ns + self._offset_ns, time.monotonic()))
                        del self._sent[: -2 * LOOK_BACK]
            if self._follower.done:
                self._follower = self._follower.back()
            simulation.move(STEP_S, self._follower.command(simulation.map_from_base))
            due_s = max(due_s + STEP_S / (1.0 if 50.0 <= second < 55.0 else self._speed), time.monotonic() - 0.2)
            time.sleep(max(0.0, due_s - time.monotonic()))

    @staticmethod
    def _is_calm(second: float) -> bool:
        """Within the seconds at the speed of the clock, when what was before is over."""
        return 51.0 <= second < 55.0

    def _second(self, minute: int, second: int, run_s: float) -> None:
        """Events that happen once, at a second of each minute."""
        self.watch.memory_kb.append((run_s, self._status("VmRSS")))
        if run_s < 3.0 or second in (39, 46):
            self._starts.publish(self._start_msg())
        if second == 5:
            self._errands.put(lambda: self._reconfigure(minute))
        elif second == 26:
            self._errands.put(lambda: self._set_map(minute + 1))
        elif second == 38:
            self._offset_ns -= 30_000_000_000
            self._sent.clear()
        elif second == 44:
            self._errands.put(self._search)
        elif second == 50:
            self.watch.threads.append(self._status("Threads"))
        elif 50 < second < 55:  # a connection that just opens or closes has a thread of its own
            self.watch.threads[-1] = min(self.watch.threads[-1], self._status("Threads"))
        elif second == 55:
            self.watch.pose_off_m.append(self._pose_off_m())

    def _pose_off_m(self) -> float:
        from glass_nav.geometry import se2
        from glass_nav.ros import conversions

        if self._last_tf is None:
            return math.inf
        reported = se2.compose(
            conversions.planar_from_transform(self._last_tf[1]), self._simulation.reading.odom_from_base
        )
        return float(np.hypot(*(reported - self._simulation.map_from_base)[:2]))

    def _status(self, name: str) -> int:
        """A figure of the node's process; 0 once it is gone."""
        try:
            lines = Path(f"/proc/{self._pid}/status").read_text().splitlines()
        except OSError:
            return 0
        return int(next((line.split()[1] for line in lines if line.startswith(name + ":")), "0"))


def thirds(watch: Watch) -> "List[float]":
    """Resident memory [MB] at the end of each third: the median of its last quarter."""
    times_s, memory_kb = np.array(watch.memory_kb, float).T
    ends_s = times_s[-1] * np.arange(1, 4) / 3.0
    return [
        float(np.median(memory_kb[(times_s > end_s - times_s[-1] / 12.0) & (times_s <= end_s)])) / 1024.0
        for end_s in ends_s
    ]


def faults(soak: Soak, alive: bool, memory_bar: float, any_age: bool) -> List[str]:
    """The bars that were missed."""
    watch, missed = soak.watch, []
    if not alive:
        missed.append("the node ended")
    memory_mb = thirds(watch)
    if memory_mb[2] > memory_bar * memory_mb[1]:
        missed.append(f"memory after the last third {memory_mb[2] / memory_mb[1] - 1.0:+.1%} against the second")
    settled = watch.threads[1:] or watch.threads
    if max(settled) > settled[0]:
        missed.append(f"threads went from {settled[0]} to {max(settled)}")
    if max(watch.passed_over, default=0) > 0:
        missed.append(f"a scan was used while {max(watch.passed_over)} newer ones lay before the node")
    if not any_age and max(watch.age_s, default=math.inf) > 1.0 / SCAN_RATE_HZ + 1e-6:
        missed.append(
            f"tf was {max(watch.age_s, default=math.inf):.3f} s old, a scan came every {1.0 / SCAN_RATE_HZ} s"
        )
    if max(watch.pose_off_m, default=math.inf) > POSE_BAR_M:
        missed.append(f"the pose was {max(watch.pose_off_m, default=math.inf):.2f} m off at the end of a minute")
    if "a bad parameter was not refused" in soak.notes:
        missed.append("a bad parameter was not refused")
    return missed


def report(soak: Soak, wall_s: float) -> None:
    """The figures."""
    watch = soak.watch
    age_s, passed = np.array(watch.age_s or [np.nan]), np.array(watch.passed_over or [0])
    print(
        f"{soak._end_s / 60.0:g} simulated minutes in {wall_s:.0f} s; {watch.used} of {watch.received} scans used, "
        f"longest updates {1e3 * float(np.median(watch.update_s or [np.nan])):.0f} ms (median of seconds)"
    )
    print("resident memory after each third: " + ", ".join(f"{each:.1f} MB" for each in thirds(watch)))
    print(f"threads at the end of each minute: {watch.threads}")
    print(
        f"newer scans that lay before the node when it took one: at most {passed.max()}, of {len(passed)} in "
        f"{np.count_nonzero(passed)} any"
    )
    print(
        f"age of the stamp of tf when the next scan comes, at the speed of the clock: median "
        f"{np.median(age_s):.3f} s, p99 {np.quantile(age_s, 0.99):.3f} s, most {age_s.max():.3f} s "
        f"({len(age_s)} scans; load of the machine "
        f"{os.getloadavg()[1]:.1f} on {os.cpu_count()} processors)"
    )
    print("position off at the end of each minute: " + ", ".join(f"{each:.3f}" for each in watch.pose_off_m) + " m")
    for note in sorted(set(soak.notes)):
        print(f"note, {soak.notes.count(note)} times: {note}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--minutes", type=float, default=30.0, help="simulated (default 30)")
    parser.add_argument("--speed", type=float, default=6.0, help="simulated seconds in a second (default 6)")
    parser.add_argument(
        "--memory-bar",
        type=float,
        default=1.05,
        metavar="RATIO",
        help="of the last third to the second (default 1.05); the first minutes fill caches",
    )
    parser.add_argument("--any-age", action="store_true", help="do not judge the age of tf: the machine is busy")
    parser.add_argument("--log", type=Path, help="what the node prints; default: a temporary file")
    arguments = parser.parse_args()
    core, address = master()
    log_path = arguments.log or Path(tempfile.mkstemp(prefix="soak_", suffix=".log")[1])
    os.environ.update(ROS_MASTER_URI=address, ROS_HOSTNAME="localhost", ROS_LOG_DIR=tempfile.mkdtemp())
    node: "Optional[subprocess.Popen[bytes]]" = None
    try:
        import rosgraph
        import rospy

        while not rosgraph.is_master_online(address):
            time.sleep(0.05)
        rospy.init_node("soak", disable_rostime=True, disable_signals=True)
        rospy.set_param("/use_sim_time", True)
        with open(log_path, "wb") as log:
            node = subprocess.Popen(
                [str(REPO / "scripts" / "localization_node"), "__name:=glass_localization"],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
            )
        soak = Soak(node.pid, arguments.minutes, arguments.speed)
        serve(soak)
        began_s = time.monotonic()
        soak.run(lambda: node is not None and node.poll() is None)
        report(soak, time.monotonic() - began_s)
        missed = faults(soak, node.poll() is None, arguments.memory_bar, arguments.any_age)
        node.send_signal(signal.SIGINT)
        code = node.wait(20.0)
        text = log_path.read_text(errors="replace")
        missed += [f"the node ended with exit code {code}"] if code else []
        missed += ["the node printed a traceback"] if "Traceback" in text else []
        for line in missed:
            print(f"missed: {line}")
        print(f"what the node said is in {log_path}" if missed or arguments.log else "all bars are met")
        return 1 if missed else 0
    finally:
        if node is not None and node.poll() is None:
            node.kill()
        core.terminate()
        core.wait(10.0)


def serve(soak: Soak) -> None:
    """Serve static_map, for the node's first map, and wait until the node subscribes."""
    import rospy
    from nav_msgs.srv import GetMap, GetMapResponse

    from glass_nav.ros import conversions

    msg = conversions.msg_from_map(soak._maps[0], rospy.Time(1), "map")
    rospy.Service("static_map", GetMap, lambda _: GetMapResponse(msg))
    rospy.wait_for_service("set_map", timeout=30.0)


if __name__ == "__main__":
    sys.exit(main())
