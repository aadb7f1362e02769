"""glass_nav doctor --live: listens to every lidar, tf and odometry for some seconds, and examines what it received.

`glass_nav doctor` starts it as a separate process. Publishes nothing.
Subscribes: every topic of LaserScan and Odometry, tf, tf_static; map (OccupancyGrid), unless a map file is given.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any, Callable, List, Optional, Sequence

import rosgraph
import rospy
from nav_msgs.msg import OccupancyGrid, Odometry
from nav_msgs.srv import GetMap
from sensor_msgs.msg import LaserScan
from tf2_msgs.msg import TFMessage

from glass_nav.checkup import doctor
from glass_nav.checkup.doctor import FrameNames
from glass_nav.recording.bag_observer import heard_scan, heard_transform
from glass_nav.recording.observed import HeardOdometry, Observed
from glass_nav.ros import conversions
from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap

NOTHING_FOUND, FINDINGS, BAD_INPUT = 0, 1, 3
KINDS = {"sensor_msgs/LaserScan": LaserScan, "nav_msgs/Odometry": Odometry, "tf2_msgs/TFMessage": TFMessage}
MAP_WAIT_S = 1.0


class Listener:
    """Collects messages until enough time has passed."""

    def __init__(self) -> None:
        self.seen = Observed("the running robot")
        self._subscribers: List[rospy.Subscriber] = []
        for topic, kind in sorted(rospy.get_published_topics()):
            self.seen.topics[topic] = kind
            if kind in KINDS:
                self._subscribers.append(
                    rospy.Subscriber(
                        topic,
                        KINDS[kind],
                        self._keeper(topic, kind),
                        queue_size=1000,
                        buff_size=2**22,
                        tcp_nodelay=True,
                    )
                )

    def _keeper(self, topic: str, kind: str) -> Callable[[Any], None]:
        if kind == "sensor_msgs/LaserScan":
            scans = self.seen.scans.setdefault(topic, [])
            return lambda msg: scans.append(heard_scan(msg, conversions.ns_from_stamp(msg.header.stamp), _now_ns()))
        if kind == "nav_msgs/Odometry":
            odometry = self.seen.odometry.setdefault(topic, [])
            return lambda msg: odometry.append(
                HeardOdometry(
                    conversions.ns_from_stamp(msg.header.stamp), _now_ns(), msg.header.frame_id, msg.child_frame_id
                )
            )
        return lambda msg: self.seen.transforms.extend(
            heard_transform(
                each,
                conversions.ns_from_stamp(each.header.stamp),
                _now_ns(),
                topic.endswith("tf_static"),
                str(msg._connection_header.get("callerid", "")),
            )
            for each in msg.transforms
        )

    def listen(self, seconds: float) -> None:
        """Seconds by the wall clock: simulated time may stand still."""
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s and not rospy.is_shutdown():
            time.sleep(min(0.1, max(end_s - time.monotonic(), 0.0)))
        for subscriber in self._subscribers:
            subscriber.unregister()


def _now_ns() -> int:
    return conversions.ns_from_stamp(rospy.Time.now())


def served_map() -> Optional[GridMap]:
    """The map of static_map or of the topic map; None: there is none."""
    try:
        rospy.wait_for_service("static_map", timeout=MAP_WAIT_S)
        return conversions.map_from_msg(rospy.ServiceProxy("static_map", GetMap)().map)
    except (rospy.ROSException, rospy.ServiceException):
        pass
    try:
        return conversions.map_from_msg(rospy.wait_for_message("map", OccupancyGrid, timeout=MAP_WAIT_S))
    except rospy.ROSException:
        return None


def main(argv: Optional[Sequence[str]] = None) -> int:
    """Listen, examine, print.

    Returns:
        0 no fault found, 1 faults found, 3 no roscore or no map that can be read.
    """
    parser = argparse.ArgumentParser(prog="glass_nav doctor --live")
    parser.add_argument("--seconds", type=float, required=True)
    parser.add_argument("--odom-frame", default="odom")
    parser.add_argument("--base-frame")
    parser.add_argument("--map", type=Path)
    given = parser.parse_args(argv)
    try:
        if not rosgraph.is_master_online():
            raise ValueError(f"no roscore at {rosgraph.get_master_uri()}: start the robot, or set ROS_MASTER_URI")
        grid_map = None if given.map is None else map_file.load(given.map)
        rospy.init_node("glass_doctor", anonymous=True, disable_rosout=True)
        listener = Listener()
        listener.listen(given.seconds)
        grid_map = served_map() if grid_map is None else grid_map
    except (ValueError, OSError) as err:
        sys.stderr.write(f"glass_nav doctor: {' '.join(str(err).split())}\n")
        return BAD_INPUT
    report = doctor.examine(listener.seen, grid_map, FrameNames(given.odom_frame.lstrip("/"), given.base_frame))
    if grid_map is None:
        report.seen.append("map: neither static_map nor the topic map gives one")
    sys.stdout.write(report.text + "\n")
    return FINDINGS if report.findings else NOTHING_FOUND


if __name__ == "__main__":
    sys.exit(main())
