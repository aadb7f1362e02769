"""Reads and writes landmarks.yaml. Lengths in m, angles in degrees, all in the frame map:

    sigma: 0.01               # how well the positions were surveyed; default 0.01
    view_deg: 90              # for all tags without their own; default 90
    range: 15                 # likewise; default 15
    landmarks:
      - {id: A1, position: [3.2, 4.5], facing_deg: -90}   # its detector looks down, along -y
      - {id: 17, position: [9.0, 4.5]}                    # no direction: visible from all sides

An id is a word or a whole number; in bearings it is a string, "17".
"""

from __future__ import annotations

import difflib
import math
import os
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Union

import numpy as np

from glass_nav.world.landmark_map import RANGE_M, VIEW_RAD, LandmarkMap

KEYS = ("id", "position", "facing_deg", "view_deg", "range")
DEFAULTS = ("view_deg", "range")
MIN_DISTANCE_M = 0.01  # between two landmarks
SECTIONS = ("sigma", *DEFAULTS, "landmarks")


class LandmarkError(ValueError):
    """A landmark file is unusable; one line: the file, which landmark, what was given, what is allowed."""


def load(path: "Union[str, os.PathLike[str]]") -> LandmarkMap:
    """The landmarks of a file; it may have none.

    Raises:
        LandmarkError: the file or something in it cannot be used.
    """
    path = Path(path)
    try:
        return _landmark_map(_document(path))
    except ValueError as err:
        raise LandmarkError(f"{path}: {err}") from err


def save(landmarks: LandmarkMap, path: "Union[str, os.PathLike[str]]", remark: str = "") -> None:
    """Write a file that load() reads as an equal map; the remark is its first line."""
    lines = [f"# {remark}"] if remark else []
    lines += [
        "# Lengths in m, angles in degrees, in the frame map.",
        f"sigma: {float(landmarks.sigma_m)!r}",
        "landmarks:" if len(landmarks) else "landmarks: []",
    ]
    for number, name in enumerate(landmarks.ids):
        x, y = (_number_text(value) for value in landmarks.positions_m[number])
        item = f"id: {_id_text(name)}, position: [{x}, {y}]"
        if not np.isnan(landmarks.facing_rad[number]):
            item += (
                f", facing_deg: {_number_text(np.degrees(landmarks.facing_rad[number]))}"
                f", view_deg: {_number_text(np.degrees(landmarks.view_rad[number]))}"
            )
        reach = float(landmarks.range_m[number])
        lines.append(f"  - {{{item}, range: {_number_text(reach) if math.isfinite(reach) else '.inf'}}}")
    Path(path).write_text("\n".join(lines) + "\n")


def from_items(
    items: Sequence[Any], view_deg: float = float(np.degrees(VIEW_RAD)), range_m: float = RANGE_M, sigma_m: float = 0.01
) -> LandmarkMap:
    """Landmarks from parsed yaml, one mapping each.

    Raises:
        ValueError: "landmark 3 ...", one line about what is wrong.
    """
    ids: List[str] = []
    rows: List[List[float]] = []
    for number, item in enumerate(items, start=1):
        who = f"landmark {number}"
        if not isinstance(item, dict):
            raise ValueError(f"{who} must have keys of {', '.join(KEYS)}, got {item!r}")
        _check_keys(f"{who} has ", item, KEYS)
        ids.append(_id(who, item))
        who = f"landmark {number} ({ids[-1]})"
        facing_deg = _number(f"{who} facing_deg", item["facing_deg"]) if "facing_deg" in item else math.nan
        if "view_deg" in item and "facing_deg" not in item:
            raise ValueError(f"{who} has view_deg and no facing_deg: without a direction it is seen from all sides")
        view = 360.0 if math.isnan(facing_deg) else _number(f"{who} view_deg", item.get("view_deg", view_deg))
        rows.append([*_position(who, item), facing_deg, view, _range(f"{who} range", item.get("range", range_m))])
    table = np.array(rows, float).reshape(-1, 5)
    _check_places(ids, table[:, :2])
    return LandmarkMap(
        tuple(ids), table[:, :2].copy(), np.radians(table[:, 2]), np.radians(table[:, 3]), table[:, 4].copy(), sigma_m
    )


def _document(path: Path) -> Dict[str, Any]:
    import yaml  # slow to import, and only files need it

    try:
        text = path.read_text()
    except (OSError, UnicodeDecodeError) as err:
        reason = err.strerror if isinstance(err, OSError) else str(err)
        raise ValueError(f"cannot be read: {reason}") from err
    try:
        document = yaml.safe_load(text)
    except yaml.YAMLError as err:
        raise ValueError(f"is not yaml: {' '.join(str(err).split())}") from err
    if not isinstance(document, dict) or "landmarks" not in document:
        raise ValueError("is no landmark file: expected landmarks, a list of {id: ..., position: [x, y]}")
    return document


def _landmark_map(document: Dict[str, Any]) -> LandmarkMap:
    _check_keys("", document, SECTIONS)
    items = document["landmarks"]
    if not isinstance(items, list):
        raise ValueError(f"landmarks must be a list, got {items!r}")
    sigma_m = _number("sigma", document.get("sigma", 0.01))
    if sigma_m < 0.0:
        raise ValueError(f"sigma must be >= 0 m, got {sigma_m:g}")
    return from_items(
        items,
        _number("view_deg", document.get("view_deg", float(np.degrees(VIEW_RAD)))),
        _range("range", document.get("range", RANGE_M)),
        sigma_m,
    )


def _check_keys(who: str, item: Mapping[Any, Any], known: Sequence[str]) -> None:
    for key in item:
        if key not in known:
            near = difflib.get_close_matches(str(key), known, n=1)
            hint = f"did you mean {near[0]}?" if near else f"known are {', '.join(known)}"
            raise ValueError(f"{who}unknown key {key!r}; {hint}")


def _check_places(ids: Sequence[str], positions_m: np.ndarray) -> None:
    """Refuse landmarks at one place: tags back to back still differ by the thickness of their cases."""
    for number, name in enumerate(ids):
        near = np.hypot(*(positions_m[number + 1 :] - positions_m[number]).T) < MIN_DISTANCE_M
        if near.any():
            raise ValueError(
                f"landmarks {name!r} and {ids[number + 1 + int(np.argmax(near))]!r} are in the same "
                f"place, {positions_m[number].tolist()}"
            )


def _id(who: str, item: Dict[str, Any]) -> str:
    given: Optional[Any] = item.get("id")
    name = str(given) if isinstance(given, (str, int)) and not isinstance(given, bool) else ""
    if not name or name != name.strip():
        raise ValueError(f"{who} id must be a word or a whole number, got {given!r}")
    return name


def _position(who: str, item: Dict[str, Any]) -> List[float]:
    value = item.get("position")
    if not isinstance(value, list) or len(value) != 2:
        raise ValueError(f"{who} position must be [x, y] in m, got {value!r}")
    return [_number(f"{who} position", each) for each in value]


def _number(what: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise ValueError(f"{what} must be a finite number, got {value!r}")
    return float(value)


def _range(what: str, value: Any) -> float:
    return math.inf if value == math.inf else _number(what, value)


def _number_text(value: float) -> str:
    return repr(round(float(value), 9))


def _id_text(name: str) -> str:
    """The id, quoted if yaml would not read it as a word or a plain number."""
    plain = name.isdigit() and str(int(name)) == name
    return name if plain else "'" + name.replace("'", "''") + "'"
