"""Reads a bag of ROS 1 or ROS 2 as a Recording.

The bag is read twice: first everything but the scans (small), then scan by scan while the replay runs, so that a long
log does not have to fit into memory.
"""

from __future__ import annotations

from pathlib import Path
from typing import Dict, Iterator, List, Sequence

from glass_nav.recording import bag_choices, bag_messages, bag_truth
from glass_nav.recording.bag_choices import BagChoices
from glass_nav.recording.bag_messages import Bag
from glass_nav.recording.recording import Entry, LogOptions, Recording, RecordingError, Refusal, Step
from glass_nav.sensing.range_limits import RangeLimits
from glass_nav.sensing.scan import ScanError
from glass_nav.sensing.scan_placement import RawScan, ScanPlacement


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
            choices = bag_choices.choose(bag, options, notes)
            truth = bag_truth.ground_truth(bag, choices, options, notes)
            truth_topic = bag_truth.true_beams_topic(bag, options.true_beams, notes)
            scan_count = bag.count(choices.scan_topic)
            duration_s = bag.duration_s
        except RecordingError as err:  # it may be missing because of the damage
            raise (RecordingError(f"{err}; {bag.damage}") if bag.damage else err) from err
        if bag.damage:
            notes.append(bag.damage)
    entries = _Entries(paths, choices, options)
    beam_truth = None if truth_topic is None else bag_truth.TrueBeams(paths, truth_topic)
    name = paths[0].name if len(paths) == 1 else f"{paths[0].name} and {len(paths) - 1} more"
    odom_frame = choices.odometry.frame or "odom"
    return Recording(name, scan_count, entries, truth, notes, beam_truth, odom_frame, choices.base_frame, duration_s)


class _Entries:
    """Iterates over the scans of a bag, which is opened anew each time."""

    def __init__(self, paths: Sequence[Path], choices: BagChoices, options: LogOptions) -> None:
        self._paths, self._scan_topic, self._options = paths, choices.scan_topic, options
        self._transforms = choices.transforms(options)

    def __iter__(self) -> Iterator[Entry]:
        limits = RangeLimits(self._options.laser_max_range)  # new each time: every run over the bag gets the same
        placement = ScanPlacement(self._transforms, self._options.deskew, limits)
        latest_ns: Dict[str, int] = {}  # by frame: there may be several lidars
        with Bag(self._paths) as bag:
            for _, message in bag.messages(self._scan_topic):
                raw = bag_messages.raw_scan(message)
                entry = _entry(placement, raw, latest_ns.get(raw.lidar, -1))
                if isinstance(entry, Step):
                    latest_ns[raw.lidar] = raw.stamp_ns
                yield entry
            if bag.damage:
                yield Refusal(max(latest_ns.values(), default=0), bag.damage)


def _entry(placement: ScanPlacement, raw: RawScan, latest_ns: int) -> Entry:
    if raw.stamp_ns < latest_ns:
        return Refusal(raw.stamp_ns, "time runs backwards")
    try:
        placed = placement.place(raw)
    except ScanError as err:
        return Refusal(raw.stamp_ns, err.reason)
    return Step(placed.scan, placed.odom_from_base)
