from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from glass_nav.simulation import building_file
from glass_nav.simulation.building import MATERIALS
from glass_nav.simulation.building_file import BuildingError

WALLS = "walls:\n  - {line: [[0, 0], [4, 0], [4, 3], [0, 3], [0, 0]]}\n"
PATHS = "paths:\n  across: [[1, 1], [3, 1]]\n"


@pytest.fixture
def load(tmp_path):
    """load(text): the Building in maps/lab/building.yaml of a text."""

    def load_text(text):
        path = tmp_path / "lab" / "building.yaml"
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)
        return building_file.load(path)

    return load_text


@pytest.fixture
def error(load, tmp_path):
    """error(text): the one line that refuses it, without the folder."""

    def error_of(text):
        with pytest.raises(BuildingError) as caught:
            load(text)
        line = str(caught.value)
        assert "\n" not in line
        assert line.startswith(f"{tmp_path}/lab/building.yaml: ")
        return line[len(f"{tmp_path}/lab/building.yaml: ") :]

    return error_of


def test_everything_that_can_be_said_is_read(load, tmp_path):
    building = load("""
walls:
  - {line: [[0, 0], [9, 0], [9, 6]], thickness: 0.3, reflectance: 0.8}
panes:
  - {line: [[1, 2], [5, 2]], thickness: 0.01, coating: 3, dirt: 0.002}
  - {line: [[1, 3], [5, 3]], glazing: double, gap: 0.03}
mirrors:
  - {line: [[6, 1], [6, 2]], reflectance: 0.95}
doors:
  - {line: [[7, 2], [8, 2]], mapped: open, now: closed, thickness: 0.04, reflectance: wood}
mullions:
  - {line: [[1, 2], [5, 2]], every: 1.9, size: 0.1}
  - {points: [[1, 3], [5, 3]], yaw_deg: 90}
furniture:
  - {box: [2, 4, 1.6, 0.8], yaw_deg: 90, reflectance: black}
  - {outline: [[6, 4], [7, 4], [7, 5]], movable: false}
unmapped:
  - {box: [3, 5, 0.5, 0.5]}
gone:
  - {box: [8, 5, 0.5, 0.5]}
people:
  - {waypoints: [[1, 1], [5, 1], [8, 1]], speed: 1.5, radius: 0.3}
seen: [[2, 2.5], [2, 5]]
paths:
  along: [[1, 1], [8, 1]]
  back: [[8, 1], [1, 1]]
start: [1, 1, 90]
""")
    assert building.name == "lab"
    assert building.walls[0].line_m.tolist() == [[0, 0], [9, 0], [9, 6]]
    assert (building.walls[0].thickness_m, building.walls[0].reflectance) == (0.3, 0.8)
    assert (building.panes[0].thickness_m, building.panes[0].coating, building.panes[0].dirt) == (0.01, 3.0, 0.002)
    assert (building.panes[1].glazing, building.panes[1].gap_m) == ("double", 0.03)
    assert building.mirrors[0].reflectance == 0.95
    door = building.doors[0]
    assert (door.mapped, door.now, door.thickness_m, door.reflectance) == ("open", "closed", 0.04, MATERIALS["wood"])
    table, corner, new, gone, *posts = building.things
    assert table.outline_m.min(axis=0) == pytest.approx([1.6, 3.2])
    assert table.reflectance == MATERIALS["black"]
    assert [(t.mapped, t.present, t.movable) for t in (table, corner, new, gone)] == [
        (True, True, True),
        (True, True, False),
        (False, True, False),
        (True, False, False),
    ]
    assert [post.outline_m.mean(axis=0).tolist() for post in posts] == [
        pytest.approx(at) for at in ([1, 2], [3, 2], [5, 2], [1, 3], [5, 3])
    ]  # 4 m hold two fields of about 1.9 m
    assert posts[0].outline_m.max() - 5.0 < 0.05 + 1e-9 and posts[0].reflectance == MATERIALS["metal"]
    assert building.people[0].speed_m_s == 1.5 and building.people[0].radius_m == 0.3
    assert building.seen_m.tolist() == [[2, 2.5], [2, 5]]
    assert list(building.paths) == ["along", "back"]
    assert building.start == pytest.approx([1, 1, np.pi / 2])
    assert len(building_file.load(tmp_path / "lab").walls) == 1  # the folder will do


def test_the_whole_building_may_be_placed_and_turned(load):
    building = load(
        "placed: [10, 20, 90]\nstart: [1, 0, 10]\n"
        + WALLS
        + PATHS
        + """
furniture:
  - {box: [2, 1, 1, 0.4]}
mullions:
  - {points: [[3, 0]]}
seen: [[2, 2]]
"""
    )
    np.testing.assert_allclose(building.walls[0].line_m[1], [10, 24], atol=1e-12)
    np.testing.assert_allclose(building.paths["across"], [[9, 21], [9, 23]])
    np.testing.assert_allclose(building.seen_m, [[8, 22]])
    np.testing.assert_allclose(building.start, [10, 21, np.deg2rad(100)], atol=1e-12)
    box, post = building.things
    np.testing.assert_allclose(np.ptp(box.outline_m, axis=0), [0.4, 1.0])
    np.testing.assert_allclose(post.outline_m.mean(axis=0), [10, 23])


