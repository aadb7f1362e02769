"""Reads the messages of a bag of ROS 1 or ROS 2 with rosbags 0.9.23 or later: no ROS is needed.

Several bags of ROS 1 are read as the one run that `rosbag record --split` cut them from: merged by the time of
recording.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Dict, Iterator, List, Optional, Sequence, Tuple

from glass_nav.recording import frames, messages
from glass_nav.recording.frames import Transform
from glass_nav.recording.recording import RecordingError
from glass_nav.sensing.scan_placement import RawScan

SCAN = "sensor_msgs/LaserScan"
ODOMETRY = "nav_msgs/Odometry"
TF = ("tf2_msgs/TFMessage", "tf/tfMessage")
POSES = ("geometry_msgs/PoseStamped", "geometry_msgs/PoseWithCovarianceStamped", ODOMETRY)
TRUE_BEAMS, BEAM_CASES = "glass_nav/TrueBeams", "glass_nav/BeamCases"


class Bag:
    """A context manager around rosbags that raises its errors as RecordingError."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self.paths = [_rosbag2_folder(path) for path in paths]
        self.path = ", ".join(str(path) for path in paths)  # for errors
        self.damage = ""  # where reading had to stop, in words
        self._reader: Any = None

    def __enter__(self) -> "Bag":
        for path in self.paths:
            if not path.exists():
                raise RecordingError(f"{path}: does not exist")
        if len({path.resolve() for path in self.paths}) < len(self.paths):
            raise RecordingError(f"{self.path}: a bag is named twice")
        try:
            from rosbags.highlevel import AnyReader
        except ImportError as err:
            raise RecordingError(
                f"{self.path}: reading bags needs the Python package rosbags (pip install rosbags): {err}"
            ) from err
        try:
            self._reader = AnyReader(self.paths, default_typestore=messages.ros2_store())
            self._reader.open()
            self._define()
        except Exception as err:  # rosbags lets errors of struct, asserts and codecs through
            raise RecordingError(_why_unreadable(self.paths, err)) from err
        return self

    def __exit__(self, *_: object) -> None:
        self._reader.close()

    @property
    def topics(self) -> Dict[str, str]:
        """Topic -> message type as ROS 1 writes it, sorted by topic."""
        kinds = {absolute(each.topic): each.msgtype.replace("/msg/", "/") for each in self._reader.connections}
        return dict(sorted(kinds.items()))

    def count(self, topic: str) -> int:
        return int(sum(each.msgcount for each in self._reader.connections if absolute(each.topic) == topic))

    @property
    def duration_s(self) -> float:
        """Time from the first to the last message, by the time of recording."""
        return max(float(self._reader.duration) * 1e-9, 0.0)

    def topics_of(self, *kinds: str) -> List[str]:
        return [topic for topic, kind in self.topics.items() if kind in kinds]

    def messages(self, *topics: str) -> "Iterator[Tuple[str, Any]]":
        """Topic and message in the order they were recorded; ends where the bag is damaged, see `damage`."""
        for connection, _, message in self.recorded(*topics):
            yield absolute(connection.topic), message

    def recorded(self, *topics: str) -> "Iterator[Tuple[Any, int, Any]]":
        """Connection of rosbags, time of recording [ns] and message, as messages().

        Raises:
            RecordingError: the bag does not define their type.
        """
        connections = [connection for connection in self._reader.connections if absolute(connection.topic) in topics]
        for connection in connections:
            self._check_defined(connection)
        if not connections:
            return
        count = 0
        messages = self._reader.messages(connections=connections)
        while True:
            try:
                connection, recorded_ns, raw = next(messages)
                message = self._reader.deserialize(raw, connection.msgtype)
            except StopIteration:
                return
            except Exception as err:  # noqa: BLE001  rosbags lets errors of struct, asserts and codecs through
                decoded = f"only the first {count} messages" if count else "no message"
                self.damage = (
                    f"the bag is damaged: {decoded} on {' and '.join(topics)} could be decoded ({_first_line(err)})"
                )
                return
            count += 1
            yield connection, recorded_ns, message

    def check_topic(self, topic: str, *kinds: str) -> str:
        """The topic as the bag spells it, if it is there with one of these types."""
        name = absolute(topic)
        if name not in self.topics:
            raise RecordingError(f"{self.path}: no topic {topic}; it has {self.listing()}")
        if self.topics[name] not in kinds:
            raise RecordingError(f"{self.path}: {name} is {self.topics[name]}, expected {' or '.join(kinds)}")
        return name

    def _define(self) -> None:
        """Standard types that the bag names without defining them get the definitions that we have."""
        reader = self._reader
        if reader.is2:
            ours = messages.ros2_store()
        elif all(messages.text_of(connection) for connection in reader.connections):
            return
        else:
            from rosbags.typesys import Stores, get_types_from_msg, get_typestore

            ours = messages.noetic_store()
            reader.typestore = get_typestore(Stores.EMPTY)  # without the empty definitions
            for connection in reader.connections:
                if messages.text_of(connection):
                    reader.typestore.register(get_types_from_msg(messages.text_of(connection), connection.msgtype))
        known = messages.definitions_of(reader.typestore)
        if any(connection.msgtype not in known for connection in reader.connections):
            reader.typestore.register(
                {name: each for name, each in messages.definitions_of(ours).items() if name not in known}
            )

    def _check_defined(self, connection: Any) -> None:
        kind = connection.msgtype.replace("/msg/", "/")
        if self._reader.is2:
            if connection.msgtype not in messages.definitions_of(self._reader.typestore):
                raise RecordingError(
                    f"{self.path}: {absolute(connection.topic)} is {kind}, which the bag does not define; "
                    "`ros2 bag record --storage mcap` writes definitions"
                )
        elif not messages.text_of(connection) and messages.noetic_md5(connection.msgtype) != connection.digest:
            raise RecordingError(
                f"{self.path}: {absolute(connection.topic)} is {kind} of md5 {connection.digest}, which the bag does not "
                "define and ROS Noetic does not have; `rosbag record` writes definitions"
            )

    def only_or_usual(self, found: List[str], usual: str, what: str, option: str) -> str:
        """The only topic found, or the one with the usual name; at least one was found."""
        if len(found) == 1:
            return found[0]
        if usual not in found:
            raise RecordingError(f"{self.path}: {len(found)} {what} ({', '.join(found)}), choose one with {option}")
        return usual

    def listing(self) -> str:
        return ", ".join(f"{topic} ({kind})" for topic, kind in self.topics.items()) or "no topics"


