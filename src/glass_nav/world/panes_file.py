"""Reads and writes panes.yaml: the panes that a map lacks, and arrays that a node keeps over restarts.

The file names its map by the fingerprint: panes of another map are refused.
"""

from __future__ import annotations

import base64
import io
import math
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Dict, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from glass_nav.world import drawn_panes
from glass_nav.world.drawn_panes import PaneError
from glass_nav.world.grid_map import GridMap
from glass_nav.world.pane import Pane


class PanesFileError(ValueError):
    """A file of panes is unusable; one line: the file, what was given, what is allowed."""


@dataclass(frozen=True, eq=False)
class PanesFile:
    """The contents of a file of panes."""

    panes: Tuple[Pane, ...]
    arrays: Dict[str, np.ndarray] = field(default_factory=dict)  # by name, as given to save()


def load(path: "Union[str, os.PathLike[str]]", grid_map: GridMap) -> PanesFile:
    """The panes of a file that was written for this map.

    Raises:
        FileNotFoundError: there is no such file.
        PanesFileError: it cannot be read, is about another map, or a pane of it is impossible.
    """
    path = Path(path)
    fields = _fields(path)
    digest = fields.get("map")
    if digest is not None and digest != grid_map.fingerprint:
        raise PanesFileError(
            f"{path}: its panes are of another map: fingerprint {str(digest)[:16]}, this map has {grid_map.digest}"
        )
    panes = fields.get("panes")
    if not isinstance(panes, list):
        raise PanesFileError(f"{path}: must hold a list `panes`, got {type(panes).__name__}")
    found = tuple(_pane(path, number, entry) for number, entry in enumerate(panes, start=1))
    for number, pane in enumerate(found, start=1):
        try:
            drawn_panes.cells(grid_map, pane, number)
        except PaneError as err:
            raise PanesFileError(f"{path}: {err}") from err
    return PanesFile(found, _arrays(path, fields.get("arrays", {})))


def save(
    path: "Union[str, os.PathLike[str]]",
    grid_map: GridMap,
    panes: Sequence[Pane],
    arrays: "Optional[Mapping[str, np.ndarray]]" = None,
) -> None:
    """Write the panes that a map lacks; a file that is there is replaced as a whole or not at all.

    Args:
        path: of the file.
        grid_map: the map, without the panes.
        panes: in the order of their numbers.
        arrays: what else is to be kept, by name.

    Raises:
        OSError: the file cannot be written.
    """
    import yaml

    path = Path(path)
    fields: Dict[str, Any] = {"map": grid_map.fingerprint, "panes": [_entry(pane) for pane in panes]}
    if arrays:
        fields["arrays"] = {name: _packed(array) for name, array in arrays.items()}
    unfinished = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        unfinished.write_text(yaml.safe_dump(fields, default_flow_style=None, sort_keys=False, width=120))
        os.replace(unfinished, path)
    finally:
        if unfinished.exists():
            unfinished.unlink()


def _fields(path: Path) -> Dict[str, Any]:
    import yaml  # here, because most of the package reads no yaml

    try:
        fields = yaml.safe_load(path.read_text())
    except FileNotFoundError:
        raise
    except (OSError, UnicodeDecodeError) as err:
        raise PanesFileError(f"{path}: cannot be read: {getattr(err, 'strerror', None) or 'is no text'}") from err
    except yaml.YAMLError as err:
        raise PanesFileError(f"{path}: is not yaml: {' '.join(str(err).split())}") from err
    if not isinstance(fields, dict):
        raise PanesFileError(f"{path}: is no file of panes: expected the keys map and panes")
    return fields


def _pane(path: Path, number: int, entry: Any) -> Pane:
    if not isinstance(entry, dict):
        raise PanesFileError(f"{path}: pane {number} must have the keys from and to, got {entry!r}")
    ends = [entry.get(name) for name in ("from", "to")]
    for name, end in zip(("from", "to"), ends):
        if not (isinstance(end, list) and len(end) == 2 and all(_is_number(value) for value in end)):
            raise PanesFileError(f"{path}: pane {number}: {name} must be [x, y] in m, got {end!r}")
    probability, seen_from_m, returns, passes = (
        _number(path, number, entry, name, default)
        for name, default in (("probability", 1.0), ("seen_from_m", 0.0), ("returns", 0.0), ("passes", 0.0))
    )
    try:
        return Pane(
            np.array(ends[0], float), np.array(ends[1], float), probability, int(returns), int(passes), seen_from_m
        )
    except ValueError as err:
        raise PanesFileError(f"{path}: pane {number}: {err}") from err


def _number(path: Path, number: int, entry: Dict[str, Any], name: str, default: float) -> float:
    value = entry.get(name, default)
    if not _is_number(value):
        raise PanesFileError(f"{path}: pane {number}: {name} must be a finite number, got {value!r}")
    return float(value)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _entry(pane: Pane) -> Dict[str, Any]:
    return {
        "from": [round(float(value), 4) for value in pane.start_m],
        "to": [round(float(value), 4) for value in pane.end_m],
        "probability": round(float(pane.probability), 4),
        "length_m": round(pane.length_m, 3),
        "returns": int(pane.returns),
        "passes": int(pane.passes),
        "seen_from_m": round(float(pane.seen_from_m), 3),
    }


def _packed(array: np.ndarray) -> str:
    packed = io.BytesIO()
    np.savez_compressed(packed, array=array)
    return base64.b64encode(packed.getvalue()).decode()


def _arrays(path: Path, texts: Any) -> Dict[str, np.ndarray]:
    if not isinstance(texts, dict):
        raise PanesFileError(f"{path}: arrays must be a mapping of names to text, got {type(texts).__name__}")
    found = {}
    for name, text in texts.items():
        try:
            with np.load(io.BytesIO(base64.b64decode(text, validate=True)), allow_pickle=False) as packed:
                found[str(name)] = packed["array"]
        except Exception as err:  # whatever a damaged archive raises: zipfile, zlib, numpy
            raise PanesFileError(f"{path}: the array {name!r} is damaged") from err
    return found
