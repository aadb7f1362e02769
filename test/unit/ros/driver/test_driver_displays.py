"""What rviz is given of a driver in a corridor with a side corridor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from made_buildings import SIDE_CORRIDOR_WALLS
from visualization_msgs.msg import Marker

from glass_nav.driving.base_limits import BaseLimits
from glass_nav.driving.edge_tracking.edge_driver import EdgeDriver
from glass_nav.driving.recovery import RecoveryParams
from glass_nav.driving.tasks import EdgeTask, Moment
from glass_nav.geometry import se2
from glass_nav.ros.driver import driver_displays
from glass_nav.simulation.building import Building
from glass_nav.simulation.lidar import PRESETS
from glass_nav.simulation.simulation import Simulation


def shown(driver, route_m=None, odom_from_base=np.zeros(3)):
    array = driver_displays.driver_markers(driver, route_m, odom_from_base, "IDLE\nnothing", "odom", "map")
    return {marker.ns: marker for marker in array.markers}


def test_each_thing_has_one_marker_and_only_what_there_is_is_shown():
    markers = shown(EdgeDriver())
    assert sorted(markers) == sorted(driver_displays.NAMESPACES)
    assert {name for name, marker in markers.items() if marker.action == Marker.ADD} == {"state"}


def test_graph_and_meetpoint_are_shown_where_they_are_and_the_route_in_the_map():
    simulation = Simulation(
        Building(SIDE_CORRIDOR_WALLS, start=np.array([4.5, 1.0, 0.0])), replace(PRESETS["sensitive"], beams=361)
    )
    driver, last = EdgeDriver(), np.zeros(3)
    task = EdgeTask(driver, RecoveryParams(), BaseLimits())
    for step in range(2000):
        if step % 2 == 0:
            frame = simulation.look()
            driver.see(frame.scan, frame.odom_from_base)
        last = task.step(Moment(simulation.reading.odom_from_base, None, last, 0.05))
        if task.ending is not None:
            break
        simulation.move(0.05, last)
    here = simulation.reading.odom_from_base
    markers = shown(driver, np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]]), here)
    assert len(markers["meetpoint"].packed) == 2 * 3  # an arm for each edge
    middle = markers["meetpoint"].packed[0, :2]
    map_from_odom = se2.compose(simulation.map_from_base, se2.inverse(here))
    assert np.hypot(*(se2.transform_points(map_from_odom, middle) - [5.0, 1.24])) < 0.1  # r 0.625 w in a T
    assert np.hypot(*(markers["local_nodes"].packed[:, :2] - middle).T).min() < 0.3
    assert len(markers["local_edges"].packed) > 20
    assert markers["route"].header.frame_id == "map" and len(markers["route"].packed) == 4
    assert markers["local_edges"].header.frame_id == "odom"
    assert "IDLE" in markers["state"].text
