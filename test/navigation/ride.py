#!/usr/bin/env python3
"""Drives a simulated robot to goals with a running move_base, and writes down what happened: one line of JSON.

Started by test/benchmark/navigation.py and test_navigation.py, with navigation.launch or amcl.launch running.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import signal
import subprocess
import sys
import threading
import xmlrpc.client
from pathlib import Path
from typing import Any, Dict, Iterable, List, Optional, Tuple

sys.path.append(str(Path(__file__).resolve().parents[1] / "support"))

import actionlib
import impatient_client
import numpy as np
import rosgraph
import rospy
import tf2_ros
from actionlib_msgs.msg import GoalStatus
from costmap_truth import CostmapTruth, occupied_cells
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal, RecoveryStatus
from nav_msgs.msg import OccupancyGrid, Odometry
from rosgraph_msgs.msg import Log
from std_msgs.msg import Bool

from glass_nav.geometry import angles, se2
from glass_nav.geometry.polyline import Polyline
from glass_nav.ros import conversions
from glass_nav.simulation import building_file, lidar, shipped_buildings
from glass_nav.simulation.simulation import LASER, START_NS, Simulation

REACHED_M = 0.3
SLOWEST_M_S, GOAL_EXTRA_S = 0.15, 40.0  # a goal that takes longer is given up
TF_LINES = re.compile(
    r"xtrapolat|transform timeout|Could not transform the global plan|TF Error|Transform timeout", re.I
)
COSTMAP = "/move_base/local_costmap/costmap"
KEPT = 40  # costmaps, two a second: a cell may have been marked so long ago


class Ride:
    """Subscribes to the truth, and sends goals."""

    def __init__(self, simulation: Simulation) -> None:
        self._truth = CostmapTruth(simulation.building, simulation.lidar_model.field_of_view_rad / 2.0)
        self._lock = threading.Lock()
        self._poses: List[Tuple[int, np.ndarray]] = []  # true
        self._odometry: List[Tuple[int, np.ndarray]] = []
        self.contacts, self.recoveries = 0, 0
        self.tf_lines: List[str] = []
        self.errors_m: List[float] = []
        self.scores: List[Any] = []
        self.phantom_cells: List[List[Any]] = []  # time, robot, cell, outdated, drifted
        self._unscored: List[OccupancyGrid] = []
        self._past: List[np.ndarray] = []  # true map_from_odom (3,) of the last costmaps
        self._tf = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._tf, tcp_nodelay=True)
        rospy.Subscriber("ground_truth", PoseStamped, self._hear_truth, queue_size=1000, tcp_nodelay=True)
        rospy.Subscriber("odom", Odometry, self._hear_odometry, queue_size=1000, tcp_nodelay=True)
        rospy.Subscriber("/simulator/blocked", Bool, self._hear_blocked, queue_size=100)
        rospy.Subscriber("/rosout", Log, self._hear_log, queue_size=1000)
        rospy.Subscriber("/move_base/recovery_status", RecoveryStatus, self._hear_recovery, queue_size=100)
        rospy.Subscriber(COSTMAP, OccupancyGrid, self._hear_costmap, queue_size=100, buff_size=2**22)

    @property
    def pose(self) -> Optional[np.ndarray]:
        """(3,) where the robot is; None before the first scan."""
        return self._poses[-1][1] if self._poses else None

    def localized(self) -> bool:
        return self._tf.can_transform("map", "base_link", rospy.Time())

    def _hear_truth(self, msg: PoseStamped) -> None:
        stamp_ns, pose = conversions.ns_from_stamp(msg.header.stamp), conversions.planar_from_pose(msg.pose)
        with self._lock:
            self._poses.append((stamp_ns, pose))
            self._truth.look(se2.compose(pose, np.array(LASER)))
            self._compare(stamp_ns)
            self._score()

    def _compare(self, now_ns: int) -> None:
        """The pose in tf of a scan that half a second old."""
        old = [each for each in self._poses[-8:-5] if now_ns - each[0] > 0.45e9]
        if not old:
            return
        stamp_ns, pose = old[-1]
        try:
            found = self._tf.lookup_transform("map", "base_link", conversions.stamp_from_ns(stamp_ns))
        except tf2_ros.TransformException:
            return
        self.errors_m.append(float(np.hypot(*(conversions.planar_from_transform(found.transform) - pose)[:2])))

    def _score(self) -> None:
        """The costmaps whose true pose is known by now."""
        if len(self._poses) < 2 or not self._odometry:
            return
        known_ns = min(self._poses[-1][0], self._odometry[-1][0])
        while self._unscored and self._unscored[0].header.stamp.to_nsec() <= known_ns:
            msg = self._unscored.pop(0)
            stamp_ns = msg.header.stamp.to_nsec()
            pose, map_from_odom = _at(self._poses, stamp_ns), self._map_from_odom(stamp_ns)
            grid = se2.compose(map_from_odom, conversions.planar_from_pose(msg.info.origin))
            cells = np.array(msg.data, np.int8).reshape(msg.info.height, msg.info.width)
            score = self._truth.score(
                occupied_cells(cells, msg.info.resolution, grid),
                pose,
                (stamp_ns - START_NS) * 1e-9,
                np.array([se2.compose(then, se2.inverse(map_from_odom)) for then in self._past]).reshape(-1, 3),
            )
            self._past = [*self._past, map_from_odom][-KEPT:]
            self.scores.append(score)
            self.phantom_cells += [
                [round(stamp_ns * 1e-9, 2), *np.round(pose, 2), *np.round(cell, 2), bool(old), bool(moved)]
                for cell, old, moved in zip(score.phantoms.tolist(), score.outdated, score.drifted)
            ]

    def _map_from_odom(self, stamp_ns: int) -> np.ndarray:
        """(3,) true."""
        return se2.compose(_at(self._poses, stamp_ns), se2.inverse(_at(self._odometry, stamp_ns)))

    def _hear_odometry(self, msg: Odometry) -> None:
        self._odometry.append((msg.header.stamp.to_nsec(), conversions.planar_from_pose(msg.pose.pose)))

    def _hear_costmap(self, msg: OccupancyGrid) -> None:
        with self._lock:
            self._unscored.append(msg)

    def _hear_blocked(self, msg: Bool) -> None:
        self.contacts += msg.data

    def _hear_log(self, msg: Log) -> None:
        if msg.name == "/move_base" and msg.level >= Log.WARN and TF_LINES.search(msg.msg):
            self.tf_lines.append(msg.msg)

    def _hear_recovery(self, msg: RecoveryStatus) -> None:
        self.recoveries += 1


def _at(track: List[Tuple[int, np.ndarray]], stamp_ns: int) -> np.ndarray:
    """(3,) between the poses before and after a time."""
    stamps = np.array([stamp for stamp, _ in track[-600:]])
    after = int(np.clip(np.searchsorted(stamps, stamp_ns), 1, len(stamps) - 1))
    (t0, a), (t1, b) = track[-600:][after - 1], track[-600:][after]
    share = np.clip((stamp_ns - t0) / (t1 - t0), 0.0, 1.0)
    step = b - a
    return a + share * np.array([step[0], step[1], angles.wrap(step[2])])


def goals_along(path_m: np.ndarray, count: int) -> np.ndarray:
    """(G, 3) evenly along a path, looking along it."""
    line = Polyline(path_m)
    ways = np.linspace(0.0, line.length, count + 1)[1:]
    return np.array([[*line.at(way), np.arctan2(*line.direction(way)[::-1])] for way in ways])


def cpu_s(node: str) -> float:
    """CPU time that a node has used; NaN if it is not there."""
    try:
        address = rosgraph.Master("/ride").lookupNode(node)
        pid = xmlrpc.client.ServerProxy(address).getPid("/ride")[2]
        fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    except (OSError, rosgraph.MasterException):
        return float("nan")
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def drive(ride: Ride, goals: np.ndarray, node: str) -> Dict[str, Any]:
    """To all goals, one after the other."""
    client = actionlib.SimpleActionClient("move_base", MoveBaseAction)
    while not (client.wait_for_server(rospy.Duration(0.5)) and ride.localized() and ride.pose is not None):
        if rospy.is_shutdown():
            raise SystemExit("shut down before move_base and the localization were ready")
    rospy.sleep(2.0)
    start, cpu0_s = rospy.Time.now(), cpu_s(node)
    ride.scores, ride.phantom_cells, ride.errors_m = [], [], []
    ride.tf_lines = []
    impatient = subprocess.Popen([sys.executable, impatient_client.__file__], stdout=subprocess.PIPE, text=True)
    ends = []
    for goal in goals:
        msg = MoveBaseGoal()
        msg.target_pose.header.frame_id, msg.target_pose.header.stamp = "map", rospy.Time.now()
        msg.target_pose.pose = conversions.pose_from_planar(goal)
        client.send_goal(msg)
        patience_s = GOAL_EXTRA_S + np.hypot(*(goal - ride.pose)[:2]) / SLOWEST_M_S
        in_time = client.wait_for_result(rospy.Duration(patience_s))
        said = in_time and client.get_state() == GoalStatus.SUCCEEDED
        if not in_time:
            client.cancel_goal()
        rospy.sleep(
            2.0
        )  # move_base's planner may be at this goal still, and would end the next one by its plan at once
        ends.append({"said": said, "off_m": round(float(np.hypot(*(goal - ride.pose)[:2])), 3)})
    impatient.send_signal(signal.SIGINT)
    asked, unanswered = (int(figure) for figure in impatient.communicate()[0].split()[-2:])
    driven_s = (rospy.Time.now() - start).to_sec()
    near, near_marked, far, far_marked = (sum(score[k] for score in ride.scores) for k in range(4))
    return {
        "goals": len(goals),
        "said": sum(end["said"] for end in ends),
        "reached": sum(end["off_m"] <= REACHED_M for end in ends),
        "said_wrongly": sum(end["said"] and end["off_m"] > REACHED_M for end in ends),
        "contacts": ride.contacts,
        "time_s": round(driven_s, 1),
        "error_mean_m": round(float(np.mean(ride.errors_m)), 4),
        "error_max_m": round(float(np.max(ride.errors_m)), 4),
        "recoveries": ride.recoveries,
        "tf_errors": len(ride.tf_lines),
        "unanswered": round(unanswered / max(asked, 1), 4),
        "glass_near": round(near_marked / near, 4) if near else None,
        "glass_far": round(far_marked / far, 4) if far else None,
        "phantoms": _share(not (score.outdated | score.drifted).all() for score in ride.scores),
        "outdated": _share(score.outdated.any() for score in ride.scores),
        "drifted": _share((score.drifted & ~score.outdated).any() for score in ride.scores),
        "cpu": round((cpu_s(node) - cpu0_s) / driven_s, 3),
        "ends": ends,
        "lines": sorted({re.sub(r"[\d.]+", "#", line) for line in ride.tf_lines}),
        "phantom_cells": ride.phantom_cells,
    }


def _share(holds: Iterable[bool]) -> float:
    return round(float(np.mean(list(holds))), 4)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("building")
    parser.add_argument("lidar")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--changed", type=float, default=0.0)
    parser.add_argument("--goals", type=int, default=8)
    parser.add_argument("--node", default="/glass_localization", help="whose CPU time counts")
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args(rospy.myargv()[1:])
    rospy.init_node("ride")
    building = building_file.load(shipped_buildings.find(arguments.building))
    simulation = Simulation(
        building, lidar.preset(arguments.lidar), seed=arguments.seed, changed_share=arguments.changed
    )
    goals = goals_along(next(iter(building.paths.values())), arguments.goals)
    row = drive(Ride(simulation), goals, arguments.node)
    arguments.out.write_text(json.dumps(row) + "\n")


if __name__ == "__main__":
    main()
