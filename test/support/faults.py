"""A good bag -> the same bag with one fault, as a robot would record it."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Tuple

import numpy as np

from glass_nav.geometry import se2

Record = Tuple[str, int, Any]  # topic, time of recording [ns], message
Change = Callable[[List[Record]], List[Record]]
S = 1_000_000_000


def read(path: Path, seconds: float = math.inf) -> List[Record]:
    """The first seconds of a bag, in memory."""
    from rosbags.highlevel import AnyReader

    with AnyReader([path]) as reader:
        wanted = [
            connection
            for connection in reader.connections
            if connection.topic in ("/scan", "/odom", "/tf", "/tf_static")
        ]
        scans_from = None
        records: List[Record] = []
        for connection, heard_ns, raw in reader.messages(connections=wanted):
            if connection.topic == "/scan" and scans_from is None:
                scans_from = heard_ns
            if scans_from is not None and heard_ns > scans_from + seconds * S:
                break
            records.append((connection.topic, heard_ns, reader.deserialize(raw, connection.msgtype)))
    return records


def write(path: Path, records: List[Record]) -> Path:
    """A bag of ROS 1, in the order of recording."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"))
    connections: Dict[str, Any] = {}
    with Writer(path) as writer:
        for topic, heard_ns, message in sorted(records, key=lambda record: record[1]):
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], heard_ns, store.serialize_ros1(message, kind))
    return path


def copied(value: Any) -> Any:
    """A message with its parts, as copy.deepcopy() in a fifth of the time: there are thousands of them."""
    if isinstance(value, list):
        return [copied(each) for each in value]
    if isinstance(value, np.ndarray):
        return value.copy()
    if dataclasses.is_dataclass(value):
        return type(value)(**{name: copied(each) for name, each in vars(value).items()})
    return value


# -- changes of single messages; None drops one


def scans(change: Callable[[int, Any], Any]) -> Change:
    """change(index, scan) -> scan, None, or a list of scans."""

    def apply(records: List[Record]) -> List[Record]:
        changed: List[Record] = []
        index = 0
        for topic, heard_ns, message in records:
            if topic != "/scan":
                changed.append((topic, heard_ns, message))
                continue
            reported = change(index, copied(message))
            index += 1
            changed += [
                (topic, heard_ns, each)
                for each in (reported if isinstance(reported, list) else [reported])
                if each is not None
            ]
        return changed

    return apply


def links(change: Callable[[int, Any], Any], child: str = "base_link") -> Change:
    """change(index, transform) -> transform, None or a list, for each transform of one child."""

    def apply(records: List[Record]) -> List[Record]:
        changed: List[Record] = []
        index = 0
        for topic, heard_ns, message in records:
            if not topic.startswith("/tf"):
                changed.append((topic, heard_ns, message))
                continue
            message = copied(message)
            kept: List[Any] = []
            for each in message.transforms:
                if each.child_frame_id.lstrip("/") != child:
                    kept.append(each)
                    continue
                reported = change(index, each)
                index += 1
                kept += [one for one in (reported if isinstance(reported, list) else [reported]) if one is not None]
            message.transforms = kept
            changed.append((topic, heard_ns, message))
        return changed

    return apply


def delayed(seconds: Callable[[int], float], topic: str = "/scan") -> Change:
    """Messages of the topic are recorded later than they were."""

    def apply(records: List[Record]) -> List[Record]:
        changed: List[Record] = []
        index = 0
        for name, heard_ns, message in records:
            late = round(seconds(index) * S) if name == topic else 0
            index += name == topic
            changed.append((name, heard_ns + late, message))
        return changed

    return apply


def dropped(*topics: str) -> Change:
    return lambda records: [record for record in records if record[0] not in topics]


# -- parts of messages


def with_stamp(message: Any, change: Callable[[int], int]) -> Any:
    stamp_ns = change(message.header.stamp.sec * S + message.header.stamp.nanosec)
    message.header.stamp.sec, message.header.stamp.nanosec = stamp_ns // S, stamp_ns % S
    return message


def with_fields(message: Any, **fields: Any) -> Any:
    for name, value in fields.items():
        setattr(message, name, value)
    return message


def with_ranges(message: Any, change: Callable[[np.ndarray], np.ndarray]) -> Any:
    message.ranges = np.ascontiguousarray(change(np.array(message.ranges, np.float32)), np.float32)
    return message


def planar(transform: Any) -> np.ndarray:
    rotation, offset = transform.transform.rotation, transform.transform.translation
    return np.array([offset.x, offset.y, 2.0 * math.atan2(rotation.z, rotation.w)])


def with_planar(transform: Any, pose: np.ndarray) -> Any:
    rotation, offset = transform.transform.rotation, transform.transform.translation
    offset.x, offset.y = float(pose[0]), float(pose[1])
    rotation.x = rotation.y = 0.0
    rotation.z, rotation.w = math.sin(pose[2] / 2.0), math.cos(pose[2] / 2.0)
    return transform


def odometry_steps(change: Callable[[np.ndarray], np.ndarray]) -> Change:
    """change(step) of each step (3,) from one transform odom -> base to the next, in the robot's frame."""
    state: Dict[str, Optional[np.ndarray]] = {"true": None, "reported": None}

    def each(_: int, transform: Any) -> Any:
        pose = planar(transform)
        if state["true"] is None:
            state["reported"] = pose
        else:
            step = se2.compose(se2.inverse(state["true"]), pose)
            state["reported"] = se2.compose(state["reported"], change(step))
        state["true"] = pose
        return with_planar(transform, state["reported"])

    return links(each)
