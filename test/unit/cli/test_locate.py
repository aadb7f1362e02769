"""glass_nav locate: a scan of a known room put on its walls, from files and from a log, and what cannot be."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from glass_nav.cli.main import main
from glass_nav.geometry import angles
from glass_nav.recording.log_file import open_log
from glass_nav.recording.recording import Refusal
from glass_nav.sensing.raycast import RayCaster
from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap

TRUE = np.array([2.3, 1.7, 0.4])
OFF = np.array([0.3, -0.25, np.radians(-7.0)])


@pytest.fixture
def room(tmp_path: Path) -> Path:
    """A room with a recess, a long hall, and a scan in the room, 0.05 m cells."""
    occupancy = np.zeros((80, 120), np.int8)
    occupancy[[0, -1]] = occupancy[:, [0, -1]] = 100
    occupancy[56:, 92:] = 100
    save(tmp_path / "map.yaml", occupancy)
    hall = np.zeros((40, 1600), np.int8)
    hall[[0, -1]] = 100
    save(tmp_path / "hall.yaml", hall)
    write_scan(tmp_path / "scan.csv", map_file.load(tmp_path / "map.yaml"), TRUE)
    return tmp_path


def save(path: Path, occupancy: np.ndarray) -> None:
    map_file.save(GridMap(occupancy, 0.05, np.zeros(3)), path)


def write_scan(path: Path, grid_map: GridMap, pose: np.ndarray) -> None:
    angles_rad = np.linspace(-np.pi, np.pi, 360, endpoint=False)
    ranges_m = RayCaster(grid_map).cast(pose[None], angles_rad, 12.0)[0] + 0.025
    path.write_text("angle,range\n" + "\n".join(f"{angle},{range_m}" for angle, range_m in zip(angles_rad, ranges_m)))


def locate(folder: Path, pose: np.ndarray, *options: str, grid: str = "map.yaml", scan: str = "scan.csv") -> int:
    return main(
        [
            "locate",
            "--map",
            str(folder / grid),
            "--scan",
            str(folder / scan),
            "--pose",
            *(str(value) for value in pose),
            "--out",
            str(folder / "out.png"),
            *options,
        ]
    )


def told(text: str) -> np.ndarray:
    words = next(line for line in text.splitlines() if line.startswith("pose ")).split()
    return np.array([float(words[words.index(name) + 1]) for name in ("x", "y", "yaw")])


@pytest.mark.parametrize("options", [(), ("--method", "document"), ("--iterations", "25")])
def test_a_rough_pose_is_corrected_and_drawn(room, capsys, options):
    assert locate(room, TRUE + OFF, *options) == 0
    out = capsys.readouterr().out
    left = told(out) - TRUE
    assert np.hypot(left[0], left[1]) < 0.03 and abs(angles.wrap(left[2])) < np.radians(0.5)
    assert "free      none: the walls constrain x, y and yaw" in out
    assert "360 beams, 360 returned" in out
    moved = float(out.split("moved ")[1].split()[0])
    assert moved == pytest.approx(np.hypot(*OFF[:2]), abs=0.03)
    with Image.open(room / "out.png") as image:
        assert image.size[0] > 600 and len(set(image.convert("RGB").getdata())) > 50


def test_in_a_hallway_it_says_which_way_is_not_corrected(room, capsys):
    true = np.array([40.0, 0.9, 0.1])
    write_scan(room / "hall.csv", map_file.load(room / "hall.yaml"), true)
    assert locate(room, true + [0.3, 0.2, 0.05], grid="hall.yaml", scan="hall.csv") == 0
    out = capsys.readouterr().out
    left = told(out) - true
    assert abs(left[1]) < 0.02 and abs(left[2]) < 0.01 and left[0] == pytest.approx(0.3, abs=0.01)
    assert "the direction 0 deg of the map: not corrected" in out or "the direction 180 deg" in out


@pytest.mark.long_run
def test_a_log_gives_the_scan_with_that_index(small_bag, capsys):
    log, grid, truth = small_bag
    for index in (0, 7):
        entry = [each for each in open_log(log) if not isinstance(each, Refusal)][index]
        true = truth.at(np.int64(entry.scan.stamp_ns))
        assert (
            main(
                [
                    "locate",
                    "--map",
                    str(grid),
                    "--scan",
                    str(log),
                    "--index",
                    str(index),
                    "--pose",
                    *(str(value) for value in true + OFF / 2.0),
                    "--out",
                    str(log.parent / "out.png"),
                ]
            )
            == 0
        )
        left = told(capsys.readouterr().out) - true
        assert np.hypot(left[0], left[1]) < 0.03 and abs(angles.wrap(left[2])) < np.radians(0.5)
    assert main(["locate", "--map", str(grid), "--scan", str(log), "--index", "9999", "--pose", "0", "0", "0"]) == 3
    assert "--index must be below " in capsys.readouterr().err


@pytest.fixture(scope="module")
def small_bag(tmp_path_factory):
    """A simulated robot among glass: the log, its map, and where it was."""
    folder = tmp_path_factory.mktemp("log")
    path, way = folder / "run.bag", folder / "way.csv"
    way.write_text("12.0,4.2\n13.0,4.2\n")  # in the corridor
    assert main(["simulate", "glass_office", "--path", str(way), "--out", str(path)]) == 0
    return path, folder / "run.map.yaml", open_log(path).ground_truth


@pytest.mark.long_run
def test_a_scan_of_another_place_is_refused_after_the_picture(room, capsys):
    assert locate(room, np.array([40.0, 0.9, 0.1]), grid="hall.yaml") == 3
    assert "glass_nav locate: the scan fits nowhere near the pose: " in capsys.readouterr().err
    assert (room / "out.png").exists()
    assert locate(room, TRUE + [30.0, 0.0, 0.0]) == 3
    assert "fits nowhere near the pose" in capsys.readouterr().err


def test_without_walls_or_answers_there_is_nothing_to_correct(room, capsys):
    save(room / "empty.yaml", np.zeros((80, 80), np.int8))
    assert locate(room, TRUE, grid="empty.yaml") == 3
    assert "no wall of the map is long enough for a segment" in capsys.readouterr().err
    (room / "blind.csv").write_text("0,nan\n0.1,inf\n")
    assert locate(room, TRUE, scan="blind.csv") == 3
    assert "no beam of the scan returned" in capsys.readouterr().err
    assert not (room / "out.png").exists()


def test_one_point_says_that_most_is_free(room, capsys):
    (room / "one.csv").write_text("3.14,2.325\n")  # straight behind
    assert locate(room, np.array([2.3, 1.7, 0.0]), scan="one.csv") == 0
    assert "free      2 of 3 directions, of " in capsys.readouterr().out


@pytest.mark.parametrize(
    "options, line",
    [
        (("--index", "3"), "--index is for logs, "),
        (("--index", "-1"), "--index must be >= 0, got -1"),
        (("--iterations", "0"), "--iterations must be >= 1, got 0"),
        (("--laser-pose", "0", "nan", "0"), "--laser-pose must be finite, got 0 nan 0"),
        (("--method", "icp"), "invalid choice: 'icp'"),
    ],
)
def test_wrong_options_are_told_before_any_file_is_opened(room, capsys, options, line):
    shutil.rmtree(room)
    assert locate(room, TRUE, *options) == 2
    assert line in capsys.readouterr().err


def test_files_that_are_not_there_are_reported(room, capsys):
    assert locate(room, TRUE, scan="none.csv") == 3
    assert "none.csv" in capsys.readouterr().err
    assert locate(room, TRUE, grid="none.yaml") == 3
    assert "none.yaml" in capsys.readouterr().err
