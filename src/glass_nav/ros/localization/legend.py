"""What the colours in rviz mean, as a picture: rviz has no display for a legend, but one for images.

PIL draws it with its built-in font: no font file is needed.
"""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from sensor_msgs.msg import Image as ImageMsg

from glass_nav.ros import conversions
from glass_nav.ros.localization import wall_display
from glass_nav.vocabulary import CASES_IN_ORDER, BeamCase

BACKGROUND, INK, FAINT_INK = (250, 250, 250), (20, 20, 20), (95, 95, 95)
ZOOM = 2  # the font's letters are 6 x 11 pixels
WIDTH, ROW = 240, 15  # before the zoom
MARGIN, PATCH = 6, 22

CASE_NOTES = {BeamCase.SPECULAR: " at first surface", BeamCase.UNCERTAIN: ": nothing explains it"}
WALL_WORDS = {2: "glass: chance of 75 % and more", 1: "undecided", 0: "solid: chance of glass below 25 %"}


def image_msg(map_frame: str) -> ImageMsg:
    """The message of `~legend`, rgb8."""
    pixels = draw()
    height, width, _ = pixels.shape
    return ImageMsg(
        header=conversions.header(0, map_frame),
        height=height,
        width=width,
        encoding="rgb8",
        is_bigendian=0,
        step=3 * width,
        data=pixels.tobytes(),
    )


def draw() -> np.ndarray:
    """(H, W, 3) uint8: a row per case, then one per kind of wall."""
    beams = [(case.rgb, case.label + CASE_NOTES.get(case, "")) for case in CASES_IN_ORDER]
    walls = [(wall_display.WALL_COLOURS[kind], words) for kind, words in WALL_WORDS.items()]
    height = 2 * MARGIN + ROW * (len(beams) + len(walls) + 2) + ROW // 2
    picture = Image.new("RGB", (WIDTH, height), BACKGROUND)
    brush, font = ImageDraw.Draw(picture), ImageFont.load_default()
    top = MARGIN
    for heading, rows in (("Beams, by what they met", beams), ("Walls, by the beams that crossed them", walls)):
        brush.text((MARGIN, top + 1), heading, fill=FAINT_INK, font=font)
        for rgb, words in rows:
            top += ROW
            brush.rectangle((MARGIN, top + 1, MARGIN + PATCH, top + ROW - 3), fill=tuple(int(value) for value in rgb))
            brush.text((MARGIN + PATCH + 8, top + 1), words, fill=INK, font=font)
        top += ROW + ROW // 2
    return np.repeat(np.repeat(np.asarray(picture), ZOOM, axis=0), ZOOM, axis=1)
