"""A bag of ROS 1 or ROS 2 -> Recording, through rosbags: no ROS needed, and the same for its versions 0.9.23 and later.

The bag is read twice: first everything but the scans (small), then scan by scan while the replay runs,
so that a long log does not have to fit into memory. Several bags of ROS 1 are read as the one run that `rosbag
record --split` cut them from: merged by the time of recording.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, Iterator, List, Optional, Sequence, Tuple

import numpy as np

from glass_nav.geometry import se2
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.recording import frames, messages, trajectory_file
from glass_nav.recording.frames import FrameError, FrameTree, Transform
from glass_nav.recording.recording import (
    BeamTruth,
    Entry,
    LogOptions,
    Recording,
    RecordingError,
    Refusal,
    Step,
    trajectory_from_samples,
)
from glass_nav.sensing.mounting import Mounting, level_mounting
from glass_nav.sensing.scan import ScanError
from glass_nav.sensing.scan_placement import NoTransform, RawScan, ScanPlacement, Transforms

SCAN = "sensor_msgs/LaserScan"
ODOMETRY = "nav_msgs/Odometry"
TF_SOURCE = "tf:"  # of poses: the frame of the map follows
TF = ("tf2_msgs/TFMessage", "tf/tfMessage")
POSES = ("geometry_msgs/PoseStamped", "geometry_msgs/PoseWithCovarianceStamped", ODOMETRY)
TRUE_BEAMS, BEAM_CASES = "glass_nav/TrueBeams", "glass_nav/BeamCases"
LAST_CASE = 4
BASE_FRAMES = ("base_link", "base_footprint")  # tried in this order when no base frame is given


def open_log(paths: Sequence[Path], options: LogOptions) -> Recording:
    """The recorded robot.

    Args:
        paths: one bag, or all parts of a run that was recorded in parts, in any order.

    Raises:
        RecordingError: not a whole bag, or a topic or transform that is needed is missing.
    """
    notes: List[str] = []
    with Bag(paths) as bag:
        try:
            scan_topic = _scan_topic(bag, options.scan_topic, notes)
            tree = _frame_tree(bag)
            odometry = _odometry(bag, tree, options, notes)
            base_frame = _base_frame(bag, tree, odometry, options)
            _check_laser(bag, scan_topic, tree, base_frame, options)
            notes += _sweep_notes(bag, scan_topic, options.deskew)
            truth = (
                _tf_truth(bag, tree, odometry, base_frame, scan_topic, options, notes)
                if (options.ground_truth or "").startswith(TF_SOURCE)
                else _ground_truth(bag, options.ground_truth, notes)
            )
            truth_topic = _true_beams_topic(bag, options.true_beams, notes)
            scan_count = bag.count(scan_topic)
        except RecordingError as err:  # it may be missing because of the damage
            raise (RecordingError(f"{err}; {bag.damage}") if bag.damage else err) from err
        if bag.damage:
            notes.append(bag.damage)
    placement = ScanPlacement(_BagTransforms(tree, odometry, base_frame, options), options.deskew)
    entries = _Entries(paths, scan_topic, placement)
    beam_truth = None if truth_topic is None else _TrueBeams(paths, truth_topic)
    name = paths[0].name if len(paths) == 1 else f"{paths[0].name} and {len(paths) - 1} more"
    return Recording(name, scan_count, entries, truth, notes, beam_truth, odometry.frame or "odom", base_frame)


class Bag:
    """What we use of rosbags, its errors as RecordingError."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self.paths = [_rosbag2_folder(path) for path in paths]
        self.path = ", ".join(str(path) for path in paths)  # what a line is about
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
        except Exception as err:  # rosbags lets errors of struct, asserts and codecs through
            raise RecordingError(_why_unreadable(self.paths, err)) from err
        return self

    def __exit__(self, *_: object) -> None:
        self._reader.close()

    @property
    def topics(self) -> Dict[str, str]:
        """Topic -> message type as ROS 1 writes it, sorted by topic."""
        return {
            connection.topic: connection.msgtype.replace("/msg/", "/")
            for connection in sorted(self._reader.connections, key=lambda each: str(each.topic))
        }

    def count(self, topic: str) -> int:
        return int(sum(connection.msgcount for connection in self._reader.connections if connection.topic == topic))

    def topics_of(self, *kinds: str) -> List[str]:
        return [topic for topic, kind in self.topics.items() if kind in kinds]

    def messages(self, *topics: str) -> "Iterator[Tuple[str, Any]]":
        """Topic and message in the order they were recorded; ends where the bag is damaged, see `damage`."""
        for connection, _, message in self.recorded(*topics):
            yield connection.topic, message

    def recorded(self, *topics: str) -> "Iterator[Tuple[Any, int, Any]]":
        """Connection of rosbags, time of recording [ns] and message, as messages()."""
        connections = [connection for connection in self._reader.connections if connection.topic in topics]
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
                self.damage = (
                    f"the bag is damaged, {' and '.join(topics)} cannot be read after {count} messages"
                    f" ({_first_line(err)})"
                )
                return
            count += 1
            yield connection, recorded_ns, message

    def check_topic(self, topic: str, *kinds: str) -> str:
        """The topic as the bag spells it, if it is there with one of these types."""
        name = topic if topic in self.topics else "/" + topic
        if name not in self.topics:
            raise RecordingError(f"{self.path}: no topic {topic}; it has {self.listing()}")
        if self.topics[name] not in kinds:
            raise RecordingError(f"{self.path}: {name} is {self.topics[name]}, expected {' or '.join(kinds)}")
        return name

    def listing(self) -> str:
        return ", ".join(f"{topic} ({kind})" for topic, kind in self.topics.items()) or "no topics"


