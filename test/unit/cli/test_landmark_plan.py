"""glass_nav landmarks plan, on a room and on a building of the package."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from glass_nav.cli.main import main
from glass_nav.world import landmark_file, map_file
from glass_nav.world.grid_map import GridMap

TAGS = """landmarks:
  - {id: A, position: [0.1, 1.0], facing_deg: 0}
  - {id: B, position: [3.0, 4.9], facing_deg: -90}
  - {id: new1, position: [7.9, 2.0], facing_deg: 180}
"""


@pytest.fixture
def room(tmp_path: Path) -> Path:
    occupancy = np.zeros((50, 80), np.int8)
    occupancy[[0, -1]] = occupancy[:, [0, -1]] = 100
    occupancy[:30, 40] = 100
    map_file.save(GridMap(occupancy, 0.1, np.zeros(3)), tmp_path / "map.yaml")
    (tmp_path / "tags.yaml").write_text(TAGS)
    return tmp_path


def plan(folder: Path, *options: str) -> int:
    return main(
        [
            "landmarks",
            "plan",
            str(folder / "map.yaml"),
            str(folder / "tags.yaml"),
            "--out",
            str(folder / "out"),
            *options,
        ]
    )


def test_a_plan_tells_what_there_is_and_what_one_more_tag_adds(room, capsys):
    assert plan(room) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].endswith("places, bearings in steps of 1 degrees")
    assert lines[1].startswith("3 landmarks: three or more in sight of ")
    assert lines[2].startswith("+ new2 at x ")  # new1 is taken
    again = landmark_file.load(room / "out" / "landmarks.yaml")
    assert again.ids == ("A", "B", "new1", "new2")
    assert f"x {again.positions_m[3, 0]:.2f} m, y {again.positions_m[3, 1]:.2f} m" in lines[2]
    with Image.open(room / "out" / "landmarks.png") as image:
        assert min(image.size) > 300


def test_a_plan_may_begin_with_nothing_and_may_add_nothing(room, capsys):
    (room / "tags.yaml").write_text("landmarks: []")
    assert plan(room, "--add", "0", "--spacing", "1") == 0
    assert "0 landmarks: three or more in sight of 0% of the places" in capsys.readouterr().out
    assert len(landmark_file.load(room / "out" / "landmarks.yaml")) == 0


@pytest.mark.long_run
def test_finer_steps_make_better_positions(room, capsys):
    def median(step: str) -> float:
        assert plan(room, "--add", "0", "--step-deg", step) == 0
        return float(capsys.readouterr().out.split("median sigma ")[1].split(" m")[0])

    assert median("0.5") < median("2")


def test_walls_that_proved_to_be_glass_hide_no_tag(room, capsys):
    def in_sight(*options: str) -> int:
        assert plan(room, "--add", "0", *options) == 0
        return int(capsys.readouterr().out.split("in sight of ")[1].split("%")[0])

    glass = np.full((50, 80), -1, np.int8)
    glass[:30, 40] = 80
    map_file.save(GridMap(glass, 0.1, np.zeros(3)), room / "glass.yaml")
    assert in_sight("--glass-map", str(room / "glass.yaml")) > in_sight()


def test_a_map_where_no_tag_can_hang_gets_no_suggestion(room, capsys):
    (room / "tags.yaml").write_text("landmarks: []")
    map_file.save(GridMap(np.zeros((20, 20), np.int8), 0.1, np.zeros(3)), room / "map.yaml")
    assert plan(room) == 0
    assert "no other place on a wall helps" in capsys.readouterr().out


@pytest.mark.parametrize(
    "options, text",
    [
        (["--add", "-1"], "glass_nav landmarks: plan: --add must be >= 0, got -1"),
        (["--step-deg", "0"], "glass_nav landmarks: plan: --step-deg must be > 0 and <= 45 degrees, got 0.0"),
        (["--spacing", "0"], "glass_nav landmarks: plan: --spacing must be >= 0.05 m, got 0.0"),
    ],
)
def test_wrong_options_are_told_before_any_file_is_read(tmp_path, capsys, options, text):
    assert plan(tmp_path, *options) == 2
    assert capsys.readouterr().err.strip() == text


def test_a_landmark_outside_the_map_and_a_glass_map_of_another_map_are_refused(room, capsys):
    map_file.save(GridMap(np.zeros((5, 5), np.int8), 0.1, np.zeros(3)), room / "glass.yaml")
    assert plan(room, "--glass-map", str(room / "glass.yaml")) == 3
    assert "a glass map must have the cells of the map, (50, 80), got (5, 5)" in capsys.readouterr().err
    (room / "tags.yaml").write_text("landmarks: [{id: far, position: [99, 0]}]")
    assert plan(room) == 3
    assert "landmark 'far' at x 99 m, y 0 m lies outside the map" in capsys.readouterr().err
    (room / "tags.yaml").write_text("nothing: 1")
    assert plan(room) == 3
    assert "is no landmark file" in capsys.readouterr().err
