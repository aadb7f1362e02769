"""Reads encoder counts of a bag as odom_from_base."""

from __future__ import annotations

from typing import List

from glass_nav.geometry.trajectory import Trajectory
from glass_nav.recording import bag_messages
from glass_nav.recording.bag_messages import Bag
from glass_nav.recording.recording import RecordingError
from glass_nav.sensing import wheel_odometry
from glass_nav.sensing.wheel_odometry import Counts, WheelOdometry, WheelParams


def trajectory(bag: Bag, p: WheelParams, wheel_base_m: float) -> Trajectory:
    """Odometry by the counts of the bag's wheels.

    Raises:
        RecordingError: a topic is missing, holds no counts, or both wheels never report together.
    """
    stamps: List[int] = []
    told: List[Counts] = []
    wraps: List[int] = []
    topics = [bag_messages.absolute(topic) for topic in p.wheel_topics]
    for topic in topics:
        if topic not in bag.topics:
            raise RecordingError(f"{bag.path}: no topic {topic} (~wheel_topics); it has {bag.listing()}")
    for connection, heard_ns, message in bag.recorded(*topics):
        topic = bag_messages.absolute(connection.topic)
        try:
            told.append(wheel_odometry.counts(message, topics.index(topic), p))
        except ValueError as err:
            raise RecordingError(f"{bag.path}: {err}") from err
        header = getattr(message, "header", None)
        stamps.append(bag_messages.ns_from_header(header) if header is not None else heard_ns)
        wraps.append(wheel_odometry.wraps_at(connection.msgtype))
    odometry = WheelOdometry(p, wheel_base_m, kept_ns=None)
    odometry.add_all(stamps, told, wraps)
    if not len(odometry.trajectory):
        raise RecordingError(f"{bag.path}: {' and '.join(topics)} hold no counts of both wheels at the same time")
    return odometry.trajectory
