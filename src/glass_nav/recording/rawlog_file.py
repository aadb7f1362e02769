"""Reads an MRPT .rawlog as a Recording: sensory frames with actions, or single observations."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Iterator, List, Optional, Sequence, Tuple, Union

import numpy as np

from glass_nav.geometry.trajectory import Trajectory
from glass_nav.recording import trajectory_file
from glass_nav.recording.recording import (
    Entry,
    LogOptions,
    Recording,
    RecordingError,
    Refusal,
    Step,
    trajectory_from_samples,
)
from glass_nav.sensing.mounting import Mounting, level_mounting
from glass_nav.sensing.range_limits import RangeLimits
from glass_nav.sensing.scan import ScanError
from glass_nav.sensing.scan_placement import NoTransform, RawScan, ScanPlacement, Transforms

if TYPE_CHECKING:
    from glass_nav._mrpt_io import Rawlog

FRAME_PERIOD_NS = 100_000_000  # between frames of a log without times: only their order counts


def open_log(path: Path, options: LogOptions) -> Recording:
    """The recorded robot.

    Raises:
        RecordingError: not a rawlog, or without laser scans or odometry.
    """
    from glass_nav import _mrpt_io

    if not path.is_file():
        raise RecordingError(f"{path}: does not exist")
    try:
        log = _mrpt_io.read_rawlog(str(path))
    except ValueError as err:
        raise RecordingError(f"{path}: {err}") from err
    notes = [f"reading stopped early: the file {log['broken']}"] if log["broken"] else []
    objects = sorted((name.split("::")[-1], count) for name, count in log["objects"].items())
    holds = ", ".join(f"{count} {name}" for name, count in objects)
    cut = f"; the file {log['broken']}" if log["broken"] else ""
    scans = _scans(path, log, options, holds + cut, notes)
    if not len(log["odometry"]):
        raise RecordingError(f"{path}: holds no odometry; it holds {holds}{cut}")
    if (log["stamps_ns"][scans] < 0).all() and log["paired"]:
        notes.append("the scans have no times: 0.1 s between them assumed")
        log["stamps_ns"][scans] = FRAME_PERIOD_NS * np.arange(len(scans))
    odometry = None if log["paired"] else _odometry(path, log)
    truth = _ground_truth(path, options, log["stamps_ns"][scans], notes)
    stamps_ns = log["stamps_ns"][scans]
    duration_s = float(stamps_ns.max() - stamps_ns.min()) * 1e-9
    entries = _Entries(log, scans, odometry, options)
    return Recording(path.name, len(scans), entries, truth, notes, duration_s=duration_s)


def _scans(path: Path, log: Rawlog, options: LogOptions, holds: str, notes: List[str]) -> np.ndarray:
    """Indices of the scans of the requested sensor; a sensor's label takes the place of a topic."""
    if not len(log["stamps_ns"]):
        raise RecordingError(f"{path}: holds no CObservation2DRangeScan; it holds {holds}")
    labels = np.array(log["labels"])
    names = sorted(set(log["labels"]))
    wanted = options.scan_topic
    if wanted is None and len(names) > 1:
        raise RecordingError(
            f"{path}: has scans of {len(names)} sensors ({', '.join(map(repr, names))}), choose one with --scan-topic"
        )
    if wanted is not None and wanted not in names:
        raise RecordingError(f"{path}: no sensor {wanted!r}; sensors with scans: {', '.join(map(repr, names))}")
    chosen = names[0] if wanted is None else wanted
    notes.append(
        f"scans of sensor {chosen!r}, odometry from {'the actions' if log['paired'] else 'CObservationOdometry'}"
    )
    return np.nonzero(labels == chosen)[0]


def _odometry(path: Path, log: Rawlog) -> Trajectory:
    stamped = log["odometry_stamps_ns"] >= 0
    if not stamped.any():
        raise RecordingError(f"{path}: none of its {len(stamped)} odometry readings has a time")
    return trajectory_from_samples(log["odometry_stamps_ns"][stamped].tolist(), log["odometry"][stamped].tolist())


def _ground_truth(path: Path, options: LogOptions, stamps_ns: np.ndarray, notes: List[str]) -> Optional[Trajectory]:
    if options.ground_truth == "none":
        return None
    beside = path.with_name(path.stem + "_GT.txt")
    if options.ground_truth is None and not beside.is_file():
        return None
    source = beside if options.ground_truth is None else Path(options.ground_truth)
    notes.append(f"ground truth from {source}")
    return trajectory_file.load(source, stamps_ns)


