"""The picture that explains the colours: every colour of a case is in it, in the order of the rows."""

from __future__ import annotations

from io import BytesIO

import numpy as np
from sensor_msgs.msg import Image

from glass_nav.ros.localization import legend, wall_display
from glass_nav.vocabulary import CASES_IN_ORDER


def rows_with(pixels: np.ndarray, colour) -> np.ndarray:
    return np.nonzero((pixels == np.asarray(colour)).all(axis=2).sum(axis=1) > 20)[0]


def test_the_message_is_an_image_of_its_size():
    raw = BytesIO()
    legend.image_msg("map").serialize(raw)
    msg = Image().deserialize(raw.getvalue())
    assert (msg.encoding, msg.header.frame_id, msg.step) == ("rgb8", "map", 3 * msg.width)
    assert len(msg.data) == msg.step * msg.height
    pixels = np.frombuffer(msg.data, np.uint8).reshape(msg.height, msg.width, 3)
    assert np.array_equal(pixels, legend.draw())


def test_each_case_has_a_row_with_its_colour_and_words():
    pixels = legend.draw()
    tops = []
    for case in CASES_IN_ORDER:
        rows = rows_with(pixels, case.rgb)
        assert len(rows) >= 16 and np.ptp(rows) == len(rows) - 1, f"case {case}"
        ink = (pixels[rows] == legend.INK).all(axis=2).sum()
        assert ink > 300, f"case {case} has no words"
        tops.append(rows[0])
    assert tops == sorted(tops)


def test_no_word_is_cut_off_at_the_edge():
    edge = legend.draw()[:, -2 * legend.ZOOM :]
    assert np.all(edge == legend.BACKGROUND)


def test_each_kind_of_wall_has_a_row_with_its_colour_and_name():
    pixels = legend.draw()
    assert sorted(legend.WALL_WORDS) == [0, 1, 2]
    for kind, words in legend.WALL_WORDS.items():
        assert words.startswith(wall_display.WALL_NAMES[kind])
        rows = rows_with(pixels, wall_display.WALL_COLOURS[kind])
        assert len(rows) >= 16 and (pixels[rows] == legend.INK).all(axis=2).sum() > 150
    assert str(wall_display.GLASS_FROM) in legend.WALL_WORDS[2]
    assert str(wall_display.SOLID_BELOW) in legend.WALL_WORDS[0]


def test_no_two_colours_are_alike():
    colours = np.concatenate([[case.rgb for case in CASES_IN_ORDER], wall_display.WALL_COLOURS])
    apart = np.abs(colours[:, None] - colours).sum(axis=2)
    assert apart[~np.eye(len(colours), dtype=bool)].min() > 80
