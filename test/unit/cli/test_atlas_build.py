"""glass_nav atlas build and show as a user calls them: the atlas, its picture, the lines they print and refuse with."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from glass_nav.cli import main as cli
from glass_nav.topology.atlas import atlas_file
from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap

REPO = Path(__file__).resolve().parents[3]
CELL_M = 0.05


@pytest.fixture
def floor(tmp_path):
    """A corridor with a pillar, and a room of its own: map.yaml in a folder called floor."""
    occupancy = np.full((120, 240), 100, np.int8)
    occupancy[20:60, 20:220] = 0
    occupancy[34:46, 110:130] = 100
    occupancy[70:110, 40:160] = 0
    (tmp_path / "floor").mkdir()
    map_file.save(GridMap(occupancy, CELL_M, np.zeros(3)), tmp_path / "floor" / "map.yaml")
    return tmp_path / "floor" / "map.yaml"


@pytest.fixture
def run(capsys, tmp_path, monkeypatch):
    """run(word, ...): exit code, stdout, stderr; in tmp_path."""
    monkeypatch.chdir(tmp_path)

    def command(*words):
        code = cli.main(["atlas", *(str(word) for word in words)])
        captured = capsys.readouterr()
        return code, captured.out.replace(f"{tmp_path}/", ""), captured.err.replace(f"{tmp_path}/", "")

    return command


def size_px(path):
    """Width and height in the header of a PNG."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")


@pytest.mark.long_run
def test_an_atlas_is_built_and_drawn(run, floor, tmp_path):
    code, out, err = run("build", floor, "--out", tmp_path / "atlas" / "ours")
    assert code == 0, err
    said = re.fullmatch(
        r"6 nodes \(2 meetpoints, 4 dead ends\), 5 edges, (\d+) m of ways in 2 parts of the floor, "
        r"\d+ segments; written to atlas/ours/atlas.json \(\d+ kB\)\n",
        out,
    )
    assert said, out
    atlas = atlas_file.load(tmp_path / "atlas" / "ours")
    assert (atlas.name, atlas.source.name) == ("ours", "floor")
    assert float(said[1]) == pytest.approx(atlas.edges.length_m.sum(), abs=0.5)
    for options, name, panels in (
        ([], "ours.png", 3),
        (["--edge", 2], "ours_edge_2.png", 2),
        (["--map", floor], "ours.png", 3),
    ):
        code, out, err = run("show", tmp_path / "atlas" / "ours", *options)
        assert code == 0, err
        assert out == f"drawn to {name}" + ("\n" if "--map" in options else "; --map MAP draws the map under it\n")
        width, height = size_px(tmp_path / name)
        assert width > 800 and height > 200 * panels


def test_options_reach_the_graph_and_the_views(run, floor, tmp_path):
    assert run("build", floor, "--out", "a", "--name", "narrow", "--robot-radius", 0.8, "--view-range", 2)[0] == 0
    narrow = atlas_file.load(tmp_path / "a")
    assert narrow.name == "narrow" and len(narrow.edges) == 3  # one way on each side of the pillar, one in the room
    assert run("build", floor, "--out", "b")[0] == 0
    wide = atlas_file.load(tmp_path / "b")
    assert len(wide.edges) == 5
    length = [
        np.hypot(*(rows[:, 2:] - rows[:, :2]).T).max()
        for rows in (narrow.darts.segments_m.values, wide.darts.segments_m.values)
    ]
    assert length[0] < length[1]


def test_the_progress_goes_to_stderr(run, floor, monkeypatch):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    code, _, err = run("build", floor, "--out", "a")
    assert code == 0 and "graph: 5 of 5 steps" in err and "segment maps: 6 of 6 edges" in err


@pytest.mark.long_run
def test_an_atlas_of_the_package_is_drawn_over_its_map_by_name(run, tmp_path):
    code, out, _ = run("show", "glass_bridge", "--out", "bridge.png")
    assert (code, out) == (0, "drawn to bridge.png\n")
    assert (tmp_path / "bridge.png").stat().st_size > 50000


