"""glass_nav map as a user calls it: the missing panes of a small building found and drawn; and what it refuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import yaml
from PIL import Image

from glass_nav.localization.integrity import pose_state
from glass_nav.world import map_file, panes_file

CORRIDOR = """
walls:
  - line: [[0, 0], [9, 0], [9, 6], [0, 6], [0, 0]]
  - line: [[0, 2.2], [2, 2.2]]
  - line: [[6, 2.2], [9, 2.2]]
panes:
  - line: [[2.05, 2.2], [5.95, 2.2]]
furniture:
  - {box: [3.0, 4.5, 0.8, 0.5]}
paths:
  out: [[1.0, 1.0], [7.5, 1.2]]
seen: [[4.0, 4.0]]
start: [1.0, 1.0, 0.0]
"""
PANE_M = 3.9


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """A bag, its map without the pane (run.map.yaml) and with it (run.complete.map.yaml)."""
    from glass_nav.cli import main as cli

    folder = tmp_path_factory.mktemp("corridor")
    (folder / "building.yaml").write_text(CORRIDOR)
    bag = folder / "run.bag"
    options = ["--glass-erased", "1", "--rate", "5", "--beams", "271", "--out", str(bag)]
    assert cli.main(["simulate", str(folder / "building.yaml"), *options]) == 0
    return bag


@pytest.fixture
def floor(tmp_path):
    """A map of 5 x 5 m around the origin, empty."""
    (tmp_path / "floor.yaml").write_text(
        "image: floor.pgm\nresolution: 0.05\norigin: [-2.5, -2.5, 0]\nnegate: 0\n"
        "occupied_thresh: 0.7\nfree_thresh: 0.2\n"
    )
    Image.fromarray(np.full((100, 100), 254, np.uint8)).save(tmp_path / "floor.pgm")
    return tmp_path / "floor.yaml"


@pytest.mark.long_run
def test_the_missing_pane_is_found_and_drawn(run, drive, tmp_path):
    lacking, complete = drive.with_suffix(".map.yaml"), drive.with_suffix(".complete.map.yaml")
    code, out, err = run("map", "panes", drive, "--map", lacking, "--every", "2", "--out", tmp_path / "found")
    assert code == 0
    assert {path.name for path in (tmp_path / "found").iterdir()} == {
        "map.yaml",
        "map.png",
        "panes.yaml",
        "panes.png",
    }
    before, after = map_file.load(lacking), map_file.load(tmp_path / "found" / "map.yaml")
    (pane,) = panes_file.load(tmp_path / "found" / "panes.yaml", before).panes
    assert pane.length_m == pytest.approx(PANE_M, abs=0.3)
    assert pane.probability > 0.9
    assert f"1 pane drawn, {pane.length_m:.1f} m of glass that the map lacks" in out
    wanted = map_file.load(complete).occupied & ~before.occupied
    assert np.count_nonzero(after.occupied & wanted) > 0.8 * np.count_nonzero(wanted)


@pytest.mark.long_run
def test_with_a_ground_truth_panes_are_found_where_the_filter_is_not_sure(run, drive, tmp_path, never_sure):
    lacking = drive.with_suffix(".map.yaml")
    code, out, _ = run("map", "panes", drive, "--map", lacking, "--every", "2", "--out", tmp_path / "found")
    assert code == 0
    assert "1 pane drawn" in out


def test_the_complete_map_gets_no_pane_twice(run, drive, tmp_path):
    complete = drive.with_suffix(".complete.map.yaml")
    code, out, _ = run("map", "panes", drive, "--map", complete, "--every", "3", "--out", tmp_path / "found")
    assert code == 0
    assert "no pane found that the map lacks" in out
    before, after = map_file.load(complete), map_file.load(tmp_path / "found" / "map.yaml")
    np.testing.assert_array_equal(after.occupancy, before.occupancy)


@pytest.mark.long_run
def test_panes_are_chosen_by_number(run, drive, tmp_path):
    lacking = drive.with_suffix(".map.yaml")
    code, out, _ = run(
        "map", "panes", drive, "--map", lacking, "--drop", "1", "--every", "3", "--out", tmp_path / "found"
    )
    assert code == 0
    assert "  not drawn" in out
    assert yaml.safe_load((tmp_path / "found" / "panes.yaml").read_text())["panes"] == []
    code, _, err = run("map", "panes", drive, "--map", lacking, "--keep", "7", "--max-scans", "5", "--out", tmp_path)
    assert code == 3
    assert "there is no pane 7: 0 were found" in err


@pytest.fixture
def never_sure(monkeypatch):
    """The filter is UNCERTAIN at every scan."""
    judge = pose_state.PoseQuality.judge

    def unsure(self, *arguments, **options):
        return replace(judge(self, *arguments, **options), state=pose_state.LocalizationState.UNCERTAIN)

    monkeypatch.setattr(pose_state.PoseQuality, "judge", unsure)


def test_a_log_without_a_usable_pose_draws_nothing(run, drive, tmp_path, never_sure):
    lacking = drive.with_suffix(".map.yaml")
    options = ["--ground-truth", "none", "--initial-pose", 1, 1, 0, "--max-scans", "5"]
    code, _, err = run("map", "panes", drive, "--map", lacking, *options, "--out", tmp_path / "found")
    assert code == 3
    assert "in none of 5 scans was the pose certain enough (LOCALIZED) to learn about the map; nothing is drawn" in err
    assert list((tmp_path / "found").iterdir()) == []


def test_panes_by_hand_and_of_a_file_are_drawn(run, floor, tmp_path):
    code, out, _ = run("map", "draw", floor, "--pane", 0, 0, 1, 0, "--pane", 1, 0, 1, 2, "--out", tmp_path / "first")
    assert code == 0
    assert out.startswith("2 panes, 3.0 m; written: first/map.yaml, first/map.pgm, first/panes.yaml, first/panes.png")
    panes = tmp_path / "first" / "panes.yaml"
    code, out, _ = run("map", "draw", floor, "--panes", panes, "--pane", -1, 0, 0, 0, "--out", tmp_path / "second")
    assert code == 0
    assert out.startswith("3 panes, 4.0 m")
    for key in ("resolution", "origin", "occupied_thresh", "free_thresh", "negate"):
        first, second = (yaml.safe_load(path.read_text()) for path in (floor, tmp_path / "second" / "map.yaml"))
        assert first[key] == second[key]


@pytest.mark.long_run
@pytest.mark.parametrize("out, path", [("pictures", "pictures/floor.png"), ("mine.png", "mine.png")])
def test_a_map_is_shown_with_its_panes(run, floor, tmp_path, out, path):
    run("map", "draw", floor, "--pane", 0, 0, 1, 0, "--out", tmp_path / "drawn")
    panes = tmp_path / "drawn" / "panes.yaml"
    code, text, _ = run("map", "show", floor, "--panes", panes, "--out", tmp_path / out)
    assert (code, text) == (0, f"drawn to {path}\n")
    assert Image.open(tmp_path / path).width > 500


@pytest.mark.parametrize(
    "options, code, message",
    [
        (["--pane", 0, 0, 0, 0], 2, "--pane 0 0 0 0: a pane needs a length > 0 m"),
        (["--pane", 0, 0, "nan", 0], 2, "--pane 0 0 nan 0: a pane goes from x, y to x, y, all finite"),
        (["--pane", 0, 0, 9, 0], 3, "pane 1, from (0, 0) to (9, 0) m, lies outside the map"),
        ([], 2, "give --panes FILE or --pane X0 Y0 X1 Y1"),
        (["--panes", "none.yaml"], 3, "none.yaml: No such file or directory"),
    ],
)
def test_panes_that_cannot_be_drawn_are_refused(run, floor, tmp_path, options, code, message):
    given, _, err = run("map", "draw", floor, *options, "--out", tmp_path / "out")
    assert given == code
    assert message in err
    assert err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_panes_of_another_map_are_refused(run, floor, tmp_path):
    run("map", "draw", floor, "--pane", 0, 0, 1, 0, "--out", tmp_path / "first")
    code, _, err = run(
        "map", "draw", tmp_path / "first" / "map.yaml", "--panes", tmp_path / "first" / "panes.yaml", "--out", tmp_path
    )
    assert code == 3
    assert "first/panes.yaml: its panes are of another map: fingerprint" in err


def test_the_map_itself_is_not_overwritten(run, floor, tmp_path):
    own = tmp_path / "map.yaml"
    own.write_text(floor.read_text())
    before = {path.name: path.read_bytes() for path in (own, tmp_path / "floor.pgm")}
    code, _, err = run("map", "draw", own, "--pane", 0, 0, 1, 0, "--out", tmp_path)
    assert code == 3
    assert "map.yaml: is the map itself; choose another folder" in err
    assert {name: (tmp_path / name).read_bytes() for name in before} == before
    assert {path.name for path in tmp_path.iterdir()} == {"map.yaml", "floor.yaml", "floor.pgm"}


def test_a_read_only_map_is_only_read(run, floor, tmp_path):
    for path in (floor, tmp_path / "floor.pgm"):
        path.chmod(0o444)
    assert run("map", "draw", floor, "--pane", 0, 0, 1, 0, "--out", tmp_path / "out")[0] == 0


@pytest.mark.parametrize("command", ["panes", "draw"])
def test_a_folder_that_cannot_be_written_is_told_at_once(run, floor, tmp_path, command):
    (tmp_path / "file").write_text("in the way")
    options = ["no.bag", "--map", floor] if command == "panes" else [floor, "--pane", 0, 0, 1, 0]
    code, _, err = run("map", command, *options, "--out", tmp_path / "file" / "out")
    assert code == 3
    assert "file/out: Not a directory" in err


@pytest.mark.parametrize(
    "options, message",
    [
        (["--keep", "0"], "--keep must be whole numbers from 1 on, such as 1,3, got '0'"),
        (["--drop", "1,x"], "--drop must be whole numbers from 1 on, such as 1,3, got '1,x'"),
        (["--least-probability", "2"], "--least-probability must be in [0, 1], got 2.0"),
        (["--seed", "-1"], "--seed must be >= 0, got -1"),
    ],
)
def test_wrong_options_are_refused(run, floor, tmp_path, options, message):
    code, _, err = run("map", "panes", "no.bag", "--map", floor, "--out", tmp_path / "out", *options)
    assert (code, err) == (2, f"glass_nav map: panes: {message}\n")
