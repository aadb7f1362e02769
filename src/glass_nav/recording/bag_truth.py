"""Reads the ground truth of a bag: poses in the map, and true cases of the beams."""

from __future__ import annotations

from pathlib import Path
from typing import Iterator, List, Optional, Sequence

import numpy as np

from glass_nav.geometry import se2
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.recording import bag_choices, bag_messages, frames, trajectory_file
from glass_nav.recording.bag_choices import BagChoices
from glass_nav.recording.bag_messages import BEAM_CASES, POSES, TRUE_BEAMS, Bag
from glass_nav.recording.frames import FrameError
from glass_nav.recording.recording import BeamTruth, LogOptions, RecordingError, trajectory_from_samples
from glass_nav.vocabulary import BeamCase

TF_SOURCE = "tf:"  # of poses: the frame of the map follows


def ground_truth(bag: Bag, choices: BagChoices, options: LogOptions, notes: List[str]) -> Optional[Trajectory]:
    """map_from_base, from tf, a topic or a file; None if there is none, or none is wanted."""
    source = options.ground_truth
    if source is not None and source.startswith(TF_SOURCE):
        return _by_tf(bag, choices, source[len(TF_SOURCE) :].lstrip("/"), options.odom_frame, notes)
    return _by_topic_or_file(bag, source, notes)


def _by_tf(bag: Bag, choices: BagChoices, map_frame: str, odom_frame: Optional[str], notes: List[str]) -> Trajectory:
    """Pose in the map by tf, at the stamp of each scan that it covers.

    As tf answers afterwards: between two transforms map <- odom it interpolates.
    """
    tree, odometry, base_frame = choices.tree, choices.odometry, choices.base_frame
    odom_frame = (odom_frame or odometry.frame or "odom").lstrip("/")
    whole = tree.connected(map_frame, base_frame)  # else odometry has a topic of its own
    if not whole and not (odometry.frame is None and tree.connected(map_frame, odom_frame)):
        raise RecordingError(
            f"{bag.path}: no transform {map_frame} <- {base_frame}; frames in tf: {', '.join(tree.frames) or 'none'}"
        )
    stamps: List[int] = []
    poses: List[frames.Planar] = []
    for _, message in bag.messages(choices.scan_topic):
        stamp_ns = bag_messages.ns_from_header(message.header)
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
            f"{bag.path}: no scan on {choices.scan_topic} is in the time of the transforms {map_frame} <- {base_frame}"
        )
    notes.append(f"ground truth from tf {map_frame} <- {base_frame}")
    return trajectory_from_samples(stamps, poses)


def _by_topic_or_file(bag: Bag, source: Optional[str], notes: List[str]) -> Optional[Trajectory]:
    if source == "none":
        return None
    if source is None:
        if bag.topics.get("/ground_truth") not in POSES:
            return None
        source = "/ground_truth"
    if bag_messages.absolute(source) not in bag.topics and Path(source).is_file():
        notes.append(f"ground truth from {source}")
        return trajectory_file.load(Path(source))
    if bag_messages.absolute(source) not in bag.topics and "." in Path(source).name:
        raise RecordingError(f"{source}: no such file of poses, and no topic of {bag.path}")
    topic = bag.check_topic(source, *POSES)
    notes.append(f"ground truth from {topic}")
    return bag_choices.trajectory_of(bag, topic)[0]


def true_beams_topic(bag: Bag, wanted: Optional[str], notes: List[str]) -> Optional[str]:
    """The topic with the truth about the beams; None if there is none, or none is wanted."""
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
        topic = bag.only_or_usual(found, "/true_beams", "topics with the truth about beams", "--true-beams")
    notes.append(f"true cases from {topic}")
    return topic


class TrueBeams:
    """Iterates the truth of a bag, opening it anew each time."""

    def __init__(self, paths: Sequence[Path], topic: str) -> None:
        self._paths, self._topic = paths, topic

    def __iter__(self) -> Iterator[BeamTruth]:
        with Bag(self._paths) as bag:
            for _, message in bag.messages(self._topic):
                stamp_ns, case = bag_messages.ns_from_header(message.header), np.array(message.cases, np.uint8)
                if case.size and case.max() > max(BeamCase):
                    raise RecordingError(
                        f"{bag.path}: {self._topic} at {stamp_ns * 1e-9:.3f} s: cases must be 0 to "
                        f"{max(BeamCase)}, got {case.max()}"
                    )
                crossing = getattr(message, "crossing", None)
                if crossing is not None and len(crossing) != len(case):
                    raise RecordingError(
                        f"{bag.path}: {self._topic} at {stamp_ns * 1e-9:.3f} s: {len(case)} cases, "
                        f"but {len(crossing)} crossings"
                    )
                yield BeamTruth(stamp_ns, case, None if crossing is None else np.array(crossing, float))
