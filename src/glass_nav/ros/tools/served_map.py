"""A map as map_server serves it: the latched topics map and map_metadata, and the service static_map."""

from __future__ import annotations

from typing import Optional

import rospy
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap, GetMapResponse


class ServedMap:
    """Serves one map."""

    def __init__(self) -> None:
        self._maps = rospy.Publisher("map", OccupancyGrid, queue_size=1, latch=True)
        self._metadata = rospy.Publisher("map_metadata", MapMetaData, queue_size=1, latch=True)
        self._service: Optional[rospy.Service] = None
        self._msg: OccupancyGrid  # once there is one

    def give(self, msg: OccupancyGrid) -> None:
        """Serve this map from now on."""
        self._msg = msg
        self._maps.publish(msg)
        self._metadata.publish(msg.info)
        if self._service is None:
            self._service = rospy.Service("static_map", GetMap, lambda _: GetMapResponse(self._msg))