@dataclass(frozen=True)
class _Odometry:
    """Where odom_from_base comes from: a frame of tf, or a topic."""

    frame: Optional[str] = None
    trajectory: Optional[Trajectory] = None
    child_frame: str = ""

    def at(self, tree: FrameTree, base_frame: str, stamp_ns: int) -> np.ndarray:
        if self.frame is not None:
            return np.array(frames.planar(tree.lookup(self.frame, base_frame, stamp_ns)))
        assert self.trajectory is not None
        if not self.trajectory.covers(np.int64(stamp_ns), slack_ns=frames.EXTRAPOLATION_NS):
            raise FrameError("no odometry at that time")
        return self.trajectory.at(np.int64(stamp_ns))


def _scan_topic(bag: Bag, wanted: Optional[str], notes: List[str]) -> str:
    if wanted is not None:
        return bag.check_topic(wanted, SCAN)
    found = bag.topics_of(SCAN)
    if not found:
        raise RecordingError(f"{bag.path}: no topic of {SCAN}; it has {bag.listing()}")
    topic = _only_or_usual(bag, found, "/scan", f"topics of {SCAN}", "--scan-topic")
    notes.append(f"scans from {topic}")
    return topic


def _only_or_usual(bag: Bag, found: List[str], usual: str, what: str, option: str) -> str:
    """Of the topics found, at least one, the only one or the one that is usual."""
    if len(found) == 1:
        return found[0]
    if usual not in found:
        raise RecordingError(f"{bag.path}: {len(found)} {what} ({', '.join(found)}), choose one with {option}")
    return usual


def _frame_tree(bag: Bag) -> FrameTree:
    tree = FrameTree()
    for topic, message in bag.messages(*bag.topics_of(*TF)):
        for stamped in message.transforms:
            transform = _transform(stamped.transform.translation, stamped.transform.rotation)
            if transform is not None:
                tree.add(
                    stamped.header.frame_id,
                    stamped.child_frame_id,
                    _stamp_ns(stamped.header),
                    transform,
                    static=topic.endswith("tf_static"),
                )
    return tree


