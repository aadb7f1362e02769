"""Where the map comes from: the service static_map, called until it answers, or the topic map."""

from __future__ import annotations

import time
from typing import Callable, Optional

import rospy
from nav_msgs.msg import OccupancyGrid
from nav_msgs.srv import GetMap

from glass_nav.ros import conversions
from glass_nav.ros.localization.params import LocalizationNodeParams
from glass_nav.ros.log_throttle import LogThrottle
from glass_nav.world.grid_map import GridMap

SETTLING_S = 5.0  # map server and player in a launch file need some seconds: no warning before
REQUEST_PERIOD_S = 0.5
UseMap = Callable[[GridMap, str, str], None]  # map, frame_id of its message, where it came from in words


class MapSource:
    """Requests the first map, and passes on every valid map."""

    def __init__(self, p: LocalizationNodeParams, log: LogThrottle, use: UseMap) -> None:
        """
        Args:
            p: whether the map comes by topic, and whether newer ones count.
            log: limits the lines of repeated attempts.
            use: called with each map.
        """
        self._p, self._log, self._use = p, log, use
        self._taken = False
        self._started_s = time.monotonic()
        self._next_request_s = 0.0  # by the monotonic clock
        self.trouble: Optional[str] = None if p.use_map_topic else "no map yet"  # None: there is a map, or none is due

    @property
    def is_missing(self) -> bool:
        """Whether there is no map so far, and one is due."""
        return not self._taken

    def request(self) -> None:
        """Ask static_map for the first map if it is time; the loop comes back until there is one."""
        if self._p.use_map_topic or self._taken or time.monotonic() < self._next_request_s:
            return
        self._next_request_s = time.monotonic() + REQUEST_PERIOD_S
        name = rospy.resolve_name("static_map")
        try:
            rospy.wait_for_service(name, timeout=0.1)
        except rospy.ROSException:
            self.trouble = f"no map: there is no service {name}"
            if time.monotonic() - self._started_s > SETTLING_S and not rospy.is_shutdown():
                self._log.warn(self.trouble)
            return
        try:
            msg = rospy.ServiceProxy(name, GetMap)().map
            self.take(conversions.map_from_msg(msg), msg.header.frame_id, f"service {name}")
        except rospy.ServiceException as err:
            self.trouble = f"no map: service {name} fails: {err}"
            if time.monotonic() - self._started_s > SETTLING_S:
                self._log.warn(self.trouble)
        except ValueError as err:
            self.trouble = f"no map: the one of service {name} is refused: {err}"
            self._log.error(self.trouble)

    def take_topic(self, msg: OccupancyGrid) -> None:
        """A map from the topic; an invalid one is rejected, and the previous map stays."""
        if self._taken and self._p.first_map_only:
            return
        origin = f"topic {rospy.resolve_name('map')}"
        try:
            self.take(conversions.map_from_msg(msg), msg.header.frame_id, origin)
        except ValueError as err:
            rospy.logerr(f"the map of {origin} is refused: {err}")
            if not self._taken:
                self.trouble = f"no map: the one of {origin} is refused: {err}"

    def take(self, grid_map: GridMap, frame: str, origin: str) -> None:
        """Pass a map on; after that none is requested."""
        self._use(grid_map, frame, origin)
        self._taken, self.trouble = True, None
