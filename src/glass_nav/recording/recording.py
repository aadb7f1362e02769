"""A recorded robot, whatever file it came from: scans with the odometry at their stamps, in order."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Iterable, Iterator, List, Optional, Tuple, Union

import numpy as np

from glass_nav.geometry.trajectory import Trajectory
from glass_nav.sensing.scan import Scan
from glass_nav.sensing.wheel_odometry import WheelParams


class RecordingError(ValueError):
    """A log that cannot be used; one line: the file, what was found, what is needed."""


@dataclass(frozen=True)
class Step:
    """The input of the filter for one scan."""

    scan: Scan
    odom_from_base: np.ndarray  # (3,) at the stamp of the scan


@dataclass(frozen=True)
class Refusal:
    """A scan of the log that cannot be used. It is never dropped silently: the replay counts it."""

    stamp_ns: int
    reason: str  # without the stamp, so that equal reasons can be counted


Entry = Union[Step, Refusal]


@dataclass(frozen=True)
class BeamTruth:
    """True cases of the beams of one scan, from a simulator."""

    stamp_ns: int
    case: np.ndarray  # (B,) uint8: 0..4
    crossing_m: Optional[
        np.ndarray
    ]  # (B,) range of the first pane passed or mirrored at, NaN: none; None: not recorded


@dataclass
class Recording:
    """An open log. Iterating reads it from the start, with the same result every time."""

    name: str
    scan_count: int  # entries to come: for a progress bar
    entries: Iterable[Entry]  # in the order of the log
    ground_truth: Optional[Trajectory] = None  # map_from_base
    notes: List[str] = field(default_factory=list)  # what was chosen or found odd, a line each
    beam_truth: Optional[Iterable[BeamTruth]] = None  # by ascending stamps; read as it is iterated, like the entries
    odom_frame: str = "odom"
    base_frame: str = "base_link"
    duration_s: Optional[float] = None  # of all of it, about; None: not known

    def __len__(self) -> int:
        return self.scan_count

    def __iter__(self) -> Iterator[Entry]:
        return iter(self.entries)

    def in_memory(self) -> "Recording":
        """The same with all entries read, for more than one run over it."""
        entries = list(self.entries)
        truth = None if self.beam_truth is None else list(self.beam_truth)
        return replace(self, scan_count=len(entries), entries=entries, beam_truth=truth)


@dataclass(frozen=True)
class LogOptions:
    """What to read from a log; None: chosen automatically and noted."""

    scan_topic: Optional[str] = None
    odom_topic: Optional[str] = None
    base_frame: Optional[str] = None
    odom_frame: Optional[str] = None
    laser_pose: Optional[Tuple[float, float, float]] = None  # base_from_laser instead of tf's
    ground_truth: Optional[str] = None  # a topic, a file or "tf:FRAME"; "none": none is looked for
    true_beams: Optional[str] = None  # a topic; "none": none is looked for
    deskew: bool = True  # where the log has the time between beams
    wheels: WheelParams = WheelParams()  # with topics: odometry from their counts
    wheel_base_m: float = 0.4
    laser_max_range: float = -1.0  # [m] where a lidar sets no range_max; < 0: the longest range that it shows


def trajectory_from_samples(stamps_ns: "List[int]", poses: "List[Tuple[float, float, float]]") -> Trajectory:
    """Samples in any order as a trajectory; of samples at one stamp the first counts."""
    stamps = np.array(stamps_ns, dtype=np.int64).reshape(-1)
    unique, first = np.unique(stamps, return_index=True)
    return Trajectory(unique, np.array(poses, dtype=float).reshape(-1, 3)[first])