def _odometry(bag: Bag, tree: FrameTree, options: LogOptions, notes: List[str]) -> _Odometry:
    """From tf, unless a topic is asked for or tf has no odometry."""
    odom_frame = (options.odom_frame or "odom").lstrip("/")
    bases = BASE_FRAMES if options.base_frame is None else (options.base_frame.lstrip("/"),)
    if options.odom_topic is None:
        base = next((frame for frame in bases if frame != odom_frame and tree.connected(odom_frame, frame)), None)
        if base is not None:
            notes.append(f"odometry from tf {odom_frame} <- {base}")
            return _Odometry(frame=odom_frame)
        if options.odom_frame is not None:
            raise RecordingError(
                f"{bag.path}: no transform {odom_frame} <- {' or '.join(bases)}; "
                f"frames in tf: {', '.join(tree.frames) or 'none'}"
            )
        found = bag.topics_of(ODOMETRY)
        if options.ground_truth is not None:  # a reference is no odometry, even where it has the type
            found = [topic for topic in found if topic.lstrip("/") != options.ground_truth.lstrip("/")]
        found = [topic for topic in found if topic not in ("/ground_truth",)]
        if not found:
            raise RecordingError(
                f"{bag.path}: no odometry: no transform {odom_frame} <- {' or '.join(bases)} "
                f"in tf and no topic of {ODOMETRY}; it has {bag.listing()}"
            )
        if len(found) > 1 and "/odom" not in found:
            raise RecordingError(
                f"{bag.path}: {len(found)} topics of {ODOMETRY} ({', '.join(found)}), choose one with --odom-topic"
            )
        topic = found[0] if len(found) == 1 else "/odom"
    else:
        topic = bag.check_topic(options.odom_topic, ODOMETRY)
    trajectory, child_frame = _trajectory(bag, topic)
    notes.append(f"odometry from {topic}")
    return _Odometry(trajectory=trajectory, child_frame=child_frame)


def _base_frame(bag: Bag, tree: FrameTree, odometry: _Odometry, options: LogOptions) -> str:
    if options.base_frame is not None:
        return options.base_frame.lstrip("/")
    if odometry.frame is not None:
        return next(frame for frame in BASE_FRAMES if tree.connected(odometry.frame, frame))
    return odometry.child_frame or next((frame for frame in BASE_FRAMES if frame in tree.frames), BASE_FRAMES[0])


def _check_laser(bag: Bag, scan_topic: str, tree: FrameTree, base_frame: str, options: LogOptions) -> None:
    """Refuse at once a bag that does not say where the laser is: every scan would be refused."""
    if options.laser_pose is not None:
        return
    for _, message in bag.messages(scan_topic):
        laser_frame = message.header.frame_id.lstrip("/")
        if not laser_frame:
            raise RecordingError(
                f"{bag.path}: the scans on {scan_topic} have no frame_id; "
                "say where the laser is with --laser-pose X Y YAW"
            )
        if laser_frame != base_frame and not tree.connected(base_frame, laser_frame):
            raise RecordingError(
                f"{bag.path}: no transform {base_frame} <- {laser_frame} for the laser on "
                f"{scan_topic}; frames in tf: {', '.join(tree.frames) or 'none'}; "
                "say where it is with --laser-pose X Y YAW"
            )
        return


def _sweep_notes(bag: Bag, scan_topic: str, deskews: bool) -> List[str]:
    """What the first scans say of the time that a sweep of the lidar takes."""
    for _, message in itertools.islice(bag.messages(scan_topic), 3):
        raw = _raw_scan(message)
        if raw.timing_fault is not None:
            return [f"scans are taken as of one moment: {raw.timing_fault}"]
        if raw.sweep_ns and deskews:
            return [f"a sweep of the lidar takes {raw.sweep_ns * 1e-6:.0f} ms: scans are deskewed by odometry"]
    return []


