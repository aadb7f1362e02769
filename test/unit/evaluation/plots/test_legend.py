"""The picture that explains the marks of rviz: each mark has a row with its colour and its words, none cut off."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from glass_nav.evaluation.plots import legend
from glass_nav.shapes import FIGURES
from glass_nav.vocabulary import CASE_MARKS, CASES_IN_ORDER, SEARCH_RGB, WallKind

ROWS = [row for rows in legend.SECTIONS.values() for row in rows]


def test_it_has_the_size_of_the_panel():
    assert legend.draw().shape == (legend.HEIGHT, legend.WIDTH, 3)


def test_no_word_is_cut_off_at_an_edge():
    pixels = legend.draw()
    for edge in (pixels[:, -4:], pixels[-3:], pixels[:2]):
        assert np.all(edge == legend.BACKGROUND)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.words)
def test_each_mark_has_its_colour(row):
    apart = np.abs(np.asarray(legend._swatch(row)).astype(int) - row.rgb).sum(axis=2)
    assert (apart < 12).sum() >= 8


def test_marks_of_one_section_are_not_alike():
    for rows in legend.SECTIONS.values():
        assert len({(row.mark, row.rgb) for row in rows}) == len(rows)


def test_all_that_is_shown_has_a_row():
    rows = {row.words: row for row in ROWS}
    for case in CASES_IN_ORDER:
        assert any(words.startswith(case.label) and row.rgb == case.rgb for words, row in rows.items())
        assert CASE_MARKS[case] in FIGURES
    for kind in WallKind:
        assert any(words.startswith(str(kind)) and row.rgb == kind.rgb for words, row in rows.items())
    colours = [row.rgb for row in legend.SECTIONS["Place in the atlas"]]
    assert set(SEARCH_RGB.values()) < set(colours)
    assert len(legend.SECTIONS["Landmarks"]) == 3


def test_the_marks_of_the_topological_node_have_their_rows():
    pytest.importorskip("geometry_msgs", reason="no ROS beside this Python")
    from glass_nav.ros.topology import topology_displays
    from glass_nav.topology import search_scene

    colours = [row.rgb for row in legend.SECTIONS["Place in the atlas"]]
    assert {topology_displays.ATLAS_RGB, topology_displays.FOREST_RGB, search_scene.LEFT_OUT_RGB} < set(colours)


def test_letters_are_smooth():
    """A font of bitmaps has ink and paper and nothing in between."""
    words = legend.draw()[:, 60:]
    assert len(np.unique(words.reshape(-1, 3), axis=0)) > 20


def test_it_is_drawn_twice_alike():
    assert Image.fromarray(legend.draw()).tobytes() == Image.fromarray(legend.draw()).tobytes()
