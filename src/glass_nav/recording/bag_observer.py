"""Reads every scan, transform and odometry message of a bag as recorded."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, Optional, Sequence

import numpy as np

from glass_nav.recording.bag_messages import ODOMETRY, SCAN, TF, Bag, absolute, ns_from_header
from glass_nav.recording.observed import HeardOdometry, HeardScan, HeardTransform, Observed


def observe(paths: Sequence[Path], step_done: Optional[Callable[[], None]] = None) -> Observed:
    """Reads all messages about lidars, frames and odometry.

    Args:
        paths: one bag, or the parts of one run.
        step_done: called after each message.

    Raises:
        RecordingError: no bag that can be read.
    """
    with Bag(paths) as bag:
        seen = Observed(" ".join(map(str, paths)), bag.topics)
        seen.scans = {topic: [] for topic in bag.topics_of(SCAN)}
        seen.odometry = {topic: [] for topic in bag.topics_of(ODOMETRY)}
        for connection, heard_ns, message in bag.recorded(*bag.topics_of(SCAN, ODOMETRY, *TF)):
            topic = absolute(connection.topic)
            if topic in seen.scans:
                seen.scans[topic].append(heard_scan(message, ns_from_header(message.header), heard_ns))
            elif topic in seen.odometry:
                seen.odometry[topic].append(
                    HeardOdometry(
                        ns_from_header(message.header), heard_ns, message.header.frame_id, message.child_frame_id
                    )
                )
            else:
                sender = str(getattr(connection.ext, "callerid", None) or "")
                seen.transforms += [
                    heard_transform(each, ns_from_header(each.header), heard_ns, topic.endswith("tf_static"), sender)
                    for each in message.transforms
                ]
            if step_done is not None:
                step_done()
        seen.damage = bag.damage
    return seen


def message_count(paths: Sequence[Path]) -> int:
    """How many messages observe() reads."""
    with Bag(paths) as bag:
        return sum(bag.count(topic) for topic in bag.topics_of(SCAN, ODOMETRY, *TF))


def heard_scan(message: Any, stamp_ns: int, heard_ns: int) -> HeardScan:
    """A LaserScan, of rosbags or of rospy."""
    return HeardScan(
        stamp_ns,
        heard_ns,
        message.header.frame_id,
        np.array(message.ranges, np.float32),
        float(message.angle_min),
        float(message.angle_max),
        float(message.angle_increment),
        float(message.range_min),
        float(message.range_max),
        float(message.time_increment),
        float(message.scan_time),
    )


def heard_transform(message: Any, stamp_ns: int, heard_ns: int, static: bool, sender: str) -> HeardTransform:
    """A TransformStamped, of rosbags or of rospy."""
    offset, turn = message.transform.translation, message.transform.rotation
    return HeardTransform(
        stamp_ns,
        heard_ns,
        message.header.frame_id,
        message.child_frame_id,
        (float(offset.x), float(offset.y), float(offset.z)),
        (float(turn.x), float(turn.y), float(turn.z), float(turn.w)),
        static,
        sender,
    )
