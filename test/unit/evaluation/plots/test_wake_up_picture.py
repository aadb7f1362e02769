from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from glass_nav.evaluation.plots import wake_up_picture
from glass_nav.evaluation.plots.wake_up_picture import CANDIDATE_COLOUR, SEARCH_COLOUR, TOUR_COLOUR, Depth, WakeUpStory
from glass_nav.world.grid_map import GridMap


def grid():
    cells = np.zeros((100, 240), np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = 100
    return GridMap(cells, 0.05, np.zeros(3))


def story(depths):
    way = np.stack([np.linspace(1, 6, 40), np.full(40, 2.0)], axis=1)
    places = np.array([[2.0, 2.0, 0.0], [9.0, 3.0, 1.5], [5.0, 1.0, -1.5]])
    return WakeUpStory(
        [Depth(places[: max(3 - number, 1)], places[0], "turn LEFT") for number in range(depths)],
        way,
        way + [5.0, 1.0],
        places[0],
        places[1],
        places[1],
    )


def colours(path):
    pixels = np.asarray(Image.open(path).convert("RGB")).reshape(-1, 3)
    return {tuple(rgb) for rgb in np.unique(pixels, axis=0).tolist()}


def rgb(code):
    return tuple(int(code[at : at + 2], 16) for at in (1, 3, 5))


@pytest.mark.long_run
def test_the_ways_and_the_candidates_are_drawn(tmp_path):
    wake_up_picture.draw(tmp_path / "a.png", grid(), story(3), "office")
    assert {rgb(SEARCH_COLOUR), rgb(TOUR_COLOUR), rgb(CANDIDATE_COLOUR)} <= colours(tmp_path / "a.png")


@pytest.mark.long_run
@pytest.mark.parametrize("depths", [0, 1, 20])
def test_any_number_of_depths_makes_a_picture_that_can_be_looked_at(depths, tmp_path):
    wake_up_picture.draw(tmp_path / "a.png", grid(), story(depths), "office")
    width, height = Image.open(tmp_path / "a.png").size
    assert 1000 < width < 2000 and 300 < height < 6000


@pytest.mark.long_run
def test_a_robot_that_found_nothing_has_a_picture_too(tmp_path):
    empty = WakeUpStory([Depth(np.zeros((0, 3)), None, "LOST")], np.zeros((0, 2)))
    wake_up_picture.draw(tmp_path / "a.png", grid(), empty, "office")
    assert rgb(SEARCH_COLOUR) not in colours(tmp_path / "a.png")


def test_the_first_and_the_last_depths_have_panels():
    assert wake_up_picture._shown(3) == [0, 1, 2]
    assert wake_up_picture._shown(20) == [0, 1, 2, 3, 16, 17, 18, 19]
