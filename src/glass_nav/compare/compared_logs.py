"""The logs of a comparison: those of --log BAG=MAP and those of a yaml list."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, List, Optional, Sequence, Tuple

from glass_nav.replay.replay_options import Triple

_Listed = Tuple[Tuple[Path, ...], Path, Optional[str], Optional[Triple]]  # the fields of Log


@dataclass(frozen=True)
class Log:
    """One log of a comparison, with its map and options."""

    name: str
    paths: Tuple[Path, ...]
    map: Path
    ground_truth: Optional[str] = None
    initial_pose: Optional[Triple] = None


def parse(pairs: Sequence[str], listing: Optional[Path]) -> List[Log]:
    """The logs of --log BAG=MAP and of the list.

    Raises:
        ValueError: not of that form; one line.
    """
    found: List[_Listed] = []
    for pair in pairs:
        log, mark, grid = pair.rpartition("=")
        if not (mark and log and grid):
            raise ValueError(f"--log must be BAG=MAP, got '{pair}'")
        found.append(((Path(log),), Path(grid), None, None))
    if listing is not None:
        found += [_listed(listing, number, item) for number, item in enumerate(_items(listing), 1)]
    names = _names([paths for paths, *_ in found])
    if len(set(names)) < len(names):
        raise ValueError(f"a log is named twice: {next(name for name in names if names.count(name) > 1)}")
    return [Log(name, *rest) for name, rest in zip(names, found)]


def _items(listing: Path) -> List[Any]:
    import yaml

    try:
        items = yaml.safe_load(listing.read_text())
    except (UnicodeDecodeError, yaml.YAMLError) as err:
        raise ValueError(f"{listing}: is not yaml: {' '.join(str(err).split())}") from err
    if not isinstance(items, list) or not items:
        raise ValueError(f"{listing}: must be a list of log and map, a log each, got {type(items).__name__}")
    return items


def _listed(listing: Path, number: int, item: Any) -> _Listed:
    """One log of the list; relative paths start at the folder of the list."""
    allowed = {"log", "map", "ground_truth", "initial_pose"}
    if not isinstance(item, dict) or not {"log", "map"} <= set(item) <= allowed:
        raise ValueError(
            f"{listing}: item {number} must have log and map, may have ground_truth and initial_pose, got {item}"
        )
    parts = item["log"] if isinstance(item["log"], list) else [item["log"]]
    pose, truth = item.get("initial_pose"), item.get("ground_truth")
    if not parts or not all(isinstance(text, str) for text in [*parts, item["map"], truth or ""]):
        raise ValueError(f"{listing}: item {number}: log, map and ground_truth must be texts, got {item}")
    if pose is not None and not (
        isinstance(pose, list) and len(pose) == 3 and all(type(value) in (int, float) for value in pose)
    ):
        raise ValueError(f"{listing}: item {number}: initial_pose must be [x, y, yaw] in m, m, rad, got {pose}")
    if truth is not None and (listing.parent / truth).is_file():
        truth = str(listing.parent / truth)
    return (
        tuple(listing.parent / part for part in parts),
        listing.parent / item["map"],
        truth,
        None if pose is None else (float(pose[0]), float(pose[1]), float(pose[2])),
    )


def _names(paths: "Sequence[Tuple[Path, ...]]") -> List[str]:
    """Names for the logs: the file name, or the whole path where file names are equal."""
    short = [each[0].name for each in paths]
    return [name if short.count(name) == 1 else str(each[0]) for name, each in zip(short, paths)]