def absolute(topic: str) -> str:
    """The topic with the "/" in front, which some recorders leave out."""
    return "/" + topic.strip("/")


def raw_scan(message: Any) -> RawScan:
    """The fields of a LaserScan, nothing checked."""
    return RawScan(
        ns_from_header(message.header),
        message.header.frame_id.lstrip("/"),
        message.ranges,
        float(message.angle_min),
        float(message.angle_max),
        float(message.angle_increment),
        float(message.range_min),
        float(message.range_max),
        float(message.time_increment),
        float(message.scan_time),
        message.intensities,
    )


def ns_from_header(header: Any) -> int:
    return int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)


def transform_in_space(translation: Any, rotation: Any) -> Optional[Transform]:
    """A transform in space; None if it has a NaN or a quaternion without direction."""
    unit = frames.normalised((float(rotation.x), float(rotation.y), float(rotation.z), float(rotation.w)))
    offset = (float(translation.x), float(translation.y), float(translation.z))
    if unit is None or not all(math.isfinite(value) for value in offset):
        return None
    return offset, unit


def _rosbag2_folder(path: Path) -> Path:
    """The folder of a bag of ROS 2, where a file in it was named."""
    beside = path.suffix in (".mcap", ".db3") and (path.parent / "metadata.yaml").is_file()
    return path.parent if beside else path


def _why_unreadable(paths: Sequence[Path], err: Exception) -> str:
    """Which of the bags cannot be read, and why."""
    for path in paths if len(paths) > 1 else ():
        try:
            with Bag([path]):
                pass
        except RecordingError as alone:
            return str(alone)
    path = paths[0]
    if len(paths) > 1:
        return f"{', '.join(map(str, paths))}: cannot be read as one run: {_first_line(err)}"
    if path.is_dir():
        if (path / "metadata.yaml").is_file():
            return f"{path}: cannot be read: {_first_line(err)}"
        return f"{path}: is a folder without metadata.yaml, so no bag of ROS 2 (`ros2 bag reindex` writes it)"
    try:
        with path.open("rb") as file:
            head = file.read(13)
    except OSError as refused:
        return f"{path}: cannot be read: {refused.strerror}"
    if not head:
        return f"{path}: is empty"
    if path.suffix in (".mcap", ".db3"):
        return f"{path}: a bag of ROS 2 needs metadata.yaml beside it (`ros2 bag reindex` writes it)"
    if path.suffix == ".bag" or head.startswith(b"#ROSBAG"):
        if head != b"#ROSBAG V2.0\n":
            return f"{path}: is no ROS 1 bag"
        if _is_whole(path):
            return f"{path}: a message definition in it cannot be read: {_first_line(err)}"
        return (
            f"{path}: cut short or never closed (its index is missing); `rosbag reindex {path}` may save what it holds"
        )
    return f"{path}: is not a bag ({_first_line(err)})"


def _is_whole(path: Path) -> bool:
    """Whether the index of a bag of ROS 1 can be read."""
    from rosbags.rosbag1 import Reader

    try:
        with Reader(path):
            return True
    except Exception:  # noqa: BLE001  as above
        return False


def _first_line(err: Exception) -> str:
    text = str(err).strip()
    return text.splitlines()[0] if text else type(err).__name__
