"""Conversions of the reports and tasks of the driver to and from messages."""

from __future__ import annotations

import math
from typing import Optional

import numpy as np
from geometry_msgs.msg import PoseStamped, Twist

from glass_nav.driving.decisions import DriveStatus, GoalEnd, VisitReport
from glass_nav.driving.edge_tracking.edge_driver import Arrival
from glass_nav.driving.place_goals import PlaceGoal
from glass_nav.msg import DriverStatus, GotoNodeGoal, GotoNodeResult, NodeVisits, TopologyStatus, TraverseEdgeResult
from glass_nav.msg import EdgeTraversal as EdgeTraversalMsg
from glass_nav.msg import Meetpoint as MeetpointMsg
from glass_nav.ros import conversions
from glass_nav.vocabulary import SearchState

_SEARCH_STATES = {getattr(TopologyStatus, state.name): state for state in SearchState}


def meetpoint_msg(arrival: Arrival, frame: str) -> MeetpointMsg:
    """The message about the meetpoint where the robot stands."""
    seen = arrival.meetpoint
    odom_x, odom_y, odom_yaw = arrival.odom_from_base.tolist()
    return MeetpointMsg(
        header=conversions.header(arrival.stamp_ns, frame),
        degree=seen.degree,
        r=seen.r_m,
        r_sigma=seen.sigma_r_m,
        x=float(seen.centre_m[0]),
        y=float(seen.centre_m[1]),
        bearings=seen.bearings_rad.tolist(),
        has_odom=True,
        odom_x=odom_x,
        odom_y=odom_y,
        odom_yaw=odom_yaw,
    )


def traversal_msg(arrival: Arrival, frame: str) -> Optional[EdgeTraversalMsg]:
    """How it came there, with the same stamp; None: along no edge that began at a meetpoint."""
    driven = arrival.traversal
    if driven is None:
        return None
    known = math.isfinite(driven.chord_bearing_rad) and math.isfinite(driven.turn_rad)
    return EdgeTraversalMsg(
        header=conversions.header(arrival.stamp_ns, frame),
        rank=driven.rank,
        length=driven.length_m,
        length_sigma=driven.sigma_length_m,
        chord=driven.chord_m,
        chord_sigma=driven.sigma_chord_m,
        has_directions=known,
        chord_bearing=driven.chord_bearing_rad if known else 0.0,
        turn=driven.turn_rad if known else 0.0,
        segments=driven.segments_m.ravel().tolist(),
    )


def visits_msg(report: VisitReport, frame: str) -> NodeVisits:
    """Nodes passed on the way to a goal."""
    return NodeVisits(
        header=conversions.header(report.stamp_ns, frame),
        node=[visit.node for visit in report.visits],
        r=[visit.r_m for visit in report.visits],
    )


def status_msg(status: DriveStatus, frame: str) -> DriverStatus:
    """The status message, with the constant of the phase."""
    return DriverStatus(
        header=conversions.header(status.stamp_ns, frame),
        state=getattr(DriverStatus, status.phase.name),
        state_name=status.phase.name,
        reason=status.reason,
        task=status.task,
        travelled=status.travelled_m,
        remaining=status.remaining_m,
    )


def edge_result(end: GoalEnd, frame: str) -> TraverseEdgeResult:
    """How a goal of traverse_edge ended."""
    result = TraverseEdgeResult(
        code=getattr(TraverseEdgeResult, end.ending.outcome.name),
        reason=end.ending.reason,
        travelled=end.travelled_m,
    )
    if end.arrival is not None:
        result.meetpoint = meetpoint_msg(end.arrival, frame)
        traversal = traversal_msg(end.arrival, frame)
        if traversal is not None:
            result.has_traversal, result.traversal = True, traversal
    return result


def place_result(end: GoalEnd, map_frame: str) -> GotoNodeResult:
    """How a goal of goto_node ended."""
    return GotoNodeResult(
        code=getattr(GotoNodeResult, end.ending.outcome.name),
        reason=end.ending.reason,
        pose=pose_stamped(end.map_from_base, end.stamp_ns, map_frame),
        travelled=end.travelled_m,
    )


def place_goal(msg: GotoNodeGoal) -> PlaceGoal:
    """A goal of goto_node; a pose that is none goes with its fault."""
    frame = conversions.frame_id(msg.pose.header.frame_id)
    try:
        pose = conversions.planar_from_pose(msg.pose.pose)
    except ValueError as err:
        return PlaceGoal(msg.node, None, frame, msg.with_heading, str(err))
    return PlaceGoal(msg.node, pose, frame, msg.with_heading)


def search_state(msg: TopologyStatus) -> SearchState:
    """Raises ValueError if there is no such state."""
    if msg.state not in _SEARCH_STATES:
        raise ValueError(f"topology_status: state must be 0 to {len(SearchState) - 1}, got {msg.state}")
    return _SEARCH_STATES[msg.state]


def twist_msg(velocity: np.ndarray) -> Twist:
    """(3,) forward, left [m/s], turn [rad/s]."""
    msg = Twist()
    msg.linear.x, msg.linear.y, msg.angular.z = (float(value) for value in velocity)
    return msg


def pose_stamped(map_from_base: Optional[np.ndarray], stamp_ns: int, frame: str) -> PoseStamped:
    """Without a pose an empty one."""
    if map_from_base is None:
        return PoseStamped()
    return PoseStamped(conversions.header(stamp_ns, frame), conversions.pose_from_planar(map_from_base))