def test_a_large_atlas_becomes_npz_and_replaces_the_other(run, floor, tmp_path, monkeypatch):
    assert run("build", floor, "--out", "a")[0] == 0
    monkeypatch.setattr("glass_nav.cli.atlas_build.NPZ_FROM_NODES", 6)
    code, out, _ = run("build", floor, "--out", "a")
    assert code == 0 and "written to a/atlas.npz" in out
    assert [path.name for path in (tmp_path / "a").iterdir()] == ["atlas.npz"]
    assert len(atlas_file.load(tmp_path / "a").nodes) == 6


def test_statistics_of_robots_are_not_lost_by_mistake(run, floor, tmp_path):
    assert run("build", floor, "--out", "a")[0] == 0
    atlas = atlas_file.load(tmp_path / "a")
    atlas.visits.add_nodes(np.array([1]), np.array([1.0]))
    atlas_file.save(atlas, tmp_path / "a" / "atlas.json")
    code, out, err = run("build", floor, "--out", "a")
    assert (code, out) == (3, "")
    assert err == "glass_nav atlas: a/atlas.json: 1 visits of robots would be lost; give another --out, or --force\n"
    assert atlas_file.load(tmp_path / "a").visits.node_count.sum() == 1
    assert run("build", floor, "--out", "a", "--force")[0] == 0
    assert atlas_file.load(tmp_path / "a").visits.node_count.sum() == 0


def test_bad_input_is_one_line_and_exit_code_3(run, floor, tmp_path):
    solid = tmp_path / "solid.yaml"
    map_file.save(GridMap(np.full((40, 40), 100, np.int8), CELL_M, np.zeros(3)), solid)
    assert run("build", floor, "--out", "a")[0] == 0
    for words, text in (
        (["build", tmp_path / "no.yaml", "--out", "b"], "no.yaml: cannot be read: No such file or directory"),
        (["build", solid, "--out", "b"], "no path of 2 m in this map for a robot of 0.22 m radius"),
        (["show", tmp_path / "b"], "b: no such file, nor an atlas of the package, which are "),
        (["show", tmp_path / "a", "--edge", 5], "a/atlas.json: --edge must be 0 to 4, got 5"),
        (
            ["show", tmp_path / "a", "--map", solid],
            "solid.yaml: the atlas a was made from another map than this: from floor",
        ),
    ):
        code, out, err = run(*words)
        assert (code, out) == (3, ""), words
        assert err.startswith(f"glass_nav atlas: {text}") and err.count("\n") == 1, err
    assert not (tmp_path / "b").exists()


@pytest.mark.parametrize(
    "words, text",
    [
        (["build", "m.yaml", "--out", "b", "--robot-radius", "0"], "build: --robot-radius must be > 0 m, got 0.0"),
        (
            ["build", "m.yaml", "--out", "b", "--leaf-share", "-1"],
            "build: --leaf-share must be finite and >= 0, got -1.0",
        ),
        (
            ["build", "m.yaml", "--out", "b", "--field-of-view", "0"],
            "build: --field-of-view must be > 0 and <= 360, got 0.0",
        ),
        (["show", "a", "--edge", "-1"], "show: --edge must be >= 0, got -1"),
    ],
)
def test_wrong_options_are_refused_before_anything_is_read(run, words, text):
    code, out, err = run(*words)
    assert (code, out, err) == (2, "", f"glass_nav atlas: {text}\n")


@pytest.mark.long_run
def test_an_atlas_without_lines_or_with_very_many_nodes_can_be_drawn(run, tmp_path, monkeypatch):
    """Edges without a polyline are drawn straight; beyond a number of nodes they carry no numbers."""
    atlas = atlas_file.load(REPO / "atlas" / "glass_bridge")
    bare = replace(
        atlas,
        name="bare",
        edges=replace(atlas.edges, polyline_m=type(atlas.edges.polyline_m).empty(len(atlas.edges), 2)),
    )
    atlas_file.save(bare, tmp_path / "bare.json")
    monkeypatch.setattr("glass_nav.evaluation.plots.atlas_picture.MAX_NUMBERS", 10)
    assert run("show", tmp_path / "bare.json")[0] == 0
    assert size_px(tmp_path / "bare.png")[0] > 800
