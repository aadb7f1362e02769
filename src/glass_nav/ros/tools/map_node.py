"""map_node: serves one map file, as map_server does, and reads MRPT grid maps too.

Publishes: map (OccupancyGrid, latched), map_metadata (MapMetaData, latched).
Services: static_map (GetMap), change_map (LoadMap, where nav_msgs has it).
Parameters: ~frame_id (default map), ~map_file (or the first argument): map_server .yaml, MRPT .gridmap[.gz].
"""

from __future__ import annotations

import sys
from typing import Any, List

import rospy

from glass_nav.ros import command_line, conversions
from glass_nav.ros.tools.served_map import ServedMap
from glass_nav.world import map_file


class MapNode:
    """Serves one map."""

    def __init__(self, path: str, frame: str) -> None:
        self._frame = conversions.frame_id(frame)
        self._map = ServedMap()
        self._serve(path)
        try:
            from nav_msgs.srv import LoadMap
        except ImportError:  # nav_msgs before 1.14
            return
        rospy.Service("change_map", LoadMap, self._change)

    def _serve(self, path: str) -> None:
        grid_map = map_file.load(path)
        self._msg = conversions.msg_from_map(grid_map, rospy.Time.now(), self._frame)
        self._map.give(self._msg)
        info = self._msg.info
        rospy.loginfo(f"{path}: {info.width} x {info.height} cells of {info.resolution:g} m, frame {self._frame!r}")

    def _change(self, request: Any) -> Any:
        from nav_msgs.srv import LoadMapResponse

        try:
            self._serve(request.map_url)
        except ValueError as err:
            rospy.logerr(f"change_map refused: {err}")
            return LoadMapResponse(result=LoadMapResponse.RESULT_INVALID_MAP_DATA)
        return LoadMapResponse(map=self._msg, result=LoadMapResponse.RESULT_SUCCESS)


def main() -> None:
    """Start the node; exit code 2 without a file name, 3 if the file is not a map."""
    if command_line.answers_help(__doc__):
        return
    rospy.init_node("map_node")
    arguments: List[str] = rospy.myargv()[1:]
    path = rospy.get_param("~map_file", arguments[0] if len(arguments) == 1 else "")
    if not path:
        rospy.logfatal(f"{rospy.get_name()}: give one map file, as ~map_file or as argument; got {arguments}")
        sys.exit(2)
    try:
        MapNode(str(path), str(rospy.get_param("~frame_id", "map")))
    except (ValueError, OSError) as err:
        rospy.logfatal(f"{rospy.get_name()}: {err}")
        sys.exit(3)
    rospy.spin()
