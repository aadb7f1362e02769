"""The atlas of a session: read or built, held against the served map, saved with its visits."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path
from typing import Tuple

import numpy as np
import pytest

from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.topology.atlas.atlas import Atlas, AtlasError
from glass_nav.topology.atlas_source import AtlasSource
from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap

MAPS = Path(__file__).parents[3] / "maps"


def read() -> Tuple[str, Atlas]:
    return "wedge.json", atlas_file.load(shipped_atlases.find("glass_wedge"))


def served(name: str) -> GridMap:
    return map_file.load(MAPS / name / "map.yaml")


def test_an_atlas_is_loaded_before_a_map_is_served() -> None:
    source = AtlasSource(read)
    assert (source.has_atlas, source.builds, source.map_name) == (True, False, "")
    atlas, line = source.load()
    assert line.text == f"wedge.json: {len(atlas.nodes)} nodes, {len(atlas.edges)} edges"
    assert source.check(atlas) == ""


def test_an_atlas_of_another_map_than_the_served_one_is_refused() -> None:
    source = AtlasSource(read)
    source.serve(served("glass_bridge"), "that of topic /map")
    with pytest.raises(AtlasError, match="^wedge.json: .*that of topic /map"):
        source.load()


def test_a_map_that_differs_in_few_cells_is_a_warning() -> None:
    source, wedge = AtlasSource(read), served("glass_wedge")
    occupancy = wedge.occupancy.copy()
    occupancy[tuple(np.argwhere(wedge.free)[0])] = 100
    source.serve(replace(wedge, occupancy=occupancy), "the map")
    _, line = source.load()
    assert line.level == logging.WARNING and "; it " in line.text


def test_without_an_atlas_one_is_taken_once_it_is_built_from_the_served_map() -> None:
    source, wedge = AtlasSource(None), served("glass_wedge")
    assert (source.has_atlas, source.builds) == (False, True)
    with pytest.raises(AtlasError, match="^no atlas has been built yet$"):
        source.load()
    source.serve(wedge, "the map")
    assert source.is_served(wedge) and not source.is_served(served("glass_wedge"))
    source.take_built(read()[1])
    assert source.load()[1].text.startswith("the atlas built from the map: ")
    assert (source.has_atlas, source.builds) == (True, True)


def test_visits_are_saved_and_read_again(tmp_path: Path) -> None:
    source = AtlasSource(read, str(tmp_path / "visits.npz"))
    atlas, _ = source.load()
    atlas.visits.add_misses(np.array([4]))
    assert source.save_visits(atlas) == []
    again, _ = source.load()
    assert again.visits.node_missed.tolist() == atlas.visits.node_missed.tolist()
    assert AtlasSource(read).save_visits(atlas) == []


def test_visits_that_cannot_be_saved_are_logged(tmp_path: Path) -> None:
    source = AtlasSource(read, str(tmp_path / "missing" / "visits.npz"))
    (line,) = source.save_visits(read()[1])
    assert line.level == logging.ERROR
    assert line.text.startswith("the atlas with its statistics is not saved: ")
