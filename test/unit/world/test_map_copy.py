"""A map file with more cells occupied: everything else is the file's own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image

from glass_nav.world import map_copy, map_file
from glass_nav.world.map_file import MapError

GREYS = np.array([[0, 100, 180, 205], [230, 254, 255, 254], [254, 10, 205, 254]], np.uint8)


def written(folder: Path, pixels: np.ndarray, suffix: str = ".png", **fields: object) -> Path:
    """A map file, with the occupied corner of a 3 x 4 image at its top left."""
    Image.fromarray(pixels).save(folder / f"floor{suffix}")
    values = {
        "image": f"floor{suffix}",
        "resolution": 0.05,
        "origin": [1.5, -2.0, 0.3],
        "negate": 0,
        "occupied_thresh": 0.7,
        "free_thresh": 0.15,
        **fields,
    }
    (folder / "floor.yaml").write_text(yaml.safe_dump(values))
    return folder / "floor.yaml"


@pytest.mark.parametrize("mode", ["trinary", "scale", "raw"])
@pytest.mark.parametrize("negate", [0, 1])
@pytest.mark.parametrize("channels", [1, 3, 4])
def test_only_the_added_cells_change(mode: str, negate: int, channels: int, tmp_path: Path) -> None:
    pixels = GREYS if channels == 1 else np.repeat(GREYS[..., None], channels, axis=-1)
    source = written(tmp_path, pixels, mode=mode, negate=negate)
    before = map_file.load(source)
    occupancy = before.occupancy.copy()
    occupancy[1, :3] = 100
    (tmp_path / "out").mkdir()
    path, image = map_copy.save(source, replace(before, occupancy=occupancy), tmp_path / "out" / "map.yaml")
    after = map_file.load(path)
    np.testing.assert_array_equal(after.occupancy, occupancy)
    assert after.place == before.place
    ours, theirs = (yaml.safe_load(each.read_text()) for each in (path, source))
    assert {**ours, "image": None} == {**theirs, "image": None}
    unchanged = (occupancy == before.occupancy)[::-1]
    np.testing.assert_array_equal(np.asarray(Image.open(image))[unchanged], pixels[unchanged])


@pytest.mark.parametrize("suffix, expected", [(".pgm", ".pgm"), (".bmp", ".png")])
def test_the_image_stays_lossless(suffix: str, expected: str, tmp_path: Path) -> None:
    source = written(tmp_path, GREYS, suffix)
    (tmp_path / "out").mkdir()
    _, image = map_copy.save(source, map_file.load(source), tmp_path / "out" / "map.yaml")
    assert image.name == f"map{expected}"


def test_the_map_is_not_overwritten(tmp_path: Path) -> None:
    source = written(tmp_path, GREYS)
    for path in (source, tmp_path / "floor.png"):
        with pytest.raises(MapError, match="is the map itself; choose another folder"):
            map_copy.check_other(path, source)
    with pytest.raises(MapError, match="is the map itself"):
        map_copy.save(source, map_file.load(source), source)


def test_a_map_that_cannot_be_edited_is_reported(tmp_path: Path) -> None:
    source = written(tmp_path, GREYS)
    before = map_file.load(source)
    fewer = np.where(before.occupancy == 100, 0, before.occupancy).astype(np.int8)
    (tmp_path / "out").mkdir()
    with pytest.raises(MapError, match="does not give the map back"):
        map_copy.save(source, replace(before, occupancy=fewer), tmp_path / "out" / "map.yaml")


def test_an_mrpt_map_becomes_a_map_server_map(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    grid_map = map_file.load(written(tmp_path, np.full((3, 4), 254, np.uint8)))
    monkeypatch.setattr(map_file, "load", lambda path: grid_map)
    path, image = map_copy.save(tmp_path / "floor.gridmap", grid_map, tmp_path / "map.yaml")
    assert path.is_file()
    assert image.is_file()
    map_copy.check_other(tmp_path / "new.yaml", tmp_path / "floor.gridmap")
