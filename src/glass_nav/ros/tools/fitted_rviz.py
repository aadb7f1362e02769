"""fitted_rviz: starts rviz with the whole map in view.

Usage: fitted_rviz CONFIG.rviz, with the arguments of rviz after it. Waits for the topic map, sets scale and middle of the
view of the configuration, which must be TopDownOrtho, and becomes rviz.
Subscribes: map (OccupancyGrid, latched). Parameters: none.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path
from typing import Tuple

import numpy as np
import rospy
import yaml
from nav_msgs.msg import OccupancyGrid

from glass_nav.geometry import se2
from glass_nav.ros import command_line, conversions, shutdown
from glass_nav.world.grid_map import GridMap

DOCKS_PX = (360, 90)  # of the window, that the panels and the tool bar take
SHARE = 0.8  # of the rest that the map fills: there are texts around it
WAIT_S = 30.0


def view_of(grid_map: GridMap, window_px: Tuple[int, int]) -> Tuple[float, float, float]:
    """Pixels per metre, and x and y [m] of the middle of all that the map knows.

    Args:
        grid_map: the map.
        window_px: width and height.
    """
    rows, columns = np.nonzero(grid_map.occupancy >= 0)
    if not len(rows):
        rows, columns = (np.array([0, size - 1]) for size in grid_map.occupancy.shape)
    corners = [[x, y] for x in (columns.min(), columns.max() + 1) for y in (rows.min(), rows.max() + 1)]
    points = se2.transform_points(grid_map.map_from_grid, np.array(corners, float) * grid_map.resolution_m)
    low, high = points.min(axis=0), points.max(axis=0)
    free_px = np.maximum(np.subtract(window_px, DOCKS_PX), 100)
    scale = SHARE * float((free_px / (high - low)).min())
    return scale, float(0.5 * (low[0] + high[0])), float(0.5 * (low[1] + high[1]))


def fitted(config: str, grid_map: GridMap) -> str:
    """A configuration of rviz with its view on all of the map.

    Raises:
        ValueError: it has no such view.
    """
    content = yaml.safe_load(config)
    try:
        view = content["Visualization Manager"]["Views"]["Current"]
        window = content["Window Geometry"]
        if view["Class"] != "rviz/TopDownOrtho":
            raise ValueError(f"the view must be rviz/TopDownOrtho, got {view['Class']}")
        scale, x_m, y_m = view_of(grid_map, (int(window["Width"]), int(window["Height"])))
    except (KeyError, TypeError) as err:
        raise ValueError(f"is no configuration of rviz with a view and a window: {err}") from err
    view.update({"Scale": scale, "X": x_m, "Y": y_m, "Angle": 0, "Target Frame": "map"})
    return str(yaml.safe_dump(content, sort_keys=False))


def main() -> None:
    """Wait for the map, then become rviz; exit code 2 for a bad configuration."""
    if command_line.answers_help(__doc__):
        return
    arguments = rospy.myargv(sys.argv)[1:]
    rospy.init_node("fitted_rviz", anonymous=True)
    try:
        if not arguments:
            raise ValueError("fitted_rviz: expected CONFIG.rviz, got nothing")
        path = Path(arguments[0])
        try:
            msg = rospy.wait_for_message("map", OccupancyGrid, WAIT_S)
            text = fitted(path.read_text(encoding="utf-8"), conversions.map_from_msg(msg))
        except rospy.ROSException:
            rospy.logwarn(f"no map on {rospy.resolve_name('map')} for {WAIT_S:g} s: the view is that of {path}")
            text = path.read_text(encoding="utf-8")
        except ValueError as err:
            raise ValueError(f"{path}: {err}") from err
    except (ValueError, OSError) as err:
        shutdown.refuse_to_start(err)
    with tempfile.NamedTemporaryFile("w", suffix=".rviz", delete=False, encoding="utf-8") as file:
        file.write(text)
    remapped = [argument for argument in sys.argv[1:] if ":=" in argument]
    os.execvp("rviz", ["rviz", "-d", file.name, *arguments[1:], *remapped])
