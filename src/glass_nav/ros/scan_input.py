"""Scans of one or several lidars, from their topics until their transforms are there.

Lidars are told apart by the frame_id of their scans, as AMCL does, whatever topic they come by. The newest scan of each
wins; stamps of one lidar only ascend.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Dict, List, Optional, Set

import numpy as np
import rospy
import tf2_ros
from sensor_msgs.msg import LaserScan

from glass_nav.geometry.trajectory import Trajectory
from glass_nav.ros import conversions
from glass_nav.ros.conversions import Mounting
from glass_nav.ros.localization.params import LocalizationNodeParams
from glass_nav.ros.log_throttle import LogThrottle
from glass_nav.sensing import deskew
from glass_nav.sensing.deskew import Deskew
from glass_nav.sensing.scan import Scan, ScanError
from glass_nav.sensing.waiting_scans import ScanCounts, WaitingScans

STALE_SCANS = 20  # that many older scans of one lidar in a row: its clock was set back
MAX_LIDARS = 16  # a driver that makes up a frame for every scan must not fill the memory
LONGEST_PERIOD_S = 5.0  # scans farther apart are a pause
WAITING = 100  # scans of one lidar that may wait


@dataclass(frozen=True)
class PlacedScan:
    """A scan with all that the filter needs."""

    scan: Scan
    odom_from_base: np.ndarray  # (3,) at its stamp
    mounting: Mounting


class ScanInput:
    """Counts what comes in, lets it wait for tf, and says what cannot be used."""

    def __init__(self, p: LocalizationNodeParams, straighten: Deskew, tf: tf2_ros.Buffer, log: LogThrottle) -> None:
        self._p, self._straighten, self._tf, self._log = p, straighten, tf, log
        self._topics = p.scan_topics or ("scan",)
        self._lidars: Dict[str, WaitingScans[LaserScan]] = {}
        self._stale: Dict[str, int] = {}  # older scans in a row
        self._last_ns: Dict[str, int] = {}
        self._period_s: Dict[str, float] = {}  # from scan to scan, a running mean
        self._placed: Set[str] = set()  # lidars that had a scan with its transforms
        self._subscribers: List[rospy.Subscriber] = []
        self.counts = ScanCounts()
        self.trouble = "no scan used yet"  # why the last scan that was not used was not
        self.last_arrival_s = rospy.get_time()

    def subscribe(self, put: Callable[[LaserScan], None]) -> None:
        """Listen; put is called by other threads."""
        self._subscribers = [  # Nagle's algorithm would hold small messages for 40 ms
            rospy.Subscriber(topic, LaserScan, put, queue_size=100, buff_size=2**22, tcp_nodelay=True)
            for topic in self._topics
        ]

    @property
    def lidars(self) -> List[str]:
        """Frames of the lidars whose scans could be used so far."""
        return sorted(self._placed)

    def reconfigure(self, p: LocalizationNodeParams, straighten: Deskew) -> None:
        """Other parameters from now on."""
        self._p, self._straighten = p, straighten
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
        elif not self._has_room_for(lidar):
            self.refuse(
                f"its frame {lidar!r} would be that of the lidar number {MAX_LIDARS + 1}, the most are {MAX_LIDARS}"
            )
        elif self._waiting(lidar).add(msg, stamp_ns, now_s):
            self._stale[lidar] = 0
            self._learn_period(lidar, stamp_ns)
        else:
            self.refuse(f"its stamp {stamp_ns * 1e-9:.3f} s is not after that of the last one used")
            self._stale[lidar] = self._stale.get(lidar, 0) + 1
            return self._stale[lidar] >= STALE_SCANS
        return False

    def _has_room_for(self, lidar: str) -> bool:
        """Those that never had a scan with its transforms make room."""
        if lidar not in self._lidars and len(self._lidars) >= MAX_LIDARS:
            for name in set(self._lidars) - self._placed:
                self._lidars.pop(name).restart()
                for figures in (self._stale, self._last_ns, self._period_s):
                    figures.pop(name, None)
        return lidar in self._lidars or len(self._lidars) < MAX_LIDARS

    @property
    def period_s(self) -> Optional[float]:
        """From one scan to the next, of whatever lidar; None: not known yet."""
        rate_hz = sum(1.0 / period_s for lidar, period_s in self._period_s.items() if lidar in self._placed)
        return 1.0 / rate_hz if rate_hz > 0.0 else None

    def _learn_period(self, lidar: str, stamp_ns: int) -> None:
        apart_s = (stamp_ns - self._last_ns.get(lidar, stamp_ns)) * 1e-9
        self._last_ns[lidar] = stamp_ns
        if 0.0 < apart_s < LONGEST_PERIOD_S:
            self._period_s[lidar] = 0.9 * self._period_s.get(lidar, apart_s) + 0.1 * apart_s

    def take_ready(self, now_s: float) -> List[LaserScan]:
        """The newest scan of each lidar that has its transforms, by ascending stamps."""
        ready: List[LaserScan] = []
        for lidar, waiting in self._lidars.items():
            msg, given_up = waiting.take_ready(self._has_transforms, now_s)
            if given_up:
                self._say_no_transform(given_up[-1])
            if msg is not None:
                self._placed.add(lidar)
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
                self._tf.lookup_transform(odom, base, msg.header.stamp).transform
            )
            base_from_laser = self._tf.lookup_transform(base, laser, msg.header.stamp).transform
        except tf2_ros.TransformException as err:  # tf was cleared since it was asked
            raise ScanError(f"no transform: {err}") from err
        except ValueError as err:
            raise ScanError(f"transform {odom} <- {base}: {err}") from err
        mounting = conversions.mounting_from_transform(base_from_laser)
        scan = conversions.scan_from_msg(msg, mounting)
        if self._turn_ns(msg):
            scan = deskew.straightened(scan, self._odometry_over(scan.stamp_ns, self._turn_ns(msg)))
        return PlacedScan(scan, odom_from_base, mounting)

    def _odometry_over(self, stamp_ns: int, turn_ns: int) -> Trajectory:
        """Odometry from the first beam to the last one."""
        stamps_ns = deskew.knots_ns(stamp_ns, turn_ns)
        try:
            return Trajectory(
                stamps_ns,
                np.array(
                    [
                        conversions.planar_from_transform(
                            self._tf.lookup_transform(
                                self._p.odom_frame_id, self._p.base_frame_id, conversions.stamp_from_ns(knot_ns)
                            ).transform
                        )
                        for knot_ns in stamps_ns
                    ]
                ),
            )
        except (tf2_ros.TransformException, ValueError) as err:
            raise ScanError(f"no odometry while the lidar turned: {err}") from err

    def _turn_ns(self, msg: LaserScan) -> int:
        """How long the lidar turned, if that is to be made up for; else 0."""
        if not self._straighten.deskew:
            return 0
        beams = len(msg.ranges)
        fault = deskew.fault(beams, msg.time_increment, msg.scan_time)
        if fault is not None:
            self._log.warn(f"scans are taken as of one moment: {fault}", period_s=60.0)
            return 0
        return deskew.turn_ns(beams, msg.time_increment)

    def refuse(self, why: str) -> None:
        """Count and say a scan that is not used."""
        self.counts.refused += 1
        self.trouble = f"scan refused: {why}"
        self._log.warn(self.trouble)

    def silence(self, now_s: float) -> str:
        """The line on a lidar that is not heard."""
        topics = ", ".join(rospy.resolve_name(topic) for topic in self._topics)
        publishers = sum(subscriber.get_num_connections() for subscriber in self._subscribers)
        return f"no scan on {topics} for {now_s - self.last_arrival_s:.0f} s: " + (
            "its publisher is silent" if publishers else "nobody publishes it"
        )

    def restart(self, now_s: float) -> None:
        """Forget what waits and which stamps were used: time has jumped."""
        for waiting in self._lidars.values():
            waiting.restart()
        self._lidars, self._stale, self._last_ns, self._period_s, self._placed = {}, {}, {}, {}, set()
        self.last_arrival_s = now_s

    def _waiting(self, lidar: str) -> "WaitingScans[LaserScan]":
        if lidar not in self._lidars:
            self._lidars[lidar] = WaitingScans(WAITING, self._p.transform_wait_s, self.counts)
        return self._lidars[lidar]

    def _transform_pairs(self, msg: LaserScan) -> "List[tuple[str, str]]":
        return [
            (self._p.odom_frame_id, self._p.base_frame_id),
            (self._p.base_frame_id, conversions.frame_id(msg.header.frame_id)),
        ]

    def _has_transforms(self, msg: LaserScan) -> bool:
        pairs = self._transform_pairs(msg)
        if not all(self._tf.can_transform(target, source, msg.header.stamp) for target, source in pairs):
            return False
        turn_ns = self._turn_ns(msg)
        end = conversions.stamp_from_ns(conversions.ns_from_stamp(msg.header.stamp) + turn_ns)
        return turn_ns == 0 or bool(self._tf.can_transform(*pairs[0], end))

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
