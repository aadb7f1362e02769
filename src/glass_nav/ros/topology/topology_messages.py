"""Messages of the topology node <-> observations and estimates."""

from __future__ import annotations

import math
from typing import Optional

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped

from glass_nav.msg import EdgeTraversal as EdgeTraversalMsg
from glass_nav.msg import Meetpoint as MeetpointMsg
from glass_nav.msg import TopologyCandidates, TopologyStatus
from glass_nav.msg import TurnChoice as TurnChoiceMsg
from glass_nav.ros import conversions
from glass_nav.topology.atlas.atlas import Atlas
from glass_nav.topology.observations import UNKNOWN, Meetpoint, ObservationError, Traversal
from glass_nav.topology.search.atlas_localizer import SearchEstimate, TurnChoice

AS_TOLD = -1  # rank of a traversal: as the last turn_choice said


def meetpoint_from_msg(msg: MeetpointMsg) -> Meetpoint:
    """Checked; raises ObservationError."""
    odom_from_base = np.array([msg.odom_x, msg.odom_y, msg.odom_yaw]) if msg.has_odom else None
    return Meetpoint(
        msg.degree,
        msg.r,
        msg.r_sigma,
        np.array(msg.bearings, float),
        np.array([msg.x, msg.y]),
        conversions.ns_from_stamp(msg.header.stamp),
        odom_from_base=odom_from_base,
    )


def traversal_from_msg(msg: EdgeTraversalMsg, told: Optional[TurnChoice]) -> Traversal:
    """Checked; raises ObservationError.

    Args:
        msg: of the driver, or from a terminal.
        told: the last turn_choice.
    """
    rank = msg.rank
    if rank == AS_TOLD:
        if told is None:
            raise ObservationError("edge traversal: rank -1 means the last turn_choice, but there was none")
        rank = told.rank
    if len(msg.segments) % 4:
        raise ObservationError(f"edge traversal: segments need 4 numbers each, got {len(msg.segments)} numbers")
    bearing, turn = (msg.chord_bearing, msg.turn) if msg.has_directions else (UNKNOWN, UNKNOWN)
    return Traversal(
        rank,
        msg.length,
        msg.chord,
        msg.length_sigma,
        msg.chord_sigma,
        bearing,
        turn,
        np.array(msg.segments, float).reshape(-1, 4),
    )


def turn_choice_msg(choice: TurnChoice, stamp_ns: int, frame: str) -> TurnChoiceMsg:
    """The answer to a meetpoint of that stamp."""
    return TurnChoiceMsg(
        header=conversions.header(stamp_ns, frame), rank=choice.rank, degree=choice.degree, name=choice.name
    )


def status_msg(
    state: str, reason: str, stamp_ns: int, frame: str, estimate: Optional[SearchEstimate]
) -> TopologyStatus:
    """By the name of a state; with an estimate also depth, candidates and turn."""
    msg = TopologyStatus(
        header=conversions.header(stamp_ns, frame),
        state=getattr(TopologyStatus, state),
        state_name=state,
        reason=reason,
    )
    if estimate is not None:
        msg.depth, msg.candidates = estimate.depth, len(estimate.dart)
        msg.turn = estimate.choice.name if estimate.choice else ""
    return msg


def candidates_msg(
    atlas: Atlas, estimate: SearchEstimate, poses: np.ndarray, stamp_ns: int, frame: str
) -> TopologyCandidates:
    """The first candidates, as many as there are poses (K, 3) for; none where the atlas does not have the place that
    scans confirmed.
    """
    dart = estimate.dart[: len(poses)]
    return TopologyCandidates(
        header=conversions.header(stamp_ns, frame),
        total=len(estimate.dart),
        nodes=atlas.darts.node[dart].tolist(),
        edges=(dart >> 1).tolist(),
        detection_errors=bytes(estimate.errors[: len(poses)].astype(np.uint8)),
        poses=[conversions.pose_from_planar(pose) for pose in poses[: len(dart)]],
    )


def pose_msg(
    pose: np.ndarray, sigma_m: float, sigma_rad: float, stamp_ns: int, frame: str
) -> PoseWithCovarianceStamped:
    """A start for the localization."""
    msg = PoseWithCovarianceStamped(header=conversions.header(stamp_ns, frame))
    msg.pose.pose = conversions.pose_from_planar(pose)
    covariance = np.zeros((6, 6))
    covariance[[0, 1, 5], [0, 1, 5]] = sigma_m**2, sigma_m**2, sigma_rad**2
    msg.pose.covariance = covariance.ravel().tolist()
    return msg


def stamps_differ_s(one: MeetpointMsg, other: EdgeTraversalMsg) -> float:
    """Seconds between a meetpoint and the traversal that shall end there; 0 if either has no stamp."""
    stamps = conversions.ns_from_stamp(one.header.stamp), conversions.ns_from_stamp(other.header.stamp)
    return 0.0 if 0 in stamps else math.fabs(stamps[0] - stamps[1]) * 1e-9
