"""What the driver reports and is told <-> messages."""

from __future__ import annotations

import math
import re
from typing import Optional

import numpy as np
from geometry_msgs.msg import PoseStamped, Twist

from glass_nav.driving.edge_driver import Arrival
from glass_nav.msg import DriverStatus
from glass_nav.msg import EdgeTraversal as EdgeTraversalMsg
from glass_nav.msg import Meetpoint as MeetpointMsg
from glass_nav.ros import conversions
from glass_nav.topology.observations import FORWARD, LEFT, RIGHT, U_TURN, ObservationError, refuse_rank

_RANK = re.compile(r"(?:RANK_)?(\d+)$")


def meetpoint_msg(arrival: Arrival, frame: str) -> MeetpointMsg:
    """Where the robot stands."""
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


def rank_from_words(edge: str, degree: int) -> int:
    """The rank of LEFT, RIGHT, U_TURN, FORWARD, RANK_2 or 2 at a meetpoint of that degree.

    Raises:
        ObservationError: none of these, or no such edge.
    """
    word = edge.strip().upper()
    numbered = _RANK.match(word)
    if numbered:
        rank = int(numbered.group(1))
    elif word == U_TURN:
        rank = 0
    elif word in (LEFT, RIGHT):
        if degree == 1:
            raise ObservationError(f"edge {word}: from a dead end only {U_TURN} leads away")
        rank = 1 if word == LEFT else degree - 1
    elif word == FORWARD:
        if degree != 2:
            raise ObservationError(
                f"edge {FORWARD}: the meetpoint has degree {degree}, {FORWARD} is the only way on of degree 2"
            )
        rank = 1
    else:
        raise ObservationError(
            f"edge must be {LEFT}, {RIGHT}, {U_TURN}, {FORWARD}, or a rank such as RANK_2 or 2, got {edge!r}"
        )
    refuse_rank(rank, degree)
    return rank


def status_msg(
    state: str, reason: str, task: str, travelled_m: float, remaining_m: float, stamp_ns: int, frame: str
) -> DriverStatus:
    """By the name of a state."""
    return DriverStatus(
        header=conversions.header(stamp_ns, frame),
        state=getattr(DriverStatus, state),
        state_name=state,
        reason=reason,
        task=task,
        travelled=travelled_m,
        remaining=remaining_m,
    )


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