def _tf_truth(
    bag: Bag,
    tree: FrameTree,
    odometry: _Odometry,
    base_frame: str,
    scan_topic: str,
    options: LogOptions,
    notes: List[str],
) -> Trajectory:
    """Where tf says the robot is in the map, at the stamp of each scan that it covers.

    As tf answers afterwards: between two transforms map <- odom it interpolates.
    """
    map_frame = (options.ground_truth or "")[len(TF_SOURCE) :].lstrip("/")
    odom_frame = (options.odom_frame or odometry.frame or "odom").lstrip("/")
    whole = tree.connected(map_frame, base_frame)  # else odometry has a topic of its own
    if not whole and not (odometry.frame is None and tree.connected(map_frame, odom_frame)):
        raise RecordingError(
            f"{bag.path}: no transform {map_frame} <- {base_frame}; frames in tf: {', '.join(tree.frames) or 'none'}"
        )
    stamps: List[int] = []
    poses: List[Tuple[float, float, float]] = []
    for _, message in bag.messages(scan_topic):
        stamp_ns = _stamp_ns(message.header)
        try:
            if whole:
                pose = frames.planar(tree.lookup(map_frame, base_frame, stamp_ns))
            else:
                x, y, yaw = se2.compose(
                    np.array(frames.planar(tree.lookup(map_frame, odom_frame, stamp_ns))),
                    odometry.at(tree, base_frame, stamp_ns),
                )
                pose = (float(x), float(y), float(yaw))
        except FrameError:
            continue  # before the first, after the last
        stamps.append(stamp_ns)
        poses.append(pose)
    if not stamps:
        raise RecordingError(
            f"{bag.path}: no scan on {scan_topic} is in the time of the transforms {map_frame} <- {base_frame}"
        )
    notes.append(f"ground truth from tf {map_frame} <- {base_frame}")
    return trajectory_from_samples(stamps, poses)


def _ground_truth(bag: Bag, source: Optional[str], notes: List[str]) -> Optional[Trajectory]:
    if source == "none":
        return None
    if source is None:
        if bag.topics.get("/ground_truth") not in POSES:
            return None
        source = "/ground_truth"
    if source not in bag.topics and Path(source).is_file():
        notes.append(f"ground truth from {source}")
        return trajectory_file.load(Path(source))
    if source not in bag.topics and "/" + source not in bag.topics and "." in Path(source).name:
        raise RecordingError(f"{source}: no such file of poses, and no topic of {bag.path}")
    topic = bag.check_topic(source, *POSES)
    notes.append(f"ground truth from {topic}")
    return _trajectory(bag, topic)[0]


def _true_beams_topic(bag: Bag, wanted: Optional[str], notes: List[str]) -> Optional[str]:
    if wanted == "none":
        return None
    if wanted is not None:
        topic = bag.check_topic(wanted, TRUE_BEAMS, BEAM_CASES)
    else:
        found = bag.topics_of(TRUE_BEAMS) + [
            topic for topic in bag.topics_of(BEAM_CASES) if topic.rpartition("/")[2] == "true_cases"
        ]
        if not found:
            return None
        topic = _only_or_usual(bag, found, "/true_beams", "topics with the truth about beams", "--true-beams")
    notes.append(f"true cases from {topic}")
    return topic


def _trajectory(bag: Bag, topic: str) -> "Tuple[Trajectory, str]":
    """The poses on a topic, and the frame that they place (Odometry says it)."""
    stamps: List[int] = []
    poses: List[Tuple[float, float, float]] = []
    child_frame = ""
    for _, message in bag.messages(topic):
        pose = message.pose.pose if hasattr(message.pose, "pose") else message.pose
        transform = _transform(pose.position, pose.orientation)
        if transform is not None:
            stamps.append(_stamp_ns(message.header))
            poses.append(frames.planar(transform))
        child_frame = child_frame or getattr(message, "child_frame_id", "").lstrip("/")
    if not stamps:
        raise RecordingError(f"{bag.path}: {topic} holds no pose that can be used")
    return trajectory_from_samples(stamps, poses), child_frame


