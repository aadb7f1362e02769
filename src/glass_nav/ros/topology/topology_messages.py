"""Conversions of the messages of the topology node to and from observations and estimates."""

from __future__ import annotations

import math
from typing import Optional, Sequence

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped

from glass_nav.msg import EdgeTraversal as EdgeTraversalMsg
from glass_nav.msg import Meetpoint as MeetpointMsg
from glass_nav.msg import TopologyCandidates, TopologyStatus
from glass_nav.msg import TurnChoice as TurnChoiceMsg
from glass_nav.ros import conversions
from glass_nav.topology.atlas.atlas import Atlas
from glass_nav.topology.observations import UNKNOWN, Meetpoint, ObservationError, Traversal
from glass_nav.topology.search import mismatches
from glass_nav.topology.search.belief import RuledOut
from glass_nav.topology.search.search_estimate import TurnChoice
from glass_nav.topology.search_decisions import SearchStatus, Turn

AS_CHOSEN = -1  # rank of a traversal: that of the last turn_choice


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


def traversal_from_msg(msg: EdgeTraversalMsg, choice: Optional[TurnChoice]) -> Traversal:
    """Checked; raises ObservationError.

    Args:
        msg: of the driver, or from a terminal.
        choice: the last turn_choice.
    """
    rank = msg.rank
    if rank == AS_CHOSEN:
        if choice is None:
            raise ObservationError("edge traversal: rank -1 means the last turn_choice, but there was none")
        rank = choice.rank
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


def turn_choice_msg(turn: Turn, frame: str) -> TurnChoiceMsg:
    """The answer to a meetpoint."""
    choice = turn.choice
    return TurnChoiceMsg(
        header=conversions.header(turn.stamp_ns, frame), rank=choice.rank, degree=choice.degree, name=choice.name
    )


def status_msg(status: SearchStatus, frame: str) -> TopologyStatus:
    """The status message; with an estimate also depth, candidates and turn; CONFIRMED also the relation of frames."""
    msg = TopologyStatus(
        header=conversions.header(status.stamp_ns, frame),
        state=status.state.code,
        state_name=status.state.value,
        reason=status.reason,
    )
    estimate = status.estimate
    if estimate is not None:
        msg.depth, msg.candidates = estimate.depth, estimate.candidates
        msg.turn = estimate.choice.name if estimate.choice else ""
    relation = status.relation
    if relation is not None:
        msg.has_relation = True
        msg.map_from_environment = conversions.pose_from_planar(relation.map_from_environment)
        if relation.node is not None and relation.node_from_environment is not None:
            msg.has_node, msg.node = True, relation.node
            msg.node_from_environment = conversions.pose_from_planar(relation.node_from_environment)
    return msg


def candidates_msg(
    status: SearchStatus, atlas: Optional[Atlas], frame: str, ruled_out: Sequence[RuledOut] = ()
) -> TopologyCandidates:
    """The candidates that the status has poses of; none where the atlas lacks the place that scans confirmed.

    Args:
        status: what is known.
        atlas: of the search.
        frame: of the map.
        ruled_out: by the last meetpoint.
    """
    msg = TopologyCandidates(header=conversions.header(status.stamp_ns, frame), elsewhere=math.nan)
    belief = status.belief
    if belief is not None:
        msg.shares, msg.elsewhere = belief.share.tolist(), belief.elsewhere
        msg.hypotheses = [conversions.pose_from_planar(pose) for pose in belief.poses]
    if atlas is not None and ruled_out:
        gone = np.array([each.dart for each in ruled_out])
        msg.ruled_out_nodes, msg.ruled_out_edges = atlas.darts.node[gone].tolist(), (gone >> 1).tolist()
        msg.ruled_out_poses = [conversions.pose_from_planar(each.map_from_base) for each in ruled_out]
        msg.ruled_out_by = [mismatches.words(each) for each in ruled_out]
    estimate = status.estimate
    if atlas is None or estimate is None:
        return msg
    dart = estimate.dart[: len(status.poses)]
    msg.total = len(estimate.dart)
    msg.nodes, msg.edges = atlas.darts.node[dart].tolist(), (dart >> 1).tolist()
    msg.detection_errors = bytes(estimate.errors[: len(dart)].astype(np.uint8))
    msg.poses = [conversions.pose_from_planar(pose) for pose in status.poses[: len(dart)]]
    return msg


def pose_msg(
    pose: np.ndarray, sigma_m: float, sigma_rad: float, stamp_ns: int, frame: str
) -> PoseWithCovarianceStamped:
    """An initial pose for the localization."""
    msg = PoseWithCovarianceStamped(header=conversions.header(stamp_ns, frame))
    msg.pose.pose = conversions.pose_from_planar(pose)
    covariance = np.zeros((6, 6))
    covariance[[0, 1, 5], [0, 1, 5]] = sigma_m**2, sigma_m**2, sigma_rad**2
    msg.pose.covariance = covariance.ravel().tolist()
    return msg
