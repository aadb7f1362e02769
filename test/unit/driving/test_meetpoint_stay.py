"""How long the robot stands at a meetpoint, and how often that is reported."""

from __future__ import annotations

import numpy as np

from glass_nav.driving.edge_tracking.edge_driver import Arrival
from glass_nav.driving.meetpoint_stay import MeetpointStay
from glass_nav.topology.observations import Meetpoint

ARRIVAL = Arrival(5, np.array([1.0, 2.0, 0.3]), Meetpoint(3, 1.5), None)


def test_it_was_left_where_the_robot_is_far_from_where_it_arrived():
    stay = MeetpointStay()
    assert not stay.was_left(np.array([9.0, 9.0, 0.0]))  # it stands nowhere
    stay.begin(ARRIVAL, np.array([1.0, 2.0, 0.3]))
    assert stay.arrival is ARRIVAL
    assert not stay.was_left(None) and not stay.was_left(np.array([1.2, 2.2, 3.0]))
    assert stay.was_left(np.array([1.0, 2.4, 0.3]))
    stay.end()
    assert stay.arrival is None and not stay.was_left(np.array([1.0, 2.4, 0.3]))


def test_without_odometry_the_last_place_of_arrival_holds():
    stay = MeetpointStay()
    stay.begin(ARRIVAL, None)
    assert stay.was_left(np.array([1.0, 2.0, 0.3]))


def test_it_is_reported_again_after_a_while():
    stay = MeetpointStay()
    assert stay.is_report_due(0.0)
    stay.reported(10.0)
    assert not stay.is_report_due(12.0) and stay.is_report_due(12.1)
    stay.reset()
    assert stay.is_report_due(0.0) and stay.arrival is None