class _BagTransforms(Transforms):
    """What the bag knows of the robot's frames; the laser's place may be given instead."""

    def __init__(self, tree: FrameTree, odometry: _Odometry, base_frame: str, options: LogOptions) -> None:
        self._tree, self._odometry, self._base_frame = tree, odometry, base_frame
        self._given = None if options.laser_pose is None else Mounting(np.array(options.laser_pose))

    def odom_from_base(self, stamp_ns: int) -> np.ndarray:
        try:
            return self._odometry.at(self._tree, self._base_frame, stamp_ns)
        except FrameError as err:
            raise NoTransform(str(err)) from err

    def mounting(self, lidar: str, stamp_ns: int) -> Mounting:
        if self._given is not None:
            return self._given
        try:
            transform = self._tree.lookup(self._base_frame, lidar, stamp_ns)
        except FrameError as err:
            raise NoTransform(str(err)) from err
        return level_mounting(np.array(frames.planar(transform)), transform[0][2], frames.upwardness(transform))


class _Entries:
    """Iterates the scans of a bag, opening it anew each time."""

    def __init__(self, paths: Sequence[Path], scan_topic: str, placement: ScanPlacement) -> None:
        self._paths, self._scan_topic, self._placement = paths, scan_topic, placement

    def __iter__(self) -> Iterator[Entry]:
        latest_ns: Dict[str, int] = {}  # by frame: there may be several lidars
        with Bag(self._paths) as bag:
            for _, message in bag.messages(self._scan_topic):
                raw = _raw_scan(message)
                entry = self._entry(raw, latest_ns.get(raw.lidar, -1))
                if isinstance(entry, Step):
                    latest_ns[raw.lidar] = raw.stamp_ns
                yield entry
            if bag.damage:
                yield Refusal(max(latest_ns.values(), default=0), bag.damage)

    def _entry(self, raw: RawScan, latest_ns: int) -> Entry:
        if raw.stamp_ns < latest_ns:
            return Refusal(raw.stamp_ns, "time runs backwards")
        try:
            placed = self._placement.place(raw)
        except ScanError as err:
            return Refusal(raw.stamp_ns, err.reason)
        return Step(placed.scan, placed.odom_from_base)


class _TrueBeams:
    """Iterates the truth of a bag, opening it anew each time."""

    def __init__(self, paths: Sequence[Path], topic: str) -> None:
        self._paths, self._topic = paths, topic

    def __iter__(self) -> Iterator[BeamTruth]:
        with Bag(self._paths) as bag:
            for _, message in bag.messages(self._topic):
                stamp_ns, case = _stamp_ns(message.header), np.array(message.cases, np.uint8)
                if case.size and case.max() > LAST_CASE:
                    raise RecordingError(
                        f"{bag.path}: {self._topic} at {stamp_ns * 1e-9:.3f} s: cases must be 0 to "
                        f"{LAST_CASE}, got {case.max()}"
                    )
                crossing = getattr(message, "crossing", None)
                if crossing is not None and len(crossing) != len(case):
                    raise RecordingError(
                        f"{bag.path}: {self._topic} at {stamp_ns * 1e-9:.3f} s: {len(case)} cases, "
                        f"but {len(crossing)} crossings"
                    )
                yield BeamTruth(stamp_ns, case, None if crossing is None else np.array(crossing, float))


def _raw_scan(message: Any) -> RawScan:
    """The fields of a LaserScan, nothing checked."""
    return RawScan(
        _stamp_ns(message.header),
        message.header.frame_id.lstrip("/"),
        message.ranges,
        float(message.angle_min),
        float(message.angle_max),
        float(message.angle_increment),
        float(message.range_min),
        float(message.range_max),
        float(message.time_increment),
        float(message.scan_time),
    )


def _stamp_ns(header: Any) -> int:
    return int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)


def _transform(translation: Any, rotation: Any) -> Optional[Transform]:
    """None where there is a NaN or a quaternion without direction."""
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
    """Which of the bags it is, and why."""
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
        return (
            f"{path}: cut short or never closed (its index is missing); `rosbag reindex {path}` may save what it holds"
        )
    return f"{path}: cannot be read: {_first_line(err)}"


def _first_line(err: Exception) -> str:
    text = str(err).strip()
    return text.splitlines()[0] if text else type(err).__name__