class _RecordTransforms(Transforms):
    """Transforms of one scan; a rawlog has the sensor's pose in each record, odometry beside or between the records."""

    def __init__(
        self,
        sensor_pose: Sequence[float],
        odometry: "Union[Trajectory, np.ndarray]",
        laser_pose: Optional[Tuple[float, float, float]],
    ) -> None:
        """
        Args:
            sensor_pose: x, y, z [m], yaw, pitch, roll [rad] on the robot.
            odometry: stamped, or the pose (3,) at the record.
            laser_pose: x, y, yaw to be used instead of the record's.
        """
        self._sensor_pose, self._odometry, self._laser_pose = sensor_pose, odometry, laser_pose

    def odom_from_base(self, stamp_ns: int) -> np.ndarray:
        if not isinstance(self._odometry, Trajectory):
            return self._odometry
        if not self._odometry.covers(np.int64(stamp_ns), slack_ns=FRAME_PERIOD_NS):
            raise NoTransform("no odometry at that time")
        return self._odometry.at(np.int64(stamp_ns))

    def mounting(self, lidar: str, stamp_ns: int) -> Mounting:
        x, y, z, yaw, pitch, roll = self._sensor_pose
        yaw = math.atan2(math.sin(yaw) * math.cos(pitch), math.cos(yaw) * math.cos(pitch))
        base_from_laser = (x, y, yaw) if self._laser_pose is None else self._laser_pose
        return level_mounting(np.array(base_from_laser), z, math.cos(pitch) * math.cos(roll))


class _Entries:
    """Iterates over the scans of a rawlog in memory."""

    def __init__(
        self,
        log: Rawlog,
        scans: np.ndarray,
        odometry: Optional[Trajectory],
        options: LogOptions,
    ) -> None:
        self._log, self._scans, self._odometry, self._options = log, scans, odometry, options
        self._ends = np.cumsum(log["beams"])

    def __iter__(self) -> Iterator[Entry]:
        latest_ns, limits = -1, RangeLimits(self._options.laser_max_range)
        for index in self._scans.tolist():
            raw = self._raw_scan(index)
            entry = self._entry(index, raw, latest_ns, limits)
            latest_ns = max(latest_ns, raw.stamp_ns)
            yield entry

    def _entry(self, index: int, raw: RawScan, latest_ns: int, limits: RangeLimits) -> Entry:
        if raw.stamp_ns < 0:
            return Refusal(0, "the scan has no time")
        if raw.stamp_ns < latest_ns:
            return Refusal(raw.stamp_ns, "time runs backwards")
        sensor_pose = self._log["sensor_pose"][index].tolist()
        odometry = self._odometry_before(index) if self._odometry is None else self._odometry
        placement = ScanPlacement(_RecordTransforms(sensor_pose, odometry, self._options.laser_pose), limits=limits)
        try:
            placed = placement.place(raw)
        except ScanError as err:
            return Refusal(raw.stamp_ns, err.reason)
        return Step(placed.scan, np.array(placed.odom_from_base, float))

    def _odometry_before(self, index: int) -> np.ndarray:
        """(3,) sum of the actions before a frame."""
        before = int(self._log["odometry_index"][index])  # -1: the frame the robot started in
        return self._log["odometry"][before] if before >= 0 else np.zeros(3)

    def _raw_scan(self, index: int) -> RawScan:
        log = self._log
        end = int(self._ends[index])
        part = slice(end - int(log["beams"][index]), end)
        first_rad, step_rad = float(log["first_angle_rad"][index]), float(log["angle_step_rad"][index])
        # MRPT calls a beam without an answer invalid; it does not distinguish "nothing met" from "failed".
        ranges_m = np.where(log["valid"][part] != 0, log["ranges_m"][part].astype(float), np.inf)
        return RawScan(
            stamp_ns=int(log["stamps_ns"][index]),
            lidar="",
            ranges_m=ranges_m,
            angle_min_rad=first_rad,
            angle_max_rad=first_rad + step_rad * (len(ranges_m) - 1),
            angle_increment_rad=step_rad,
            range_min_m=0.0,
            range_max_m=float(log["range_max_m"][index]),
        )