def test_without_a_start_the_robot_stands_at_the_first_path_and_looks_along_it(load):
    assert load(WALLS + "paths:\n  up: [[1, 1], [1, 2], [3, 2]]\n").start == pytest.approx([1, 1, np.pi / 2])


def test_tags_hang_in_the_building_wherever_it_is_placed(load):
    building = load(
        "placed: [10, 20, 90]\n"
        + WALLS
        + PATHS
        + """tags:
  - {id: A, position: [1, 2], facing_deg: 135}
  - {id: 8, position: [3, 0], range: 5}
"""
    )
    assert building.tags.ids == ("A", "8")
    np.testing.assert_allclose(building.tags.positions_m, [[8, 21], [10, 23]], atol=1e-12)
    np.testing.assert_allclose(np.degrees(building.tags.facing_rad), [-135, np.nan])
    assert building.tags.range_m.tolist() == [15.0, 5.0]
    assert len(load(WALLS + PATHS).tags) == 0


def test_a_start_alone_will_do(load):
    building = load(WALLS + "start: [1, 1, 0]\nfurniture:\n")
    assert building.paths == {} and building.things == ()


POINTS = "two points one after the other are the same"


@pytest.mark.parametrize(
    "text, line",
    [
        ("", "is empty; a building needs walls, and a path or a start"),
        ("# nothing yet\n", "is empty; a building needs walls, and a path or a start"),
        ("- 1\n", f"is no building: expected the keys {', '.join(building_file.SECTIONS)}"),
        ("walls: []\n", "has no walls; a building needs at least one"),
        (PATHS, "has no walls; a building needs at least one"),
        (WALLS, "has no paths and no start; a building needs one of them"),
        (WALLS + "wals: []\n", "unknown key 'wals'; did you mean walls?"),
        (WALLS + "7: []\n", f"unknown key 7; known are {', '.join(building_file.SECTIONS)}"),
        (WALLS + "panes: 3\n", "panes must be a list, got 3"),
        (WALLS + "panes: [3]\n", "pane 1 must have keys of line, thickness, coating, glazing, gap, dirt, got 3"),
        (
            WALLS + "panes: [{line: [[0, 0], [1, 0]]}, {line: [[0, 0], [1, 1]]}, {line: [[1, 1]]}]\n",
            "pane 3 has 1 point, a pane needs 2",
        ),
        (WALLS + "panes: [{line: []}]\n", "pane 1 has 0 points, a pane needs 2"),
        (WALLS + "panes: [{thickness: 0.01}]\n", "pane 1 has no line"),
        (WALLS + "panes: [{line: [[1, 1], [1, 1]]}]\n", f"pane 1 has no length at [1.0, 1.0]: {POINTS}"),
        (
            WALLS + "panes: [{line: [[1, 1], [.nan, 1]]}]\n",
            "pane 1 has the point [nan, 1.0], coordinates must be finite",
        ),
        (WALLS + "panes: [{line: [[1, 1], [2, '1']]}]\n", "pane 1 has the point [2, '1'], a point is [x, y] in m"),
        (WALLS + "panes: [{line: [[1, 1], 2]}]\n", "pane 1 has the point 2, a point is [x, y] in m"),
        (WALLS + "panes: [{line: [[1, 1], [1, 2, 3]]}]\n", "pane 1 has the point [1, 2, 3], a point is [x, y] in m"),
        (WALLS + "panes: [{line: 5}]\n", "pane 1 line must be a list of points [x, y], got 5"),
        (
            WALLS + "panes: [{line: [[0, 0], [1, 0]], thicknes: 1}]\n",
            "pane 1 has unknown key 'thicknes'; did you mean thickness?",
        ),
        (WALLS + "panes: [{line: [[0, 0], [1, 0]], thickness: 0}]\n", "pane 1 thickness must be > 0 m, got 0.0"),
        (
            WALLS + "panes: [{line: [[0, 0], [1, 0]], thickness: thin}]\n",
            "pane 1 thickness must be a finite number, got 'thin'",
        ),
        (
            WALLS + "panes: [{line: [[0, 0], [1, 0]], coating: .inf}]\n",
            "pane 1 coating must be a finite number, got inf",
        ),
        (
            WALLS + "panes: [{line: [[0, 0], [1, 0]], glazing: tripel}]\n",
            "pane 1 glazing must be single or double, got 'tripel'",
        ),
        (
            WALLS + "panes: [{line: [[0, 0], [1, 0]], glazing: double, gap: 0.2}]\n",
            "pane 1 gap must be > 0 and < 0.1 m (else they are two panes), got 0.2",
        ),
        (
            "walls: [{line: [[0, 0], [1, 0]], reflectance: brick}]\n",
            f"wall 1 reflectance must be a number or one of {', '.join(MATERIALS)}, got 'brick'",
        ),
        ("walls: [{line: [[0, 0], [1, 0]], reflectance: 3}]\n", "wall 1 reflectance must be > 0 and <= 1, got 3.0"),
        ("walls: [{line: [[0, 0]]}]\n", "wall 1 has 1 point, a wall needs at least 2"),
        (WALLS + "doors: [{line: [[0, 0], [1, 0]], now: ajar}]\n", "door 1 now must be open or closed, got 'ajar'"),
        (WALLS + "mirrors: [{line: [[0, 0], [1, 0], [2, 0]]}]\n", "mirror 1 has 3 points, a mirror needs 2"),
        (
            WALLS + "furniture: [{yaw_deg: 3}]\n",
            "furniture 1 needs either box: [x, y, length, width] or outline: [[x, y], ...]",
        ),
        (
            WALLS + "furniture: [{outline: [[0, 0], [1, 0], [1, 1]], yaw_deg: 3}]\n",
            "furniture 1 yaw_deg goes with a box only",
        ),
        (WALLS + "furniture: [{outline: [[0, 0], [1, 0]]}]\n", "furniture 1 has 2 points, a thing needs at least 3"),
        (WALLS + "furniture: [{outline: [[0, 0], [1, 0], [2, 0]]}]\n", "furniture 1 has no area"),
        (
            WALLS + "furniture: [{box: [1, 1, 2]}]\n",
            "furniture 1 box must be [x, y, length, width] in m, got [1, 1, 2]",
        ),
        (
            WALLS + "furniture: [{box: [1, 1, 2, 0]}]\n",
            "furniture 1 box must have length and width > 0 m, got [1, 1, 2, 0]",
        ),
        (WALLS + "unmapped: [{box: [1, 1, 2, x]}]\n", "unmapped 1 box must be a finite number, got 'x'"),
        (WALLS + "furniture: [{box: [1, 1, 2, 1], movable: 1}]\n", "furniture 1 movable must be true or false, got 1"),
        (
            WALLS + "gone: [{box: [1, 1, 2, 1], movable: true}]\n",
            "gone 1 has unknown key 'movable'; known are box, yaw_deg, outline, reflectance",
        ),
        (WALLS + "mullions: [{line: [[0, 0], [1, 0]], every: 0}]\n", "mullion 1 every must be > 0 m, got 0.0"),
        (WALLS + "mullions: [{line: [[0, 0]]}]\n", "mullion 1 has 1 point, a mullion needs 2"),
        (
            WALLS + "mullions: [{every: 1}]\n",
            "mullion 1 needs either line: [[x, y], [x, y]] with every, or points: [[x, y], ...]",
        ),
        (WALLS + "people: [{waypoints: [[0, 0], [1, 0]], speed: -1}]\n", "person 1 speed must be > 0 m/s, got -1.0"),
        (WALLS + "people: [{waypoints: [[0, 0]]}]\n", "person 1 has 1 point, a person needs at least 2"),
        (WALLS + "paths: [[0, 0], [1, 0]]\n", "paths must be name: [[x, y], ...], got [[0, 0], [1, 0]]"),
        (WALLS + "paths:\n  short: [[0, 0]]\n", "path short has 1 point, a path needs at least 2"),
        (WALLS + "paths:\n  still: [[1, 0], [1, 0]]\n", f"path still has no length at [1.0, 0.0]: {POINTS}"),
        (WALLS + "paths:\n  odd: [[0, 0], [1, true]]\n", "path odd has the point [1, True], a point is [x, y] in m"),
        (WALLS + PATHS + "tags: 3\n", "tags must be a list, got 3"),
        (WALLS + PATHS + "tags: [{id: A}]\n", "tags: landmark 1 (A) position must be [x, y] in m, got None"),
        (WALLS + "start: [1, 2]\n", "start must be [x, y, yaw_deg] in m, m, degrees, got [1, 2]"),
        (WALLS + "start: [1, 2, east]\n", "start must be a finite number, got 'east'"),
        (WALLS + PATHS + "placed: 3\n", "placed must be [x, y, yaw_deg] in m, m, degrees, got 3"),
        (WALLS + PATHS + "seen: [[1, .inf]]\n", "seen has the point [1.0, inf], coordinates must be finite"),
    ],
)
def test_what_cannot_be_meant_is_refused_in_one_line(error, text, line):
    assert error(text) == line


def test_a_file_that_is_no_yaml_or_is_not_there_is_refused(error, load, tmp_path):
    assert error("walls: [\n").startswith("is not yaml: ")
    (tmp_path / "lab" / "building.yaml").write_bytes(b"\xff\xfe")
    with pytest.raises(BuildingError, match="building.yaml: cannot be read: 'utf-8' codec"):
        building_file.load(tmp_path / "lab")
    absent = Path(tmp_path / "absent.yaml")
    with pytest.raises(BuildingError, match=f"^{absent}: cannot be read: No such file or directory$"):
        building_file.load(str(absent))
