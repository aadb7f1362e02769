from __future__ import annotations

import math

import numpy as np
import pytest

from glass_nav.driving.decisions import Action, DriveStatus, GoalEnd
from glass_nav.driving.edge_tracking.edge_driver import Arrival
from glass_nav.driving.tasks import Ending
from glass_nav.msg import DriverStatus, GotoNodeGoal, TopologyStatus
from glass_nav.msg import Meetpoint as MeetpointMsg
from glass_nav.ros.driver import driver_messages
from glass_nav.ros.topology import topology_messages
from glass_nav.topology.observations import Meetpoint, Traversal
from glass_nav.vocabulary import DriverPhase, Outcome, SearchState

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


def test_a_status_has_the_constant_of_its_phase():
    status = DriveStatus(DriverPhase.RECOVERING, "waits", "goto_node 3", 1.5, math.nan, 5)
    msg = driver_messages.status_msg(status, "base_link")
    assert (msg.state, msg.state_name, msg.task, msg.travelled) == (
        DriverStatus.RECOVERING,
        "RECOVERING",
        "goto_node 3",
        1.5,
    )


@pytest.mark.parametrize("phase", list(DriverPhase))
def test_the_message_has_a_constant_for_every_phase(phase):
    assert driver_messages.status_msg(DriveStatus(phase, ""), "base_link").state == phase.code


@pytest.mark.parametrize("outcome", list(Outcome))
def test_both_actions_have_a_code_for_every_outcome(outcome):
    end = GoalEnd(Action.GOTO_NODE, Ending(outcome, "why"), 2.0, arrival(), np.array([1.0, 2.0, 0.0]), 5)
    place, edge = driver_messages.place_result(end, "map"), driver_messages.edge_result(end, "base_link")
    assert place.code == edge.code == outcome.code
    assert place.reason == edge.reason == "why" and place.travelled == edge.travelled == 2.0
    assert place.pose.pose.position.y == 2.0 and place.pose.header.frame_id == "map"
    assert edge.has_traversal and edge.traversal.rank == 2 and edge.meetpoint.degree == 3


def test_a_result_says_where_no_edge_led_there():
    sought = GoalEnd(Action.TRAVERSE_EDGE, Ending(Outcome.SUCCEEDED, ""), arrival=arrival(None))
    result = driver_messages.edge_result(sought, "base_link")
    assert result.meetpoint.degree == 3 and not result.has_traversal


def test_a_goal_without_a_pose_goes_with_its_fault():
    goal = driver_messages.place_goal(GotoNodeGoal(node=4))
    assert goal.node == 4 and goal.pose is None and "quaternion" in goal.pose_fault
    msg = GotoNodeGoal(node=-1, pose=driver_messages.pose_stamped(np.array([1.0, 2.0, 0.5]), 5, "map"))
    goal = driver_messages.place_goal(msg)
    np.testing.assert_allclose(goal.pose, [1.0, 2.0, 0.5])
    assert goal.frame == "map" and not goal.with_heading


@pytest.mark.parametrize("state", list(SearchState))
def test_a_search_state_is_that_of_the_constant(state):
    assert driver_messages.search_state(TopologyStatus(state=getattr(TopologyStatus, state.name))) == state


def test_a_search_state_that_there_is_not_is_rejected():
    with pytest.raises(ValueError, match="^topology_status: state must be 0 to 7, got 9$"):
        driver_messages.search_state(TopologyStatus(state=9))


def test_a_pose_that_is_not_known_is_an_empty_one():
    assert driver_messages.pose_stamped(None, 5, "map").header.frame_id == ""
    assert driver_messages.pose_stamped(np.array([1.0, 2.0, 0.0]), 5, "map").pose.position.y == 2.0
