"""Scans of one or several lidars, from their topics until their transforms are there.

Lidars are told apart by the frame_id of their scans, as AMCL does, whatever topic they come by. The newest scan of each
wins; stamps of one lidar only ascend.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Dict, List, Optional

import numpy as np
import rospy
import tf2_ros
from sensor_msgs.msg import LaserScan

from glass_nav.ros import conversions
from glass_nav.ros.conversions import Mounting
from glass_nav.ros.log_throttle import LogThrottle
from glass_nav.ros.mailbox import ScanCounts, WaitingScans
from glass_nav.ros.params import LocalizationNodeParams
from glass_nav.sensing.scan import Scan, ScanError

STALE_SCANS = 20       # that many older scans of one lidar in a row: its clock was set back
MOST_LIDARS = 16       # a driver that makes up a frame for every scan must not fill the memory
WAITING = 100          # scans of one lidar that may wait


@dataclass(frozen=True)
class PlacedScan:
    """A scan with all that the filter needs."""
    scan: Scan
    odom_from_base: np.ndarray  # (3,) at its stamp
    mounting: Mounting


class ScanInput:
    """Counts what comes in, lets it wait for tf, and says what cannot be used."""

    def __init__(self, p: LocalizationNodeParams, tf: tf2_ros.Buffer, log: LogThrottle) -> None:
        self._p, self._tf, self._log = p, tf, log
        self._topics = p.scan_topics or ("scan",)
        self._lidars: Dict[str, WaitingScans[LaserScan]] = {}
        self._stale: Dict[str, int] = {}  # older scans in a row
        self._subscribers: List[rospy.Subscriber] = []
        self.counts = ScanCounts()
        self.trouble = "no scan used yet"  # why the last scan that was not used was not
        self.last_arrival_s = rospy.get_time()

    def subscribe(self, put: Callable[[LaserScan], None]) -> None:
        """Listen; put is called by other threads."""
        self._subscribers = [  # Nagle's algorithm would hold small messages for 40 ms
            rospy.Subscriber(topic, LaserScan, put, queue_size=100, buff_size=2 ** 22, tcp_nodelay=True)
            for topic in self._topics]

    @property
    def lidars(self) -> List[str]:
        """Frames of the lidars heard so far."""
        return list(self._lidars)

    def reconfigure(self, p: LocalizationNodeParams) -> None:
        """Other parameters from now on."""
        self._p = p
        for waiting in self._lidars.values():
            waiting.limit_s = p.transform_wait_s

    def receive(self, msg: LaserScan, now_s: float, unusable: Optional[str]) -> bool:
        """Let a scan wait for its transforms, unless it cannot be used at all.

        Args:
            msg: as it came.
            now_s: ROS time.
            unusable: why no scan can be used now; None if one can.

        Returns:
            whether the lidar's clock was set back: restart() is due.
        """
        self.counts.received += 1
        self.last_arrival_s = now_s
        stamp_ns, lidar = conversions.ns_from_stamp(msg.header.stamp), conversions.frame_id(msg.header.frame_id)
        if unusable is not None:
            self.refuse(unusable)
        elif stamp_ns == 0:
            self.refuse("it has no stamp")
        elif not lidar:
            self.refuse("it has no frame_id")
        elif lidar not in self._lidars and len(self._lidars) >= MOST_LIDARS:
            self.refuse(f"its frame {lidar!r} would be that of the lidar number {MOST_LIDARS + 1}, the most are "
                        f"{MOST_LIDARS}")
        elif self._waiting(lidar).add(msg, stamp_ns, now_s):
            self._stale[lidar] = 0
        else:
            self.refuse(f"its stamp {stamp_ns * 1e-9:.3f} s is not after that of the last one used")
            self._stale[lidar] = self._stale.get(lidar, 0) + 1
            return self._stale[lidar] >= STALE_SCANS
        return False

    def take_ready(self, now_s: float) -> List[LaserScan]:
        """The newest scan of each lidar that has its transforms, by ascending stamps."""
        ready: List[LaserScan] = []
        for waiting in self._lidars.values():
            msg, given_up = waiting.take_ready(self._has_transforms, now_s)
            if given_up:
                self._say_no_transform(given_up[-1])
            if msg is not None:
                ready.append(msg)
        return sorted(ready, key=lambda msg: conversions.ns_from_stamp(msg.header.stamp))

    @property
    def is_waiting(self) -> bool:
        """Whether a scan waits for its transforms."""
        return self.counts.waiting > 0

    def place(self, msg: LaserScan) -> PlacedScan:
        """A scan that is ready with its transforms.

        Raises:
            ScanError: it cannot be used; one line.
        """
        (odom, base), (_, laser) = self._transform_pairs(msg)
        try:
            odom_from_base = conversions.planar_from_transform(
                self._tf.lookup_transform(odom, base, msg.header.stamp).transform)
            base_from_laser = self._tf.lookup_transform(base, laser, msg.header.stamp).transform
        except tf2_ros.TransformException as err:  # tf was cleared since it was asked
            raise ScanError(f"no transform: {err}") from err
        except ValueError as err:
            raise ScanError(f"transform {odom} <- {base}: {err}") from err
        mounting = conversions.mounting_from_transform(base_from_laser)
        return PlacedScan(conversions.scan_from_msg(msg, mounting), odom_from_base, mounting)

    def refuse(self, why: str) -> None:
        """Count and say a scan that is not used."""
        self.counts.refused += 1
        self.trouble = f"scan refused: {why}"
        self._log.warn(self.trouble)

    def silence(self, now_s: float) -> str:
        """The line on a lidar that is not heard."""
        topics = ", ".join(rospy.resolve_name(topic) for topic in self._topics)
        publishers = sum(subscriber.get_num_connections() for subscriber in self._subscribers)
        return (f"no scan on {topics} for {now_s - self.last_arrival_s:.0f} s: "
                + ("its publisher is silent" if publishers else "nobody publishes it"))

    def restart(self, now_s: float) -> None:
        """Forget what waits and which stamps were used: time has jumped."""
        for waiting in self._lidars.values():
            waiting.restart()
        self._lidars, self._stale, self.last_arrival_s = {}, {}, now_s

    def _waiting(self, lidar: str) -> "WaitingScans[LaserScan]":
        if lidar not in self._lidars:
            self._lidars[lidar] = WaitingScans(WAITING, self._p.transform_wait_s, self.counts)
        return self._lidars[lidar]

    def _transform_pairs(self, msg: LaserScan) -> "List[tuple[str, str]]":
        return [(self._p.odom_frame_id, self._p.base_frame_id),
                (self._p.base_frame_id, conversions.frame_id(msg.header.frame_id))]

    def _has_transforms(self, msg: LaserScan) -> bool:
        return all(self._tf.can_transform(target, source, msg.header.stamp)
                   for target, source in self._transform_pairs(msg))

    def _say_no_transform(self, msg: LaserScan) -> None:
        """The first pair that is missing, with tf's own reason."""
        wait = f"{self._p.transform_wait_s:g} s"
        for target, source in self._transform_pairs(msg):
            try:
                self._tf.lookup_transform(target, source, msg.header.stamp)
            except tf2_ros.TransformException as err:
                self.trouble = f"no transform {target} <- {source} at the scan's stamp: {err}"
                self._log.warn(f"scan dropped after {wait}: {self.trouble}")
                return
        self._log.warn(f"scan dropped: its transform came later than {wait}")
