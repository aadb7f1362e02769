"""Chooses topics, frames, odometry and mountings of a bag, as requested or by what it contains.

What was not asked for is found where there is one candidate, or one with the usual name; each choice is noted.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import List, Optional, Sequence

import numpy as np

from glass_nav.geometry.trajectory import Trajectory
from glass_nav.recording import bag_messages, bag_wheels, frames
from glass_nav.recording.bag_messages import ODOMETRY, SCAN, TF, Bag
from glass_nav.recording.frames import FrameError, FrameTree
from glass_nav.recording.recording import LogOptions, RecordingError, trajectory_from_samples
from glass_nav.sensing import range_limits
from glass_nav.sensing.mounting import Mounting, level_mounting
from glass_nav.sensing.range_limits import RangeLimits
from glass_nav.sensing.scan_placement import NoTransform, RawScan, Transforms

BASE_FRAMES = ("base_link", "base_footprint")  # tried in this order when no base frame is given


@dataclass(frozen=True)
class OdometrySource:
    """The source of odom_from_base: a tf frame, a topic, or encoder counts."""

    frame: Optional[str] = None
    trajectory: Optional[Trajectory] = None
    child_frame: str = ""

    def at(self, tree: FrameTree, base_frame: str, stamp_ns: int) -> np.ndarray:
        """(3,); FrameError if it is not known at that time."""
        if self.frame is not None:
            return np.array(frames.planar(tree.lookup(self.frame, base_frame, stamp_ns)))
        assert self.trajectory is not None
        if not self.trajectory.covers(np.int64(stamp_ns), slack_ns=frames.EXTRAPOLATION_NS):
            raise FrameError("no odometry at that time")
        return self.trajectory.at(np.int64(stamp_ns))


class BagTransforms(Transforms):
    """The transforms of a bag; the laser's pose may be given instead."""

    def __init__(self, tree: FrameTree, odometry: OdometrySource, base_frame: str, options: LogOptions) -> None:
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


@dataclass(frozen=True)
class BagChoices:
    """What is read from a bag."""

    scan_topic: str
    tree: FrameTree
    odometry: OdometrySource
    base_frame: str

    def transforms(self, options: LogOptions) -> BagTransforms:
        """The transforms for the scans."""
        return BagTransforms(self.tree, self.odometry, self.base_frame, options)


def choose(bag: Bag, options: LogOptions, notes: List[str]) -> BagChoices:
    """Choose, and say so in the notes.

    Raises:
        RecordingError: what is needed is missing, or there are several candidates.
    """
    scan_topic = _scan_topic(bag, options.scan_topic, notes)
    tree = _frame_tree(bag)
    odometry = _odometry(bag, tree, options, notes)
    base_frame = _base_frame(tree, odometry, options)
    _check_laser(bag, scan_topic, tree, base_frame, options)
    notes += _scan_notes(bag, scan_topic, options)
    return BagChoices(scan_topic, tree, odometry, base_frame)


def trajectory_of(bag: Bag, topic: str) -> "tuple[Trajectory, str]":
    """The poses on a topic, and the frame that they place (Odometry says it)."""
    stamps: List[int] = []
    poses: List[frames.Planar] = []
    child_frame = ""
    for _, message in bag.messages(topic):
        pose = message.pose.pose if hasattr(message.pose, "pose") else message.pose
        transform = bag_messages.transform_in_space(pose.position, pose.orientation)
        if transform is not None:
            stamps.append(bag_messages.ns_from_header(message.header))
            poses.append(frames.planar(transform))
        child_frame = child_frame or getattr(message, "child_frame_id", "").lstrip("/")
    if not stamps:
        raise RecordingError(f"{bag.path}: {topic} holds no pose that can be used")
    return trajectory_from_samples(stamps, poses), child_frame


def _scan_topic(bag: Bag, wanted: Optional[str], notes: List[str]) -> str:
    if wanted is not None:
        return bag.check_topic(wanted, SCAN)
    found = bag.topics_of(SCAN)
    if not found:
        raise RecordingError(f"{bag.path}: no topic of {SCAN}; it has {bag.listing()}")
    topic = bag.only_or_usual(found, "/scan", f"topics of {SCAN}", "--scan-topic")
    notes.append(f"scans from {topic}")
    return topic


def _frame_tree(bag: Bag) -> FrameTree:
    tree = FrameTree()
    for topic, message in bag.messages(*bag.topics_of(*TF)):
        for stamped in message.transforms:
            transform = bag_messages.transform_in_space(stamped.transform.translation, stamped.transform.rotation)
            if transform is not None:
                tree.add(
                    stamped.header.frame_id,
                    stamped.child_frame_id,
                    bag_messages.ns_from_header(stamped.header),
                    transform,
                    static=topic.endswith("tf_static"),
                )
    return tree


def _odometry(bag: Bag, tree: FrameTree, options: LogOptions, notes: List[str]) -> OdometrySource:
    """Odometry from tf, unless wheels or a topic were requested or tf has none."""
    if options.wheels.wheel_topics:
        notes.append(f"odometry from the counts of {' and '.join(options.wheels.wheel_topics)}")
        return OdometrySource(trajectory=bag_wheels.trajectory(bag, options.wheels, options.wheel_base_m))
    odom_frame = (options.odom_frame or "odom").lstrip("/")
    bases = BASE_FRAMES if options.base_frame is None else (options.base_frame.lstrip("/"),)
    if options.odom_topic is None:
        base = next((frame for frame in bases if frame != odom_frame and tree.connected(odom_frame, frame)), None)
        if base is not None:
            notes.append(f"odometry from tf {odom_frame} <- {base}")
            return OdometrySource(frame=odom_frame)
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
        topic = bag.only_or_usual(found, "/odom", f"topics of {ODOMETRY}", "--odom-topic")
    else:
        topic = bag.check_topic(options.odom_topic, ODOMETRY)
    trajectory, child_frame = trajectory_of(bag, topic)
    notes.append(f"odometry from {topic}")
    return OdometrySource(trajectory=trajectory, child_frame=child_frame)


def _base_frame(tree: FrameTree, odometry: OdometrySource, options: LogOptions) -> str:
    if options.base_frame is not None:
        return options.base_frame.lstrip("/")
    if odometry.frame is not None:
        return next(frame for frame in BASE_FRAMES if tree.connected(odometry.frame, frame))
    return odometry.child_frame or next((frame for frame in BASE_FRAMES if frame in tree.frames), BASE_FRAMES[0])


def _check_laser(bag: Bag, scan_topic: str, tree: FrameTree, base_frame: str, options: LogOptions) -> None:
    """Refuse a bag that does not say where the laser is: all of its scans would be rejected."""
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


def _scan_notes(bag: Bag, scan_topic: str, options: LogOptions) -> List[str]:
    """Notes on the range and the sweep time of the lidar, from its first scans."""
    first = [bag_messages.raw_scan(message) for _, message in itertools.islice(bag.messages(scan_topic), 3)]
    limits = RangeLimits(options.laser_max_range)
    notes = [range_limits.warning(raw.lidar, raw.range_max_m) for raw in first if limits.is_assumed(raw.range_max_m)]
    return notes[:1] + _sweep_notes(first, options.deskew)


def _sweep_notes(scans: Sequence[RawScan], deskews: bool) -> List[str]:
    for raw in scans:
        if raw.timing_fault is not None:
            return [f"scans are not deskewed: {raw.timing_fault}"]
        if raw.sweep_ns and deskews:
            return [f"a sweep of the lidar takes {raw.sweep_ns * 1e-6:.0f} ms: scans are deskewed by odometry"]
    return []
