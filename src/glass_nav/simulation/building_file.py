"""Reads a Building from maps/NAME/building.yaml. The format is described in maps/README.md."""

from __future__ import annotations

import difflib
import functools
import math
import os
from dataclasses import replace
from pathlib import Path
from typing import Any, Callable, Dict, List, Sequence, TypeVar, Union

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.simulation.building import MATERIALS, Building, Door, Mirror, Pane, Person, Thing, Wall, box, check_line
from glass_nav.world import landmark_file
from glass_nav.world.landmark_map import LandmarkMap

FILE_NAME = "building.yaml"
NOUNS = {
    "walls": "wall",
    "panes": "pane",
    "mirrors": "mirror",
    "doors": "door",
    "mullions": "mullion",
    "furniture": "furniture",
    "unmapped": "unmapped",
    "gone": "gone",
    "people": "person",
}
KEYS = {
    "walls": ("line", "thickness", "reflectance"),
    "panes": ("line", "thickness", "coating", "glazing", "gap", "dirt"),
    "mirrors": ("line", "reflectance"),
    "doors": ("line", "mapped", "now", "thickness", "reflectance"),
    "mullions": ("line", "every", "points", "size", "yaw_deg", "reflectance"),
    "furniture": ("box", "yaw_deg", "outline", "reflectance", "movable"),
    "unmapped": ("box", "yaw_deg", "outline", "reflectance"),
    "gone": ("box", "yaw_deg", "outline", "reflectance"),
    "people": ("waypoints", "speed", "radius"),
}
SECTIONS = ("placed", *KEYS, "tags", "seen", "paths", "start")
UNITS = {"thickness": "thickness_m", "gap": "gap_m", "speed": "speed_m_s", "radius": "radius_m"}  # keys of numbers
MULLION_M = 0.06

T = TypeVar("T")
Item = Dict[str, Any]


class BuildingError(ValueError):
    """A building file is unusable; one line: the file, which part, what was given, what is allowed."""


def load(path: "Union[str, os.PathLike[str]]") -> Building:
    """The building in a file, or in the file building.yaml of a folder.

    Raises:
        BuildingError: the file or something in it cannot be used.
    """
    path = Path(path)
    if path.is_dir():
        path = path / FILE_NAME
    try:
        return _building(_document(path), path.parent.name or path.stem)
    except BuildingError as err:
        raise BuildingError(f"{path}: {err}") from err.__cause__


def _document(path: Path) -> Item:
    import yaml  # slow to import, and only files need it

    try:
        text = path.read_text()
    except (OSError, UnicodeDecodeError) as err:
        reason = err.strerror if isinstance(err, OSError) else str(err)
        raise BuildingError(f"cannot be read: {reason}") from err
    try:
        document = yaml.safe_load(text)
    except yaml.YAMLError as err:
        raise BuildingError(f"is not yaml: {' '.join(str(err).split())}") from err
    if document is None:
        raise BuildingError("is empty; a building needs walls, and a path or a start")
    if not isinstance(document, dict):
        raise BuildingError(f"is no building: expected the keys {', '.join(SECTIONS)}")
    return document


def _building(document: Item, name: str) -> Building:
    _check_keys("", document, SECTIONS)
    placed = _pose("placed", document["placed"]) if "placed" in document else np.zeros(3)
    items = {section: _items(document, section) for section in KEYS}
    if not items["walls"]:
        raise BuildingError("has no walls; a building needs at least one")

    def lines(item: Item, noun: str, key: str = "line") -> np.ndarray:
        return se2.transform_points(placed, _points(noun, item, key))

    def each(section: str, make: Callable[[str, Item], T]) -> List[T]:
        return [_made(NOUNS[section], number, item, make) for number, item in enumerate(items[section], start=1)]

    walls = each(
        "walls", lambda noun, item: Wall(lines(item, noun), **_numbers(noun, item, "thickness", "reflectance"))
    )
    panes = each(
        "panes",
        lambda noun, item: Pane(
            lines(item, noun), **_numbers(noun, item, "thickness", "coating", "gap", "dirt"), **_words(item, "glazing")
        ),
    )
    mirrors = each("mirrors", lambda noun, item: Mirror(lines(item, noun), **_numbers(noun, item, "reflectance")))
    doors = each(
        "doors",
        lambda noun, item: Door(
            lines(item, noun), **_words(item, "mapped", "now"), **_numbers(noun, item, "thickness", "reflectance")
        ),
    )
    people = each(
        "people", lambda noun, item: Person(lines(item, noun, "waypoints"), **_numbers(noun, item, "speed", "radius"))
    )
    things: List[Thing] = []
    for section, mapped, present in (("furniture", True, True), ("unmapped", False, True), ("gone", True, False)):
        things += each(section, functools.partial(_thing, placed, mapped, present))
    for posts in each("mullions", lambda noun, item: _mullions(noun, item, placed)):
        things += posts
    paths = {name: se2.transform_points(placed, points) for name, points in _paths(document).items()}
    start = _start(document, placed, paths)
    seen = np.zeros((0, 2))
    if "seen" in document:
        seen = se2.transform_points(placed, _points("seen", document, "seen"))
    return Building(
        tuple(walls),
        tuple(panes),
        tuple(mirrors),
        tuple(doors),
        tuple(things),
        tuple(people),
        paths,
        start,
        seen,
        name,
        _tags(document, placed),
    )


