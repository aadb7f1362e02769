"""Reads and writes atlas.json: a row for each node and each edge, for people and editors.

atlas/atlas.schema.json is its JSON Schema; the checks here are those of the schema. Lengths are kept to a tenth of a
millimetre, angles to a hundredth of a milliradian.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from glass_nav.topology.atlas.atlas import KINDS, Atlas, AtlasError, Darts, Edges, MapReference, Nodes, Ragged, Visits
from glass_nav.world.free_space import FreeSpace

FORMAT, VERSION = "glass_nav/atlas", 1

_PLACES_M, _PLACES_RAD = 4, 5
_TOP = ("format", "version", "name", "map", "nodes", "edges")
_NODE = ("id", "kind", "x", "y", "r", "sigma_r", "darts")
_EDGE = ("id", "from", "to", "length", "chord", "sigma", "clearance", "bearing_from", "bearing_to")
_EDGE_MAY = ("polyline", "segments_from", "segments_to", "visits")
_VISITS = ("count", "mean", "m2")
_NODE_VISITS_MAY = ("missed",)
_MAP, _MAP_MAY = ("name", "sha256"), ("place", "free")
_MISSING = object()

Row = Dict[str, Any]


def text_of(atlas: Atlas) -> str:
    """The atlas as text, one node or edge per line, so that versions can be compared."""
    head = {
        "$schema": "../atlas.schema.json",
        "format": FORMAT,
        "version": VERSION,
        "name": atlas.name,
        "map": {"name": atlas.source.name, "sha256": atlas.source.sha256, **_free_space_entry(atlas.source.free_space)},
    }
    lines = [f" {json.dumps(key)}: {json.dumps(value)}" for key, value in head.items()]
    for key, rows in (("nodes", _node_rows(atlas)), ("edges", _edge_rows(atlas))):
        lines.append(f" {json.dumps(key)}: [\n  " + ",\n  ".join(json.dumps(row) for row in rows) + "\n ]")
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _free_space_entry(free_space: Optional[FreeSpace]) -> Row:
    return {} if free_space is None else {"place": free_space.place, "free": free_space.text}


def _node_rows(atlas: Atlas) -> List[Row]:
    nodes, visits = atlas.nodes, atlas.visits
    rows = []
    for i in range(len(nodes)):
        row = {
            "id": i,
            "kind": KINDS[nodes.kind[i]],
            "x": _metres(nodes.position_m[i, 0]),
            "y": _metres(nodes.position_m[i, 1]),
            "r": _metres(nodes.r_m[i]),
            "sigma_r": _metres(nodes.sigma_r_m[i]),
            "darts": atlas.rings[i].tolist(),
        }
        seen = visits.node_count[i], visits.node_r_mean_m[i], visits.node_r_m2[i]
        rows.append({**row, **_visits_entry(*seen, missed=int(visits.node_missed[i]))})
    return rows


def _edge_rows(atlas: Atlas) -> List[Row]:
    edges, darts, visits = atlas.edges, atlas.darts, atlas.visits
    rows = []
    for i in range(len(edges)):
        row: Row = {
            "id": i,
            "from": int(darts.node[2 * i]),
            "to": int(darts.node[2 * i + 1]),
            "length": _metres(edges.length_m[i]),
            "chord": _metres(edges.chord_m[i]),
            "sigma": _metres(edges.sigma_m[i]),
            "clearance": _metres(edges.clearance_m[i]),
            "bearing_from": round(float(darts.bearing_rad[2 * i]), _PLACES_RAD),
            "bearing_to": round(float(darts.bearing_rad[2 * i + 1]), _PLACES_RAD),
        }
        for key, points in (
            ("polyline", edges.polyline_m[i]),
            ("segments_from", darts.segments_m[2 * i]),
            ("segments_to", darts.segments_m[2 * i + 1]),
        ):
            if len(points):
                row[key] = np.round(points, 3).tolist()
        rows.append(
            {**row, **_visits_entry(visits.edge_count[i], visits.edge_length_mean_m[i], visits.edge_length_m2[i])}
        )
    return rows


def _metres(value: float) -> float:
    return round(float(value), _PLACES_M)


def _visits_entry(count: int, mean: float, m2: float, missed: int = 0) -> Row:
    if not (count or missed):
        return {}
    entry = {"count": int(count), "mean": float(mean), "m2": float(m2)}
    return {"visits": {**entry, "missed": missed} if missed else entry}


def load(path: Path) -> Atlas:
    """Raises AtlasError, in one line without the file."""
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as err:
        raise AtlasError(f"cannot be read: {err.strerror}") from err
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as err:
        raise AtlasError(f"is not JSON: {err}") from err
    if not isinstance(data, dict):
        raise AtlasError(f"must be an object with {', '.join(_TOP)}, got {_short(data)}")
    _refuse_keys("the atlas", data, _TOP, ("$schema",))
    if data["format"] != FORMAT:
        raise AtlasError(f"format must be {FORMAT!r}, got {_short(data['format'])}")
    if type(data["version"]) is not int or data["version"] != VERSION:
        raise AtlasError(f"version must be {VERSION}, got {_short(data['version'])}")
    name, source = _text("the atlas", data, "name"), data["map"]
    if not isinstance(source, dict):
        raise AtlasError(f"map must be an object with name and sha256, got {_short(source)}")
    _refuse_keys("map", source, _MAP, _MAP_MAY)
    reference = MapReference(_text("map", source, "name"), _text("map", source, "sha256"), _free_space(source))
    if reference.sha256 and not (len(reference.sha256) == 64 and set(reference.sha256) <= set("0123456789abcdef")):
        raise AtlasError(f"map: sha256 must be 64 digits 0-9a-f or empty, got {_short(reference.sha256)}")
    nodes, edges = _rows(data, "nodes", _NODE, ("visits",)), _rows(data, "edges", _EDGE, _EDGE_MAY)
    return Atlas(
        name,
        reference,
        _nodes(nodes),
        _edges(edges),
        _darts(edges),
        _rings(nodes),
        _visits(nodes, edges),
    )


def _free_space(source: Row) -> Optional[FreeSpace]:
    if not any(key in source for key in _MAP_MAY):
        return None
    _refuse_keys("map", source, (*_MAP, *_MAP_MAY), ())
    try:
        return FreeSpace.from_text(_text("map", source, "place"), _text("map", source, "free"))
    except ValueError as err:
        raise AtlasError(f"map: free: {err}") from err


def _nodes(rows: List[Row]) -> Nodes:
    kinds = {kind: number for number, kind in enumerate(KINDS)}
    for i, row in enumerate(rows):
        if not isinstance(row["kind"], str) or row["kind"] not in kinds:
            raise AtlasError(f"node {i}: kind must be {', '.join(KINDS)}, got {_short(row['kind'])}")
    position = np.stack([_numbers("node", rows, "x"), _numbers("node", rows, "y")], axis=-1)
    return Nodes(
        position,
        _numbers("node", rows, "r"),
        _numbers("node", rows, "sigma_r"),
        np.array([kinds[row["kind"]] for row in rows], np.int8),
    )


def _edges(rows: List[Row]) -> Edges:
    return Edges(
        _numbers("edge", rows, "length"),
        _numbers("edge", rows, "chord"),
        _numbers("edge", rows, "sigma"),
        _numbers("edge", rows, "clearance"),
        Ragged.of([_points(i, row, "polyline", 2) for i, row in enumerate(rows)], 2),
    )


def _darts(rows: List[Row]) -> Darts:
    both = [
        np.stack([_integers("edge", rows, "from"), _integers("edge", rows, "to")], axis=-1),
        np.stack([_numbers("edge", rows, "bearing_from"), _numbers("edge", rows, "bearing_to")], axis=-1),
    ]
    segments = [_points(i, row, key, 4) for i, row in enumerate(rows) for key in ("segments_from", "segments_to")]
    return Darts(both[0].ravel(), both[1].ravel(), Ragged.of(segments, 4))


def _rings(rows: List[Row]) -> Ragged:
    for i, row in enumerate(rows):
        ring = row["darts"]
        if not isinstance(ring, list) or any(type(dart) is not int for dart in ring):
            raise AtlasError(f"node {i}: darts must be a list of integers, got {_short(ring)}")
    offsets = np.concatenate([[0], np.cumsum([len(row["darts"]) for row in rows])]).astype(np.int64)
    flat = [dart for row in rows for dart in row["darts"]]
    try:
        return Ragged(np.array(flat, np.int64), offsets)
    except OverflowError as err:
        raise AtlasError(f"darts must be numbers below 2^63, got {max(flat, key=abs)}") from err


def _visits(nodes: List[Row], edges: List[Row]) -> Visits:
    of_nodes, of_edges = _visits_entries("node", nodes, _NODE_VISITS_MAY), _visits_entries("edge", edges, ())
    missed = _integers("visits of node", [{"missed": 0, **entry} for entry in of_nodes], "missed")
    return Visits(*_measured("node", of_nodes), *_measured("edge", of_edges), missed)


def _visits_entries(what: str, rows: List[Row], may: Sequence[str]) -> List[Row]:
    entries: List[Row] = []
    for i, row in enumerate(rows):
        entry = row.get("visits", {"count": 0, "mean": 0.0, "m2": 0.0})
        if not isinstance(entry, dict):
            raise AtlasError(f"{what} {i}: visits must be an object with {', '.join(_VISITS)}, got {_short(entry)}")
        _refuse_keys(f"{what} {i}: visits", entry, _VISITS, may)
        entries.append(entry)
    return entries


def _measured(what: str, entries: List[Row]) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    owner = f"visits of {what}"
    return _integers(owner, entries, "count"), _numbers(owner, entries, "mean"), _numbers(owner, entries, "m2")


# -- checks of single values


def _rows(data: Row, key: str, required: Sequence[str], may: Sequence[str]) -> List[Row]:
    rows = data[key]
    if not isinstance(rows, list):
        raise AtlasError(f"{key} must be a list, got {_short(rows)}")
    for i, row in enumerate(rows):
        if not isinstance(row, dict):
            raise AtlasError(f"{key[:-1]} {i}: must be an object, got {_short(row)}")
        _refuse_keys(f"{key[:-1]} {i}", row, required, may)
        if type(row["id"]) is not int or row["id"] != i:
            raise AtlasError(f"{key[:-1]} {i}: id must be its place in the list, {i}, got {_short(row['id'])}")
    return rows


def _refuse_keys(who: str, row: Mapping[str, Any], required: Sequence[str], may: Sequence[str]) -> None:
    for key in required:
        if key not in row:
            raise AtlasError(f"{who}: {key} is missing, needed are {', '.join(required)}")
    for key in row:
        if key not in required and key not in may:
            raise AtlasError(f"{who}: unknown key {_short(key)}, allowed are {', '.join([*required, *may])}")


def _text(who: str, row: Row, key: str) -> str:
    if not isinstance(row[key], str):
        raise AtlasError(f"{who}: {key} must be text, got {_short(row[key])}")
    return str(row[key])


def _numbers(what: str, rows: List[Row], key: str) -> np.ndarray:
    """(rows,) float64."""
    column = [row[key] for row in rows]
    if not set(map(type, column)) <= {int, float} or not all(map(_finite, column)):
        at = next(i for i, value in enumerate(column) if type(value) not in (int, float) or not _finite(value))
        raise AtlasError(f"{what} {at}: {key} must be a finite number, got {_short(column[at])}")
    return np.array(column, float)


def _integers(what: str, rows: List[Row], key: str) -> np.ndarray:
    """(rows,) int64."""
    column = [row[key] for row in rows]
    for i, value in enumerate(column):
        if type(value) is not int or abs(value) >= 2**63:
            raise AtlasError(f"{what} {i}: {key} must be an integer, got {_short(value)}")
    return np.array(column, np.int64)


def _finite(value: Union[int, float]) -> bool:
    return abs(value) < 1e300 if isinstance(value, int) else math.isfinite(value)


def _points(edge: int, row: Row, key: str, width: int) -> np.ndarray:
    """(n, width) of one edge; no rows where the key is not there."""
    given = row.get(key, _MISSING)
    if given is _MISSING:
        return np.zeros((0, width))
    if isinstance(given, list) and all(
        isinstance(point, list)
        and len(point) == width
        and all(type(value) in (int, float) and _finite(value) for value in point)
        for point in given
    ):
        return np.array(given, float).reshape(-1, width)
    raise AtlasError(f"edge {edge}: {key} must be a list of lists of {width} finite numbers, got {_short(given)}")


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
