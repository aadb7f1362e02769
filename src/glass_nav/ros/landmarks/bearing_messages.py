"""Conversions of LandmarkBearings to and from the types of the core."""

from __future__ import annotations

from typing import List, Sequence

from glass_nav.msg import LandmarkBearings as LandmarkBearingsMsg
from glass_nav.ros import conversions
from glass_nav.sensing.bearings import LandmarkBearing
from glass_nav.sensing.mounting import Mounting

LONGEST_TURN_S = 300.0  # of a sensor's sweep: nodes that receive bearings keep odometry for this long


def bearings_from_msg(msg: LandmarkBearingsMsg, mounting: Mounting) -> List[LandmarkBearing]:
    """The bearings by ascending stamp, angles as seen from above. ValueError if the message makes no sense.

    Args:
        msg: as the driver sent it.
        mounting: of the sensor that took it, upright or upside down.
    """
    lengths = [len(part) for part in (msg.ids, msg.stamps, msg.angles, msg.sigmas)]
    if len(set(lengths)) > 1:
        raise ValueError(
            f"ids, stamps, angles and sigmas must be as many, got {', '.join(map(str, lengths[:-1]))} and {lengths[-1]}"
        )
    if len(set(msg.ids)) < len(msg.ids):
        raise ValueError(f"each landmark may come once, got {', '.join(sorted(msg.ids))}")
    end_ns = conversions.ns_from_stamp(msg.header.stamp)
    turn = -1.0 if mounting.upside_down else 1.0
    taken = [
        LandmarkBearing(conversions.ns_from_stamp(stamp), name, turn * angle, sigma)
        for name, stamp, angle, sigma in zip(msg.ids, msg.stamps, msg.angles, msg.sigmas)
    ]
    for bearing in taken:
        if not 0 < bearing.stamp_ns <= end_ns:
            raise ValueError(
                f"bearing of {bearing.landmark_id!r}: its stamp must be > 0 and not after that of the "
                f"message, {end_ns * 1e-9:.3f} s, got {bearing.stamp_ns * 1e-9:.3f} s"
            )
    return sorted(taken, key=lambda bearing: bearing.stamp_ns)


def msg_from_bearings(stamp_ns: int, taken: Sequence[LandmarkBearing], frame: str) -> LandmarkBearingsMsg:
    """The message of one sweep that ended at stamp_ns."""
    return LandmarkBearingsMsg(
        header=conversions.header(stamp_ns, frame),
        ids=[bearing.landmark_id for bearing in taken],
        stamps=[conversions.stamp_from_ns(bearing.stamp_ns) for bearing in taken],
        angles=[bearing.angle_rad for bearing in taken],
        sigmas=[bearing.sigma_rad for bearing in taken],
    )