def _thing(placed: np.ndarray, mapped: bool, present: bool, noun: str, item: Item) -> Thing:
    """A piece of furniture that the map has or lacks, and that is there or gone."""
    movable = item.get("movable", mapped and present)
    if not isinstance(movable, bool):
        raise BuildingError(f"{noun} movable must be true or false, got {movable!r}")
    return Thing(
        se2.transform_points(placed, _outline(noun, item)),
        mapped=mapped,
        present=present,
        movable=movable,
        **_numbers(noun, item, "reflectance"),
    )


def _start(document: Item, placed: np.ndarray, paths: Dict[str, np.ndarray]) -> np.ndarray:
    """(3,) start pose: as given, else the begin of the first path, facing along it."""
    if "start" in document:
        return se2.compose(placed, _pose("start", document["start"]))
    if not paths:
        raise BuildingError("has no paths and no start; a building needs one of them")
    first = next(iter(paths.values()))
    return np.append(first[0], np.arctan2(*(first[1] - first[0])[::-1]))


def _tags(document: Item, placed: np.ndarray) -> LandmarkMap:
    """Landmarks, written as in a landmark file."""
    items = document.get("tags") or []
    if not isinstance(items, list):
        raise BuildingError(f"tags must be a list, got {items!r}")
    try:
        tags = landmark_file.from_items(items)
    except ValueError as err:
        raise BuildingError(f"tags: {err}") from err
    return replace(
        tags,
        positions_m=se2.transform_points(placed, tags.positions_m),
        facing_rad=angles.wrap(tags.facing_rad + placed[2]),
    )


def _made(noun: str, number: int, item: Item, make: Callable[[str, Item], T]) -> T:
    """Call make(); its errors get the number of the item."""
    try:
        return make(noun, item)
    except ValueError as err:
        raise BuildingError(f"{noun} {number} {_without_noun(err)}") from err


def _without_noun(err: ValueError) -> str:
    """The text of a part's error without the name of the part that it begins with."""
    return str(err).partition(" ")[2]


def _items(document: Item, section: str) -> List[Item]:
    items = document.get(section)
    if items is None:
        return []
    if not isinstance(items, list):
        raise BuildingError(f"{section} must be a list, got {items!r}")
    for number, item in enumerate(items, start=1):
        who = f"{NOUNS[section]} {number}"
        if not isinstance(item, dict):
            raise BuildingError(f"{who} must have keys of {', '.join(KEYS[section])}, got {item!r}")
        _check_keys(f"{who} has ", item, KEYS[section])
    return items


def _check_keys(who: str, item: Item, known: Sequence[str]) -> None:
    for key in item:
        if key not in known:
            near = difflib.get_close_matches(str(key), known, n=1)
            hint = f"did you mean {near[0]}?" if near else f"known are {', '.join(known)}"
            raise BuildingError(f"{who}unknown key {key!r}; {hint}")


