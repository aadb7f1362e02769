"""Files of atlases: there and back, and each way in which a file can be broken; the schema says the same."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Callable, Dict

import made_atlases
import numpy as np
import pytest

from glass_nav.topology.atlas import atlas_file, atlas_npz, shipped_atlases
from glass_nav.topology.atlas.atlas import Atlas, AtlasError

Data = Dict[str, Any]
SCHEMA = Path(__file__).parents[4] / "atlas" / "atlas.schema.json"


def arrays(atlas: Atlas) -> Dict[str, np.ndarray]:
    return atlas_npz.arrays_of(atlas)


def example() -> Data:
    return json.loads(shipped_atlases.find("document_example").read_text())


@pytest.mark.parametrize("suffix", ["json", "npz"])
@pytest.mark.parametrize("seed", range(5))
def test_an_atlas_comes_back_from_its_file(suffix: str, seed: int, tmp_path: Path) -> None:
    atlas = made_atlases.rotation_system(np.random.default_rng(seed))
    atlas.visits.add_nodes(np.array([0, 0]), np.array([1.1, 1.2]))
    atlas.visits.add_misses(np.array([0, 0, 0]))
    atlas.visits.add_misses(np.array([0, 0, 0]))
    path = tmp_path / f"atlas.{suffix}"
    atlas_file.save(atlas, path)
    back = atlas_file.load(path)
    assert (back.name, back.source) == (atlas.name, atlas.source)
    for name, value in arrays(atlas).items():
        if value.dtype.kind == "f":
            np.testing.assert_allclose(arrays(back)[name], value, atol=6e-5 if suffix == "json" else 0.0, err_msg=name)
        else:
            np.testing.assert_array_equal(arrays(back)[name], value, err_msg=name)
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("suffix", ["json", "npz"])
def test_the_free_space_of_the_map_comes_back(suffix: str, tmp_path: Path) -> None:
    atlas = atlas_file.load(shipped_atlases.find("glass_bridge"))
    atlas_file.save(atlas, tmp_path / f"atlas.{suffix}")
    assert atlas.source.free_space is not None
    assert atlas_file.load(tmp_path).source == atlas.source


def test_lines_and_segments_come_back(tmp_path: Path) -> None:
    data = example()
    data["edges"][0]["segments_to"] = [[0, 1, 2, 1], [3, 1, 4.5, 1]]
    path = tmp_path / "atlas.json"
    path.write_text(json.dumps(data))
    atlas = atlas_file.load(tmp_path)  # the folder will do
    np.testing.assert_array_equal(atlas.darts.segments_m[1], [[0, 1, 2, 1], [3, 1, 4.5, 1]])
    assert len(atlas.darts.segments_m[0]) == 0 and len(atlas.edges.polyline_m[1]) == 4
    atlas_file.save(atlas, path)
    np.testing.assert_array_equal(atlas_file.load(path).darts.segments_m.values, atlas.darts.segments_m.values)


def test_a_large_atlas_comes_back_from_npz_in_time(tmp_path: Path) -> None:
    atlas = made_atlases.voronoi(2000, 3)
    atlas_file.save(atlas, tmp_path / "atlas.npz")
    assert atlas_file.find(tmp_path) == tmp_path / "atlas.npz"
    np.testing.assert_array_equal(atlas_file.load(tmp_path).rings.values, atlas.rings.values)


def set_(*keys: Any) -> Callable[[Data], None]:
    """Data with the value (last) put at the keys."""

    def change(data: Any) -> None:
        for key in keys[:-2]:
            data = data[key]
        data[keys[-2]] = keys[-1]

    return change


def drop(*keys: Any) -> Callable[[Data], None]:
    def change(data: Any) -> None:
        for key in keys[:-1]:
            data = data[key]
        del data[keys[-1]]

    return change


# What the schema can say, and what only the loader does.
IN_SCHEMA = [
    (drop("edges"), "the atlas: edges is missing, needed are format, version, name, map, nodes, edges"),
    (set_("speed", 1), "the atlas: unknown key 'speed', allowed are format"),
    (set_("format", "atlas"), "format must be 'glass_nav/atlas', got 'atlas'"),
    (set_("version", 2), "version must be 1, got 2"),
    (set_("name", 7), "the atlas: name must be text, got 7"),
    (set_("map", "office"), "map must be an object with name and sha256, got 'office'"),
    (drop("map", "sha256"), "map: sha256 is missing, needed are name, sha256"),
    (set_("map", "sha256", "xyz"), "map: sha256 must be 64 digits 0-9a-f or empty, got 'xyz'"),
    (set_("map", "free", 5), "map: place is missing, needed are name, sha256, place, free"),
    (set_("map", "free", "AAAA"), "map: place is missing, needed are name, sha256, place, free"),
    (set_("nodes", {}), "nodes must be a list, got {}"),
    (set_("nodes", []), "an atlas needs at least one node, got none"),
    (set_("edges", []), "an atlas needs at least one edge, got none"),
    (set_("nodes", 1, 5), "node 1: must be an object, got 5"),
    (drop("nodes", 1, "r"), "node 1: r is missing, needed are id, kind, x, y, r, sigma_r, darts"),
    (set_("nodes", 1, "colour", 1), "node 1: unknown key 'colour', allowed are id"),
    (set_("nodes", 0, "kind", "cross"), "node 0: kind must be meetpoint, dead_end, ring_marker, got 'cross'"),
    (set_("nodes", 0, "x", "1"), "node 0: x must be a finite number, got '1'"),
    (set_("nodes", 0, "y", True), "node 0: y must be a finite number, got True"),
    (set_("nodes", 0, "r", 0), "node 0: r must be finite and > 0 m, got 0.0"),
    (set_("nodes", 0, "sigma_r", -1), "node 0: sigma_r must be finite and > 0 m, got -1.0"),
    (set_("nodes", 0, "darts", [2, 4.5, 0]), "node 0: darts must be a list of integers, got [2, 4.5, 0]"),
    (set_("nodes", 0, "darts", []), "node 0: has no darts"),
    (set_("nodes", 0, "visits", 3), "node 0: visits must be an object with count, mean, m2, got 3"),
    (set_("nodes", 0, "visits", {"count": 1}), "node 0: visits: mean is missing, needed are count, mean, m2"),
    (set_("nodes", 0, "visits", {"count": -1, "mean": 1, "m2": 0}), "visits of node 0: the count must be >= 0, got -1"),
    (
        set_("nodes", 0, "visits", {"count": 0, "mean": 0, "m2": 0, "missed": -1}),
        "visits of node 0: missed must be >= 0, got -1",
    ),
    (
        set_("nodes", 0, "visits", {"count": 0, "mean": 0, "m2": 0, "missed": 0.5}),
        "visits of node 0: missed must be an integer, got 0.5",
    ),
    (
        set_("edges", 0, "visits", {"count": 0, "mean": 0, "m2": 0, "missed": 1}),
        "edge 0: visits: unknown key 'missed', allowed are count, mean, m2",
    ),
    (drop("edges", 2, "chord"), "edge 2: chord is missing"),
    (set_("edges", 2, "id", "a"), "edge 2: id must be its place in the list, 2, got 'a'"),
    (set_("edges", 2, "to", 1.5), "edge 2: to must be an integer, got 1.5"),
    (set_("edges", 2, "from", -1), "edge 2: its from must be a node 0 to 3, got -1"),
    (set_("edges", 2, "length", None), "edge 2: length must be a finite number, got None"),
    (set_("edges", 2, "length", -2), "edge 2: the length must be finite and > 0 m, got -2.0"),
    (set_("edges", 2, "clearance", -2), "edge 2: the clearance must be finite and >= 0 m, got -2.0"),
    (set_("edges", 2, "polyline", [[1, 2, 3]]), "edge 2: polyline must be a list of lists of 2 finite numbers"),
    (set_("edges", 2, "segments_to", [[1, 2, 3]]), "edge 2: segments_to must be a list of lists of 4 finite numbers"),
]
BEYOND_SCHEMA = [
    (
        set_("map", {"name": "a", "sha256": "", "place": "8 8", "free": "AAAA"}),
        "map: free: cells must be packed by zlib, in base64: ",
    ),
    (set_("nodes", 2, "id", 3), "node 2: id must be its place in the list, 2, got 3"),
    (set_("nodes", 0, "x", float("nan")), "node 0: x must be a finite number, got nan"),
    (set_("edges", 1, "bearing_to", float("inf")), "edge 1: bearing_to must be a finite number, got inf"),
    (set_("nodes", 0, "darts", [2, 4, 2**70]), "darts must be numbers below 2^63"),
    (set_("edges", 2, "to", 17), "edge 2: its to must be a node 0 to 3, got 17"),
    (set_("nodes", 0, "darts", [4, 2, 0]), "node 0: its darts are not in clockwise order"),
    (set_("nodes", 2, "darts", [4]), "node 0: dart 4 is listed 2 times, each is once in one ring"),
    (set_("nodes", 2, "darts", [9]), "node 2: there is no dart 9, allowed 0 to 7"),
    (set_("nodes", 0, "kind", "ring_marker"), "node 0: a ring_marker has degree 2, got 3"),
    (set_("edges", 1, "chord", 12), "edge 1: the chord must not be longer than the edge, got chord 12 m and length"),
    (set_("edges", 0, "polyline", [[0, 0], [6, 0]]), "edge 0: its line ends 2.00 m from node 1, allowed 0.5 m"),
]


@pytest.mark.parametrize("change, line", IN_SCHEMA + BEYOND_SCHEMA)
def test_a_broken_file_is_refused_in_one_line_that_names_it(
    change: Callable[[Data], None], line: str, tmp_path: Path
) -> None:
    data = example()
    change(data)
    path = tmp_path / "atlas.json"
    path.write_text(json.dumps(data))
    with pytest.raises(AtlasError) as refused:
        atlas_file.load(path)
    assert str(refused.value).startswith(f"{path}: {line}"), str(refused.value)
    assert "\n" not in str(refused.value)


def test_the_schema_takes_what_the_loader_takes_and_refuses_what_it_can() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    validator = jsonschema.Draft7Validator(json.loads(SCHEMA.read_text()))
    validator.check_schema(validator.schema)
    for path in shipped_atlases.shipped().values():
        if path.suffix == ".json":
            validator.validate(json.loads(path.read_text()))
    for change, line in IN_SCHEMA:
        data = example()
        change(data)
        assert not validator.is_valid(data), line
    for change, line in BEYOND_SCHEMA:
        data = example()
        change(data)
        assert validator.is_valid(data), line


@pytest.mark.parametrize(
    "text, line",
    [("{", "is not JSON: Expecting"), ("[]", "must be an object with format, version"), ("\x00", "is not JSON")],
)
def test_what_is_no_json_is_refused(text: str, line: str, tmp_path: Path) -> None:
    path = tmp_path / "atlas.json"
    path.write_text(text)
    with pytest.raises(AtlasError) as refused:
        atlas_file.load(path)
    assert str(refused.value).startswith(f"{path}: {line}")


@pytest.mark.parametrize(
    "change, line",
    [
        (lambda a: a.pop("dart_node"), "lacks dart_node"),
        (lambda a: a.update(format=np.array("other/1")), "format must be glass_nav/atlas/1, got 'other/1'"),
        (
            lambda a: a.update(node_r_m=a["node_r_m"].astype(np.float32)),
            "node_r_m must be float64 of 1 dimensions, got",
        ),
        (lambda a: a.update(node_kind=a["node_kind"].astype(float)), "node_kind must be integers of 1 dimension, got"),
        (lambda a: a.update(node_r_m=-a["node_r_m"]), "node 0: r must be finite and > 0 m"),
        (lambda a: a.update(map_free=np.zeros(1, np.uint8)), "lacks map_place"),
        (
            lambda a: a.update(map_free=np.zeros(1, np.uint8), map_place=np.array("4 8 0.05")),
            "map_free: 4 x 8 cells need 4 bytes, got 1",
        ),
    ],
)
def test_a_broken_npz_is_refused_in_one_line(change: Callable[[Data], Any], line: str, tmp_path: Path) -> None:
    data = arrays(atlas_file.load(shipped_atlases.find("document_example")))
    change(data)
    path = tmp_path / "atlas.npz"
    np.savez(str(path), **data)
    with pytest.raises(AtlasError) as refused:
        atlas_file.load(path)
    assert str(refused.value).startswith(f"{path}: {line}")


def test_an_npz_that_is_none_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "atlas.npz"
    path.write_bytes(b"PK\x03\x04 nothing")
    with pytest.raises(AtlasError, match="cannot be read as npz"):
        atlas_file.load(path)


def test_names_that_are_no_atlas_are_refused(tmp_path: Path) -> None:
    for path, line in [
        (tmp_path, "holds neither atlas.json nor atlas.npz"),
        (tmp_path / "a.json", "does not exist"),
        (tmp_path / "a.yaml", "an atlas is a .json, a .npz or a folder"),
    ]:
        with pytest.raises(AtlasError) as refused:
            atlas_file.load(path)
        assert str(refused.value).startswith(f"{path}: {line}")
    with pytest.raises(AtlasError, match="is saved as .json or .npz"):
        atlas_file.save(made_atlases.voronoi(40, 0), tmp_path / "atlas.yaml")


def test_a_file_that_cannot_be_written_leaves_the_old_one(tmp_path: Path) -> None:
    atlas = atlas_file.load(shipped_atlases.find("document_example"))
    path = tmp_path / "atlas.json"
    path.mkdir()  # os.replace cannot put a file there
    with pytest.raises(OSError):
        atlas_file.save(atlas, path)
    assert [each.name for each in tmp_path.iterdir()] == ["atlas.json"]


def test_shipped_atlases_are_found_by_name_and_a_near_miss_is_helped() -> None:
    assert shipped_atlases.find("document_example").name == "atlas.json"
    with pytest.raises(AtlasError) as refused:
        shipped_atlases.find("document_exampel")
    assert str(refused.value).endswith("did you mean document_example?")
