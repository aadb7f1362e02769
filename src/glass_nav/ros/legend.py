"""What the colours in rviz mean, as a picture: rviz has no display for a legend, but one for images.

Drawn by PIL with the font that it carries in itself: no font file is needed.
"""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from sensor_msgs.msg import Image as ImageMsg

from glass_nav.ros import beam_displays, conversions

BACKGROUND, INK, FAINT_INK = (250, 250, 250), (20, 20, 20), (95, 95, 95)
ZOOM = 2                 # the font's letters are 6 x 11 pixels
WIDTH, ROW = 240, 15     # before the zoom
MARGIN, PATCH = 6, 22

# In the order of the way of a beam, not of the numbers.
CASE_WORDS = {1: "1 diffuse: ended at first surface", 3: "3 behind one pane", 4: "4 behind two panes",
              2: "2 mirrored at first surface", 0: "0 uncertain: not on the map"}


def image_msg(map_frame: str) -> ImageMsg:
    """The message of `~legend`, rgb8."""
    pixels = draw()
    height, width, _ = pixels.shape
    return ImageMsg(header=conversions.header(0, map_frame), height=height, width=width, encoding="rgb8",
                    is_bigendian=0, step=3 * width, data=pixels.tobytes())


def draw() -> np.ndarray:
    """(H, W, 3) uint8: a row per case, then the colours of the glass map."""
    height = 2 * MARGIN + ROW * (len(CASE_WORDS) + 4)
    picture = Image.new("RGB", (WIDTH, height), BACKGROUND)
    brush, font = ImageDraw.Draw(picture), ImageFont.load_default()
    top = MARGIN

    def write(left: int, text: str, colour: "tuple[int, int, int]") -> None:
        brush.text((left, top + 1), text, fill=colour, font=font)

    write(MARGIN, "Beams, by what they met", FAINT_INK)
    for case, words in CASE_WORDS.items():
        top += ROW
        colour = tuple(int(value) for value in beam_displays.CASE_COLOURS[case])
        brush.rectangle((MARGIN, top + 1, MARGIN + PATCH, top + ROW - 3), fill=colour)
        write(MARGIN + PATCH + 8, words, INK)
    top += ROW + ROW // 2
    write(MARGIN, "Walls, by how glassy they proved [%]", FAINT_INK)
    top += ROW
    right = WIDTH - 60
    for x in range(MARGIN, right):
        brush.line((x, top + 1, x, top + ROW - 3), fill=costmap_colour(100.0 * (x - MARGIN) / (right - MARGIN)))
    write(right + 6, "0 .. 100", INK)
    return np.repeat(np.repeat(np.asarray(picture), ZOOM, axis=0), ZOOM, axis=1)


def costmap_colour(percent: float) -> "tuple[int, int, int]":
    """What rviz' Map display paints in its colour scheme "costmap": blue to red up to 98."""
    red = round(255.0 * min(percent, 98.0) / 98.0)
    return red, 0, 255 - red