def _number(what: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise BuildingError(f"{what} must be a finite number, got {value!r}")
    return float(value)


def _numbers(noun: str, item: Item, *keys: str) -> Dict[str, Any]:
    """Keyword arguments of the part, for the keys that are given."""
    given: Dict[str, Any] = {}
    for key in keys:
        if key not in item:
            continue
        value = item[key]
        if key == "reflectance" and isinstance(value, str):
            if value not in MATERIALS:
                raise BuildingError(
                    f"{noun} reflectance must be a number or one of {', '.join(MATERIALS)}, got {value!r}"
                )
            value = MATERIALS[value]
        given[UNITS.get(key, key)] = _number(f"{noun} {key}", value)
    return given


def _words(item: Item, *keys: str) -> Dict[str, Any]:
    return {key: item[key] for key in keys if key in item}  # the part itself checks the word


def _point(noun: str, value: Any) -> List[float]:
    numbers = value if isinstance(value, list) else []
    if len(numbers) != 2 or any(isinstance(number, bool) or not isinstance(number, (int, float)) for number in numbers):
        raise BuildingError(f"{noun} has the point {value!r}, a point is [x, y] in m")
    return [float(number) for number in numbers]


def _points(noun: str, item: Item, key: str) -> np.ndarray:
    """(N, 2) points under the key."""
    if key not in item:
        raise BuildingError(f"{noun} has no {key}")
    if not isinstance(item[key], list):
        raise BuildingError(f"{noun} {key} must be a list of points [x, y], got {item[key]!r}")
    points = np.array([_point(noun, value) for value in item[key]], float).reshape(-1, 2)
    if not np.isfinite(points).all():
        number = int(np.argmin(np.isfinite(points).all(axis=1)))
        raise BuildingError(f"{noun} has the point {points[number].tolist()}, coordinates must be finite")
    return points


def _pose(noun: str, value: Any) -> np.ndarray:
    """(3,) pose from [x, y, yaw in degrees]."""
    if not isinstance(value, list) or len(value) != 3:
        raise BuildingError(f"{noun} must be [x, y, yaw_deg] in m, m, degrees, got {value!r}")
    x, y, yaw_deg = (_number(noun, number) for number in value)
    return np.array([x, y, np.deg2rad(yaw_deg)])


def _outline(noun: str, item: Item) -> np.ndarray:
    """(N, 2) corners of a box or of an outline."""
    if ("box" in item) == ("outline" in item):
        raise BuildingError(f"{noun} needs either box: [x, y, length, width] or outline: [[x, y], ...]")
    if "outline" in item:
        if "yaw_deg" in item:
            raise BuildingError(f"{noun} yaw_deg goes with a box only")
        return _points(noun, item, "outline")
    value = item["box"]
    if not isinstance(value, list) or len(value) != 4:
        raise BuildingError(f"{noun} box must be [x, y, length, width] in m, got {value!r}")
    x, y, length, width = (_number(f"{noun} box", number) for number in value)
    if not (length > 0.0 and width > 0.0):
        raise BuildingError(f"{noun} box must have length and width > 0 m, got {value!r}")
    return box(x, y, length, width, np.deg2rad(_number(f"{noun} yaw_deg", item.get("yaw_deg", 0.0))))


def _mullions(noun: str, item: Item, placed: np.ndarray) -> List[Thing]:
    """Square posts along a line from end to end, or at given points."""
    numbers = {key: _number(f"{noun} {key}", item[key]) for key in ("every", "size", "yaw_deg") if key in item}
    size, every = numbers.get("size", MULLION_M), numbers.get("every", 1.0)
    for key, value in (("size", size), ("every", every)):
        if not value > 0.0:
            raise BuildingError(f"{noun} {key} must be > 0 m, got {value}")
    if ("line" in item) == ("points" in item):
        raise BuildingError(f"{noun} needs either line: [[x, y], [x, y]] with every, or points: [[x, y], ...]")
    yaw_rad = np.deg2rad(numbers.get("yaw_deg", 0.0))
    if "points" in item:
        middles = _points(noun, item, "points")
    else:
        line = _points(noun, item, "line")
        check_line(noun, line, most=2)
        way = line[1] - line[0]
        fields = max(int(round(float(np.hypot(*way)) / every)), 1)
        middles = line[0] + np.linspace(0.0, 1.0, fields + 1)[:, None] * way
        yaw_rad = np.arctan2(way[1], way[0])
    return [
        Thing(
            se2.transform_points(placed, box(x, y, size, size, yaw_rad)),
            **{"reflectance": MATERIALS["metal"], **_numbers(noun, item, "reflectance")},
        )
        for x, y in middles
    ]


def _paths(document: Item) -> Dict[str, np.ndarray]:
    paths = document.get("paths") or {}
    if not isinstance(paths, dict):
        raise BuildingError(f"paths must be name: [[x, y], ...], got {paths!r}")
    checked = {}
    for name in paths:
        points = _points(f"path {name}", paths, name)
        try:
            check_line("path", points)
        except ValueError as err:
            raise BuildingError(f"path {name} {_without_noun(err)}") from err
        checked[str(name)] = points
    return checked
