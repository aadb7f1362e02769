"""Poses of another localizer that are recorded in a log, at the stamps of the scans."""

from __future__ import annotations

import dataclasses
from collections import deque
from dataclasses import dataclass
from typing import Callable, Iterator, List, Tuple

import numpy as np

from glass_nav.geometry import se2
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.recording.recording import Entry, RecordingError, Step
from glass_nav.replay import prepared_replay
from glass_nav.replay.prepared_replay import PreparedReplay
from glass_nav.replay.replay_options import ReplayOptions

CARRY_NS = 100_000_000  # a recorded pose may be this much older or newer than the scans' odometry


@dataclass(frozen=True)
class RecordedPath:
    """Poses that another localization left in a log."""

    ours: PreparedReplay
    odometry: Trajectory  # odom_from_base, at all scans
    wanted_ns: np.ndarray  # (W,) scans of the part of the log that is looked at
    stamps_ns: np.ndarray  # (S,) those that have a pose
    map_from_base: np.ndarray  # (S, 3)


def find(options: ReplayOptions, source: str, step_done: Callable[[], None]) -> RecordedPath:
    """The poses at the stamp of every scan of ours that has one.

    Args:
        options: of a replay over the log.
        source: "topic:/amcl_pose" or "tf:map".
        step_done: called after each scan.

    Raises:
        RecordingError, MapError, ParamError, ValueError, OSError: bad input, or no pose in time; one line.
    """
    ours = prepared_replay.prepare(options)
    name = source[len("topic:") :] if source.startswith("topic:") else source
    theirs = dataclasses.replace(options.use, source=dataclasses.replace(options.use.source, ground_truth=name))
    poses = prepared_replay.open_recording(dataclasses.replace(options, use=theirs), ours.settings).ground_truth
    assert poses is not None  # what is asked for and not there is an error
    at_ns: List[int] = []
    odom_from_base: List[np.ndarray] = []

    def noted() -> Iterator[Entry]:
        for entry in ours.recording:
            if isinstance(entry, Step):
                at_ns.append(entry.scan.stamp_ns)
                odom_from_base.append(entry.odom_from_base)
            yield entry

    entries, wanted = noted(), []
    for entry in options.use.window.of(entries):
        if isinstance(entry, Step):
            wanted.append(entry.scan.stamp_ns)
        step_done()
    deque(entries, maxlen=0)  # poses may belong to scans before and after those wanted
    if not wanted:
        raise RecordingError(f"{ours.recording.name}: none of its scans can be used")
    unique, first = np.unique(np.array(at_ns, np.int64), return_index=True)
    odometry, wanted_ns = Trajectory(unique, np.array(odom_from_base)[first]), np.unique(np.array(wanted, np.int64))
    found, map_from_base = carried(poses, odometry, wanted_ns)
    if not found.any():
        raise RecordingError(f"{ours.recording.name}: {source} has no pose before the last scan")
    return RecordedPath(ours, odometry, wanted_ns, wanted_ns[found], map_from_base[found])


def carried(poses: Trajectory, odometry: Trajectory, stamps_ns: np.ndarray) -> "Tuple[np.ndarray, np.ndarray]":
    """Sparse poses, propagated by odometry: the newest map_from_odom holds, as in tf.

    Args:
        poses: map_from_base, N of them.
        odometry: odom_from_base; poses more than CARRY_NS outside its time are of no use.
        stamps_ns: (S,) when the poses are wanted, within the odometry.

    Returns:
        (S,) bool: there was a pose by then; (S, 3) map_from_base, NaN where there was none.
    """
    usable = odometry.covers(poses.stamps_ns, CARRY_NS)
    at_ns, map_from_base = poses.stamps_ns[usable], poses.poses[usable]
    newest = np.searchsorted(at_ns, stamps_ns, side="right") - 1
    found = newest >= 0
    result = np.full((len(stamps_ns), 3), np.nan)
    if found.any():
        map_from_odom = se2.compose(map_from_base, se2.inverse(odometry.at(at_ns)))
        result[found] = se2.compose(map_from_odom[newest[found]], odometry.at(stamps_ns[found]))
    return found, result
