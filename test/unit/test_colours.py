"""What is shown together is told apart with deuteranopia and protanopia, and by more than its colour."""

from __future__ import annotations

import numpy as np
import pytest
from colour_vision import VIEWS, distances, lab, linear, picture, seen
from PIL import Image

from glass_nav import vocabulary
from glass_nav.evaluation.plots import atlas_picture, passed_nodes_picture, wake_up_picture
from glass_nav.vocabulary import MIN_COLOUR_DIFFERENCE, MIN_LIGHTNESS_STEP


def rgb(code):
    return [int(code[at : at + 2], 16) for at in (1, 3, 5)]


TOGETHER = {
    "cases of the beams": list(vocabulary.CASE_RGB.values()),
    "states of localization": [rgb(code) for code in vocabulary.STATE_COLOURS.values()],
    "candidates of a search": list(vocabulary.SEARCH_RGB.values()),
    "walls": [*vocabulary.WALL_RGB.values(), vocabulary.UNMAPPED_GLASS_RGB],
    "landmarks": [vocabulary.TAG_RGB, vocabulary.USED_RGB, vocabulary.LEFT_OUT_RGB],
    "nodes of an atlas": [rgb(code) for code in atlas_picture.NODE_COLOURS.values()],
    "nodes passed": [rgb(code) for code in passed_nodes_picture.COLOURS.values()],
    "a robot that woke up": [
        rgb(getattr(wake_up_picture, f"{name}_COLOUR")) for name in ("SEARCH", "TOUR", "CANDIDATE", "TRUE")
    ],
    "things compared": [rgb(code) for code in vocabulary.SERIES_COLOURS],
}
LINED = ("things compared", "nodes of an atlas")  # more colours than steps of lightness: lines, marks alone must do


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("name", TOGETHER)
def test_colours_that_are_shown_together_are_far_apart_in_every_view(name, view):
    assert distances(np.array(TOGETHER[name]), view).min() >= MIN_COLOUR_DIFFERENCE


@pytest.mark.parametrize("name", sorted(set(TOGETHER) - set(LINED)))
def test_a_print_in_grey_keeps_them_apart(name):
    lightness = np.sort(lab(linear(np.array(TOGETHER[name])))[:, 0])
    assert np.diff(lightness).min() >= MIN_LIGHTNESS_STEP


@pytest.mark.parametrize(
    "marks",
    [
        pytest.param(vocabulary.CASE_MARKS, id="cases"),
        pytest.param(vocabulary.CASE_HATCHES, id="areas of cases"),
        pytest.param(vocabulary.STATE_MARKS, id="states"),
        pytest.param(vocabulary.STATE_HATCHES, id="areas of states"),
        pytest.param(dict(enumerate(vocabulary.SERIES_LINES)), id="lines of things compared"),
        pytest.param(dict(enumerate(vocabulary.SERIES_MARKS)), id="marks of things compared"),
        pytest.param(atlas_picture.NODE_MARKS, id="nodes of an atlas"),
    ],
)
def test_each_has_a_mark_or_a_line_of_its_own(marks):
    assert len(set(marks.values())) == len(marks)


def test_the_colours_of_before_would_not_pass():
    """Mirrored, uncertain and first surface of Okabe and Ito's set, without green."""
    before = np.array([[204, 121, 167], [150, 150, 150], [0, 158, 115]])
    assert distances(before, "deuteranopia").min() < 10.0


def test_red_and_green_of_one_lightness_are_one_colour_with_deuteranopia():
    """The confusion that gives the deficiency its name; blue and yellow stay."""
    red_green = np.array([[200, 80, 60], [125, 125, 55]])
    assert distances(red_green, "deuteranopia").min() < 0.3 * distances(red_green, "normal vision").min()
    assert distances(np.array([[0, 0, 255], [255, 255, 0]]), "deuteranopia").min() > 150.0


@pytest.mark.parametrize("view", VIEWS)
def test_grey_stays_grey_in_every_view(view):
    assert seen(np.array([128, 128, 128]), view) == pytest.approx(linear(np.array([128] * 3)), abs=1e-3)


def test_lab_is_that_of_the_definition():
    """White, and the red of sRGB as published: L 53.24, a 80.09, b 67.20."""
    assert lab(linear(np.array([255, 255, 255]))) == pytest.approx([100.0, 0.0, 0.0], abs=0.02)
    assert lab(linear(np.array([255, 0, 0]))) == pytest.approx([53.24, 80.09, 67.20], abs=0.02)


def test_the_sheet_holds_the_picture_once_in_each_view():
    sheet = picture(Image.new("RGB", (160, 40), (255, 0, 0)))
    assert sheet.size == (160, 120)
    assert sheet.getpixel((150, 30)) == (255, 0, 0)
    assert sheet.getpixel((150, 70)) != (255, 0, 0)
