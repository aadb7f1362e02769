from __future__ import annotations

import math

import numpy as np
import pytest

from glass_nav.driving.edge_driver import Arrival
from glass_nav.msg import DriverStatus
from glass_nav.msg import Meetpoint as MeetpointMsg
from glass_nav.ros.driver import driver_messages
from glass_nav.ros.topology import topology_messages
from glass_nav.topology.observations import Meetpoint, ObservationError, Traversal

MEETPOINT = Meetpoint(3, 1.5, 0.04, np.array([3.0, 1.5, -1.5]), np.array([0.05, -0.02]), 7_000_000_001)
TRAVERSAL = Traversal(2, 4.2, 4.0, 0.1, 0.2, 0.3, -0.4, np.array([[0.0, 1.0, 2.0, 1.0]]))


def arrival(traversal=TRAVERSAL):
    return Arrival(7_000_000_001, np.array([1.0, -2.0, 0.5]), MEETPOINT, traversal)


def test_the_topology_node_reads_what_the_driver_reports():
    found = topology_messages.meetpoint_from_msg(driver_messages.meetpoint_msg(arrival(), "base_link"))
    assert (found.degree, found.r_m, found.sigma_r_m, found.stamp_ns) == (3, 1.5, 0.04, 7_000_000_001)
    np.testing.assert_array_equal(found.bearings_rad, MEETPOINT.bearings_rad)
    np.testing.assert_array_equal(found.centre_m, MEETPOINT.centre_m)
    np.testing.assert_array_equal(found.odom_from_base, [1.0, -2.0, 0.5])
    msg = driver_messages.traversal_msg(arrival(), "base_link")
    driven = topology_messages.traversal_from_msg(msg, None)
    assert (driven.rank, driven.length_m, driven.chord_m, driven.sigma_length_m, driven.sigma_chord_m) == (
        2,
        4.2,
        4.0,
        0.1,
        0.2,
    )
    assert (driven.chord_bearing_rad, driven.turn_rad) == (0.3, -0.4)
    np.testing.assert_array_equal(driven.segments_m, TRAVERSAL.segments_m)
    assert driver_messages.meetpoint_msg(arrival(), "base_link").header.stamp == msg.header.stamp


def test_a_meetpoint_that_is_told_by_hand_needs_no_odometry():
    assert topology_messages.meetpoint_from_msg(MeetpointMsg(degree=3, r=1.5)).odom_from_base is None


def test_directions_that_were_not_measured_are_not_told():
    msg = driver_messages.traversal_msg(arrival(Traversal(1, 2.0, 2.0)), "base_link")
    assert not msg.has_directions
    assert math.isnan(topology_messages.traversal_from_msg(msg, None).turn_rad)
    assert driver_messages.traversal_msg(arrival(None), "base_link") is None


@pytest.mark.parametrize(
    "words, degree, rank",
    [
        ("LEFT", 3, 1),
        ("RIGHT", 3, 2),
        ("RIGHT", 5, 4),
        ("U_TURN", 3, 0),
        ("U_TURN", 1, 0),
        ("FORWARD", 2, 1),
        ("LEFT", 2, 1),
        ("RIGHT", 2, 1),
        ("RANK_2", 4, 2),
        ("3", 4, 3),
        (" left ", 3, 1),
        ("0", 1, 0),
    ],
)
def test_an_edge_is_called_by_its_name_or_rank(words, degree, rank):
    assert driver_messages.rank_from_words(words, degree) == rank


@pytest.mark.parametrize(
    "words, degree, text",
    [
        ("AHEAD", 3, "edge must be LEFT, RIGHT, U_TURN, FORWARD, or a rank such as RANK_2 or 2, got 'AHEAD'"),
        ("FORWARD", 3, "edge FORWARD: the meetpoint has degree 3, FORWARD is the only way on of degree 2"),
        ("LEFT", 1, "edge LEFT: from a dead end only U_TURN leads away"),
        ("-1", 3, "edge must be LEFT, RIGHT, U_TURN, FORWARD, or a rank such as RANK_2 or 2, got '-1'"),
        ("RANK_3", 3, "turn of rank 3: the meetpoint it left has degree 3, allowed 0 to 2"),
    ],
)
def test_what_names_no_edge_is_refused(words, degree, text):
    with pytest.raises(ObservationError, match=f"^{text}$"):
        driver_messages.rank_from_words(words, degree)


def test_a_state_is_told_by_its_name():
    msg = driver_messages.status_msg("RECOVERING", "waits", "goto_node 3", 1.5, math.nan, 5, "base_link")
    assert (msg.state, msg.state_name, msg.task, msg.travelled) == (
        DriverStatus.RECOVERING,
        "RECOVERING",
        "goto_node 3",
        1.5,
    )


def test_a_pose_that_is_not_known_is_an_empty_one():
    assert driver_messages.pose_stamped(None, 5, "map").header.frame_id == ""
    assert driver_messages.pose_stamped(np.array([1.0, 2.0, 0.0]), 5, "map").pose.position.y == 2.0
