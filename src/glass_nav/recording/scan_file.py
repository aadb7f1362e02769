"""Reads a file with one scan: of `rostopic echo -n 1 scan > scan.yaml`, or a table of angles and ranges."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, List, Sequence

import numpy as np

from glass_nav.recording.recording import RecordingError
from glass_nav.sensing.range_limits import RangeLimits
from glass_nav.sensing.scan import Scan, ScanError, scan_from_fields

SUFFIXES = (".yaml", ".yml", ".csv")
_FIELDS = ("angle_min", "angle_increment", "range_min", "range_max")
_BEYOND_M = 0.01  # added to the largest range of a table to give its lidar's range_max


def load(path: Path, base_from_laser: Sequence[float] = (0.0, 0.0, 0.0)) -> Scan:
    """The scan of a file.

    .yaml: the fields angle_min, angle_increment, range_min, range_max and ranges of a sensor_msgs/LaserScan; others
    are ignored. .csv: a line for each beam with its angle [rad] and range [m], counterclockwise in the laser's
    frame; a header line and comments after # are ignored. No answer: nan or inf.

    Args:
        path: by its suffix.
        base_from_laser: x [m], y [m], yaw [rad] of the laser on the robot.

    Raises:
        RecordingError: the file cannot be used; one line.
    """
    try:
        text = path.read_text()
    except UnicodeDecodeError as err:
        raise RecordingError(f"{path}: is no text") from err
    laser = np.array(base_from_laser, float)
    try:
        return _from_table(path, text, laser) if path.suffix == ".csv" else _from_message(path, text, laser)
    except ScanError as err:
        raise RecordingError(f"{path}: {err.reason}") from err


def _from_message(path: Path, text: str, laser: np.ndarray) -> Scan:
    import yaml

    try:
        message: Any = next(iter(yaml.safe_load_all(text)), None)
    except yaml.YAMLError as err:
        raise RecordingError(f"{path}: is not yaml: {' '.join(str(err).split())}") from err
    if not isinstance(message, dict) or not isinstance(message.get("ranges"), list):
        raise RecordingError(f"{path}: must hold the fields of a LaserScan, with a list of ranges")
    fields = _numbers(path, message)
    ranges_m = [_number(path, f"range {index}", value) for index, value in enumerate(message["ranges"])]
    return scan_from_fields(
        0,
        np.array(ranges_m, float),
        fields["angle_min"],
        fields["angle_increment"],
        fields["range_min"],
        RangeLimits().range_max_m("", fields["range_max"], fields["range_min"], np.array(ranges_m, float)),
        laser,
    )


def _numbers(path: Path, message: Dict[str, Any]) -> Dict[str, float]:
    missing = [name for name in _FIELDS if name not in message]
    if missing:
        raise RecordingError(f"{path}: lacks {', '.join(missing)}")
    return {name: _number(path, name, message[name]) for name in _FIELDS}


def _number(path: Path, what: str, value: Any) -> float:
    """A number, including nan and inf as rostopic writes them, which yaml reads as words."""
    try:
        if not isinstance(value, bool):
            return float(value)
    except (TypeError, ValueError):
        pass
    raise RecordingError(f"{path}: {what} must be a number, got {value!r}")


def _from_table(path: Path, text: str, laser: np.ndarray) -> Scan:
    rows: List[List[float]] = []
    for number, line in enumerate(text.splitlines(), 1):
        cells = line.partition("#")[0].replace(";", ",").split(",")
        if not any(cell.strip() for cell in cells):
            continue
        try:
            row = [float(cell) for cell in cells]
        except ValueError as err:
            if not rows and number == 1:
                continue  # column names
            raise RecordingError(f"{path}: line {number} must be an angle [rad] and a range [m], got {line!r}") from err
        if len(row) != 2 or not np.isfinite(row[0]):
            raise RecordingError(f"{path}: line {number} must be an angle [rad] and a range [m], got {line!r}")
        rows.append(row)
    if not rows:
        raise RecordingError(f"{path}: no beams, a scan needs at least 1")
    angles_rad, ranges_m = np.array(rows).T
    with np.errstate(invalid="ignore"):
        ranges_m = np.where(ranges_m <= 0.0, np.nan, ranges_m)
    finite = ranges_m[np.isfinite(ranges_m)]
    return Scan(0, ranges_m, angles_rad, 0.0, float(finite.max() if len(finite) else 0.0) + _BEYOND_M, laser)
