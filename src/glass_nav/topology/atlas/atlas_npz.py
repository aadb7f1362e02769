"""Reads and writes atlas.npz: the arrays of an atlas, exact to the bit."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Dict, Mapping, Optional

import numpy as np

from glass_nav.topology.atlas.atlas import Atlas, AtlasError, Darts, Edges, MapReference, Nodes, Ragged, Visits
from glass_nav.topology.atlas.atlas_json import FORMAT, VERSION
from glass_nav.world.free_space import FreeSpace

_NPZ_FLOAT = {
    "node_position_m": 2,
    "node_r_m": 1,
    "node_sigma_r_m": 1,
    "edge_length_m": 1,
    "edge_chord_m": 1,
    "edge_sigma_m": 1,
    "edge_clearance_m": 1,
    "polyline_m": 2,
    "dart_bearing_rad": 1,
    "segments_m": 2,
    "visits_node_r_mean_m": 1,
    "visits_node_r_m2": 1,
    "visits_edge_length_mean_m": 1,
    "visits_edge_length_m2": 1,
}
_NPZ_INT = (
    "node_kind",
    "polyline_offsets",
    "dart_node",
    "segments_offsets",
    "ring_darts",
    "ring_offsets",
    "visits_node_count",
    "visits_edge_count",
)
_NPZ_TEXT = ("format", "name", "map_name", "map_sha256")
_NPZ_MAY = ("map_place", "map_free")
_NPZ_MISSED = "visits_node_missed"  # files of older versions lack it


def arrays_of(atlas: Atlas) -> Dict[str, np.ndarray]:
    """The arrays by their names in the file."""
    nodes, edges, darts, visits = atlas.nodes, atlas.edges, atlas.darts, atlas.visits
    return {
        **_free_space_arrays(atlas.source.free_space),
        "format": np.array(f"{FORMAT}/{VERSION}"),
        "name": np.array(atlas.name),
        "map_name": np.array(atlas.source.name),
        "map_sha256": np.array(atlas.source.sha256),
        "node_position_m": nodes.position_m,
        "node_r_m": nodes.r_m,
        "node_sigma_r_m": nodes.sigma_r_m,
        "node_kind": nodes.kind,
        "edge_length_m": edges.length_m,
        "edge_chord_m": edges.chord_m,
        "edge_sigma_m": edges.sigma_m,
        "edge_clearance_m": edges.clearance_m,
        "polyline_m": edges.polyline_m.values,
        "polyline_offsets": edges.polyline_m.offsets,
        "dart_node": darts.node,
        "dart_bearing_rad": darts.bearing_rad,
        "segments_m": darts.segments_m.values,
        "segments_offsets": darts.segments_m.offsets,
        "ring_darts": atlas.rings.values,
        "ring_offsets": atlas.rings.offsets,
        "visits_node_count": visits.node_count,
        "visits_node_r_mean_m": visits.node_r_mean_m,
        "visits_node_r_m2": visits.node_r_m2,
        "visits_edge_count": visits.edge_count,
        "visits_edge_length_mean_m": visits.edge_length_mean_m,
        "visits_edge_length_m2": visits.edge_length_m2,
        _NPZ_MISSED: visits.node_missed,
    }


def _free_space_arrays(free_space: Optional[FreeSpace]) -> Dict[str, np.ndarray]:
    if free_space is None:
        return {}
    return {"map_place": np.array(free_space.place), "map_free": np.frombuffer(free_space.packed, np.uint8)}


def load(path: Path) -> Atlas:
    """Raises AtlasError, in one line without the file."""
    try:
        with np.load(str(path), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as err:
        raise AtlasError(f"cannot be read as npz: {err}") from err
    missing = [name for name in (*_NPZ_TEXT, *_NPZ_FLOAT, *_NPZ_INT) if name not in arrays]
    if missing:
        raise AtlasError(f"lacks {', '.join(missing)}")
    if str(arrays["format"]) != f"{FORMAT}/{VERSION}":
        raise AtlasError(f"format must be {FORMAT}/{VERSION}, got {str(arrays['format'])!r}")
    for name, dimensions in _NPZ_FLOAT.items():
        if arrays[name].dtype != np.float64 or arrays[name].ndim != dimensions:
            raise AtlasError(
                f"{name} must be float64 of {dimensions} dimensions, got {arrays[name].dtype} of {arrays[name].ndim}"
            )
    arrays.setdefault(_NPZ_MISSED, np.zeros(len(arrays["visits_node_count"]), np.int64))
    for name in (*_NPZ_INT, _NPZ_MISSED):
        if arrays[name].dtype.kind != "i" or arrays[name].ndim != 1:
            raise AtlasError(f"{name} must be integers of 1 dimension, got {arrays[name].dtype} of {arrays[name].ndim}")
        if name != "node_kind":
            arrays[name] = arrays[name].astype(np.int64)
    text = {name: str(arrays[name]) for name in _NPZ_TEXT}
    a = arrays
    return Atlas(
        text["name"],
        MapReference(text["map_name"], text["map_sha256"], _free_space(a)),
        Nodes(a["node_position_m"], a["node_r_m"], a["node_sigma_r_m"], a["node_kind"].astype(np.int8)),
        Edges(
            a["edge_length_m"],
            a["edge_chord_m"],
            a["edge_sigma_m"],
            a["edge_clearance_m"],
            Ragged(a["polyline_m"], a["polyline_offsets"]),
        ),
        Darts(a["dart_node"], a["dart_bearing_rad"], Ragged(a["segments_m"], a["segments_offsets"])),
        Ragged(a["ring_darts"], a["ring_offsets"]),
        Visits(
            a["visits_node_count"],
            a["visits_node_r_mean_m"],
            a["visits_node_r_m2"],
            a["visits_edge_count"],
            a["visits_edge_length_mean_m"],
            a["visits_edge_length_m2"],
            a[_NPZ_MISSED],
        ),
    )


def _free_space(arrays: Mapping[str, np.ndarray]) -> Optional[FreeSpace]:
    missing = [name for name in _NPZ_MAY if name not in arrays]
    if len(missing) == len(_NPZ_MAY):
        return None
    if missing:
        raise AtlasError(f"lacks {', '.join(missing)}")
    try:
        return FreeSpace(str(arrays["map_place"]), arrays["map_free"].astype(np.uint8).tobytes())
    except ValueError as err:
        raise AtlasError(f"map_free: {err}") from err
