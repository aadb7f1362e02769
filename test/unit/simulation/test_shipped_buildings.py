from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from glass_nav import package_files
from glass_nav.simulation import building_file, building_map, shipped_buildings
from glass_nav.simulation.building_file import BuildingError
from glass_nav.simulation.path_follower import PathFollower
from glass_nav.simulation.robot import Obstacles, Robot, RobotParams
from glass_nav.world import landmark_file

REPO = Path(__file__).resolve().parents[3]


def test_the_buildings_of_the_package_are_found_by_name():
    assert "glass_office" in shipped_buildings.shipped()
    path = shipped_buildings.find("glass_office")
    assert path.resolve() == REPO / "maps" / "glass_office" / "building.yaml"
    assert building_file.load(path).name == "glass_office"


def test_files_and_folders_are_found_as_such(tmp_path):
    (tmp_path / "mine").mkdir()
    path = tmp_path / "mine" / "building.yaml"
    path.write_text("walls: []\n")
    assert shipped_buildings.find(str(path)) == path
    assert shipped_buildings.find(str(tmp_path / "mine")) == path


def test_a_folder_here_does_not_hide_a_building_of_the_package(tmp_path, monkeypatch):
    (tmp_path / "glass_office").mkdir()
    monkeypatch.chdir(tmp_path)
    assert shipped_buildings.find("glass_office").resolve() == REPO / "maps" / "glass_office" / "building.yaml"


def test_what_is_not_there_is_said_with_what_is(tmp_path):
    known = ", ".join(shipped_buildings.shipped())
    with pytest.raises(BuildingError) as caught:
        shipped_buildings.find("glas_office")
    assert str(caught.value) == (
        f"glas_office: no such file, nor a building of the package, which are {known}; did you mean glass_office?"
    )
    with pytest.raises(BuildingError, match=f"^{tmp_path}: a folder without building.yaml$"):
        shipped_buildings.find(str(tmp_path))


def test_without_any_the_list_is_empty(monkeypatch):
    monkeypatch.setattr(package_files, "folder", lambda name: None)
    assert shipped_buildings.shipped() == {}
    with pytest.raises(BuildingError, match="^office: no such file, nor a building of the package, which are none$"):
        shipped_buildings.find("office")


@pytest.mark.long_run
@pytest.mark.parametrize(
    "name, kind", [*((name, "diff") for name in shipped_buildings.shipped()), ("glass_office", "omni")]
)
def test_every_path_can_be_driven_also_when_all_furniture_has_moved(name, kind):
    building = building_file.load(shipped_buildings.find(name)).changed(1.0, np.random.default_rng(1))
    assert building.paths
    surfaces, params, step_s = building.surfaces, RobotParams(kind), 0.1
    obstacles = Obstacles(np.stack([surfaces.from_m, surfaces.to_m], axis=1)[surfaces.present])
    for path, waypoints in building.paths.items():
        follower = PathFollower(waypoints, params)
        robot = Robot(params, follower.start, obstacles)
        for _ in range(round((60.0 + 4.0 * follower.length_m) / step_s)):
            robot.step(follower.command(robot.map_from_base), step_s)
            assert not robot.blocked, f"{path}: blocked at {robot.map_from_base} after {follower.progress_m:.1f} m"
            if follower.done:
                break
        assert follower.done, f"{path}: at {robot.map_from_base} after {follower.progress_m:.1f} m"


@pytest.mark.parametrize("name", shipped_buildings.shipped())
def test_the_landmark_file_beside_a_building_is_that_of_its_tags(name):
    building = building_file.load(shipped_buildings.find(name))
    path = REPO / "maps" / name / building_map.LANDMARKS_NAME
    assert path.is_file() == bool(len(building.tags))
    if path.is_file():
        landmarks = landmark_file.load(path)
        assert landmarks.ids == building.tags.ids
        for field in ("positions_m", "facing_rad", "view_rad", "range_m"):
            np.testing.assert_allclose(getattr(landmarks, field), getattr(building.tags, field), atol=1e-8)


def test_redrawing_a_building_writes_its_landmarks_too(tmp_path):
    (tmp_path / "building.yaml").write_text(
        "walls: [{line: [[0, 0], [4, 0], [4, 3], [0, 3], [0, 0]]}]\n"
        "start: [1, 1, 0]\ntags: [{id: A, position: [0.2, 1]}]\n"
    )
    building_map.redraw(tmp_path)
    assert landmark_file.load(tmp_path / "landmarks.yaml").ids == ("A",)
    assert (tmp_path / "map.yaml").is_file()
