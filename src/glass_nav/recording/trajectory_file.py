"""Reads and writes files of poses: TUM (as evo) and MRPT's ground truth."""

from __future__ import annotations

from pathlib import Path
from typing import List, Optional, Tuple

import numpy as np

from glass_nav.geometry import angles
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.recording.recording import RecordingError, trajectory_from_samples


def load(path: Path, scan_stamps_ns: Optional[np.ndarray] = None) -> Trajectory:
    """The poses of a file.

    Args:
        path: TUM (`stamp x y z qx qy qz qw` a row) or MRPT (`index x y yaw` a row).
        scan_stamps_ns: (S,) of the log; MRPT's rows have no stamps, row i - 1 belongs to scan i.

    Raises:
        RecordingError: no such file, or rows in neither format.
    """
    rows = _rows(path)
    columns = {len(row) for _, row in rows}
    if columns == {8}:
        return _from_tum(path, rows)
    if columns == {4}:
        return _from_mrpt(path, rows, scan_stamps_ns)
    raise RecordingError(
        f"{path}: a row of poses has 8 columns (TUM: stamp x y z qx qy qz qw) or 4 "
        f"(MRPT: index x y yaw), got {', '.join(str(count) for count in sorted(columns))}"
    )


def save_tum(path: Path, trajectory: Trajectory) -> None:
    """Write a TUM file; stamps keep their nanoseconds."""
    lines = []
    for stamp_ns, (x, y, yaw) in zip(trajectory.stamps_ns.tolist(), trajectory.poses.tolist()):
        seconds, rest = divmod(stamp_ns, 1_000_000_000)
        lines.append(f"{seconds}.{rest:09d} {x:.6f} {y:.6f} 0 0 0 {np.sin(yaw / 2):.9f} {np.cos(yaw / 2):.9f}\n")
    path.write_text("".join(lines))


def _rows(path: Path) -> "List[Tuple[int, List[str]]]":
    try:
        lines = path.read_text().splitlines()
    except (OSError, UnicodeDecodeError) as err:
        reason = err.strerror if isinstance(err, OSError) and err.strerror else str(err)
        raise RecordingError(f"{path}: cannot be read: {reason}") from err
    rows = [
        (number, line.replace(",", " ").split())
        for number, line in enumerate(lines, 1)
        if line.strip() and not line.lstrip().startswith(("#", "%"))
    ]
    if not rows:
        raise RecordingError(f"{path}: holds no poses")
    return rows


def _from_tum(path: Path, rows: "List[Tuple[int, List[str]]]") -> Trajectory:
    stamps: List[int] = []
    poses: List[Tuple[float, float, float]] = []
    for number, row in rows:
        x, y, _, qx, qy, qz, qw = _numbers(path, number, row[1:])
        if not qx * qx + qy * qy + qz * qz + qw * qw > 1e-12:
            raise RecordingError(f"{path}: line {number}: the quaternion has no direction")
        stamps.append(_nanoseconds(path, number, row[0]))
        poses.append((x, y, float(np.arctan2(2.0 * (qw * qz + qx * qy), qw * qw + qx * qx - qy * qy - qz * qz))))
    return trajectory_from_samples(stamps, poses)


def _from_mrpt(path: Path, rows: "List[Tuple[int, List[str]]]", scan_stamps_ns: Optional[np.ndarray]) -> Trajectory:
    if scan_stamps_ns is None:
        raise RecordingError(f"{path}: its rows have an index and no stamp, which fits a rawlog only; give a TUM file")
    stamps: List[int] = []
    poses: List[Tuple[float, float, float]] = []
    for number, row in rows:
        index, x, y, yaw = _numbers(path, number, row)
        scan = int(index) + 1  # MRPT writes the pose after the action that follows the scan
        if 0 <= scan < len(scan_stamps_ns):
            stamps.append(int(scan_stamps_ns[scan]))
            poses.append((x, y, float(angles.wrap(np.float64(yaw)))))
    if not stamps:
        raise RecordingError(f"{path}: none of its {len(rows)} rows belongs to one of {len(scan_stamps_ns)} scans")
    return trajectory_from_samples(stamps, poses)


def _numbers(path: Path, number: int, words: List[str]) -> List[float]:
    try:
        values = [float(word) for word in words]
    except ValueError as err:
        raise RecordingError(f"{path}: line {number}: {err}") from err
    if not np.all(np.isfinite(values)):
        raise RecordingError(f"{path}: line {number}: a pose must be finite, got {' '.join(words)}")
    return values


def _nanoseconds(path: Path, number: int, word: str) -> int:
    """Nanoseconds of a decimal number of seconds, exactly: a float has too few digits after 104 days (2**53 ns)."""
    whole, _, rest = word.partition(".")
    if whole.lstrip("-").isdigit() and (rest.isdigit() or not rest):
        sign = -1 if whole.startswith("-") else 1
        return int(whole) * 1_000_000_000 + sign * int((rest + "000000000")[:9])
    return int(round(_numbers(path, number, [word])[0] * 1e9))  # exponents such as 1.5e9
