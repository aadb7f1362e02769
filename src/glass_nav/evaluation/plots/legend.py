"""The legend of the markers in rviz, as an image: rviz has a display for images, but none for legends.

It is drawn at the size of the panel in rviz/*.rviz, so that rviz need not scale it. (H, W, 3) pixels.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, List, Tuple

import numpy as np

from glass_nav.shapes import FIGURES
from glass_nav.vocabulary import (
    ATLAS_RGB,
    CASES_IN_ORDER,
    FOREST_RGB,
    GLASS_FROM,
    LEFT_OUT_RGB,
    NODE_RGB,
    PARTICLE_RGB,
    PLACE_RGB,
    POSE_RGB,
    SEARCH_RGB,
    SOLID_BELOW,
    TAG_RGB,
    UNMAPPED_GLASS_RGB,
    USED_RGB,
    BeamCase,
    Rgb,
    SearchState,
    WallKind,
)

WIDTH, HEIGHT = 350, 439  # of the panel
BACKGROUND, INK, FAINT_INK = (250, 250, 250), (20, 20, 20), (85, 85, 85)
FONT_PX = 11
_ROW, _HEADING, _MARGIN = 15, 18, 5
_SWATCH = (34, 13)  # of the mark before the words
_FINE = 4  # a swatch is drawn that many times larger, and scaled down: smooth edges
_BASIC_LAYOUT = 0  # of Pillow; its other one, raqm, crashes in the Pillow of ROS Noetic


@dataclass(frozen=True)
class Row:
    """A mark and what it means."""

    mark: str  # of _MARKS
    rgb: Rgb
    words: str


CASE_NOTES = {BeamCase.SPECULAR: " at first surface", BeamCase.UNCERTAIN: ": nothing explains it"}
WALL_WORDS = {
    WallKind.GLASS: f"glass: probability of {GLASS_FROM} % and more",
    WallKind.UNDECIDED: "undecided",
    WallKind.SOLID: f"solid: probability of glass below {SOLID_BELOW} %",
}
SEARCH_WORDS = {
    SearchState.SEARCHING: "candidate while searching",
    SearchState.TENTATIVE: "candidate, tentative",
    SearchState.CONFIRMED: "place confirmed",
    SearchState.AMBIGUOUS: "places that look alike (ambiguous)",
}
SECTIONS: Dict[str, List[Row]] = {
    "Beams, by what they met": [
        Row(f"beam {case.mark}", case.rgb, case.label + CASE_NOTES.get(case, "")) for case in CASES_IN_ORDER
    ],
    "Walls, by the beams that crossed them": [
        *(Row("wall", kind.rgb, words) for kind, words in WALL_WORDS.items()),
        Row("line", UNMAPPED_GLASS_RGB, "glass that the map lacks"),
    ],
    "Pose": [
        Row("arrow", POSE_RGB, "pose with its covariance"),
        Row("arrow", PARTICLE_RGB, "particle"),
        Row("ring", PLACE_RGB, "possible place, its share, scan and path"),
    ],
    "Landmarks": [
        Row("arrow", TAG_RGB, "landmark and where it faces"),
        Row("line", USED_RGB, "bearing that the fix used"),
        Row("line", LEFT_OUT_RGB, "bearing that it left out"),
    ],
    "Place in the atlas": [
        Row("edge", ATLAS_RGB, "edge and node"),
        *(Row("arrow", SEARCH_RGB[state], words) for state, words in SEARCH_WORDS.items()),
        Row("cross", LEFT_OUT_RGB, "search node ruled out, and by what"),
        Row("line", FOREST_RGB, "path of a candidate"),
    ],
}


def draw() -> np.ndarray:
    """(HEIGHT, WIDTH, 3) uint8: a heading for each section, a row for each mark."""
    from PIL import Image, ImageDraw

    picture = Image.new("RGB", (WIDTH, HEIGHT), BACKGROUND)
    pen, font, bold = ImageDraw.Draw(picture), _font("DejaVuSans.ttf"), _font("DejaVuSans-Bold.ttf")
    top = _MARGIN - 2
    for heading, rows in SECTIONS.items():
        pen.text((_MARGIN, top + 2), heading, fill=FAINT_INK, font=bold)
        top += _HEADING
        for row in rows:
            picture.paste(_swatch(row), (_MARGIN, top + 1))
            pen.text((_MARGIN + _SWATCH[0] + 8, top), row.words, fill=INK, font=font)
            top += _ROW
    return np.asarray(picture)


def _font(name: str) -> Any:
    """A font that comes with matplotlib."""
    import matplotlib
    from PIL import ImageFont

    path = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name
    return ImageFont.truetype(str(path), FONT_PX, layout_engine=_BASIC_LAYOUT)


def _swatch(row: Row) -> Any:
    """The sample of one row, as rviz draws it."""
    from PIL import Image, ImageDraw

    width, height = (_FINE * side for side in _SWATCH)
    picture = Image.new("RGB", (width, height), BACKGROUND)
    pen, middle = ImageDraw.Draw(picture), height // 2
    kind, _, figure = row.mark.partition(" ")
    if kind == "beam":
        pen.line((0, middle, width - 6 * _FINE, middle), fill=row.rgb, width=_FINE)
        centre = np.array([width - 7 * _FINE, middle])
        pen.rectangle(_box(centre, 2.5 * _FINE), fill=row.rgb)
        for start, end in (centre + 6 * _FINE * np.array([1, -1]) * FIGURES[figure]).reshape(-1, 2, 2):
            pen.line((*start, *end), fill=row.rgb, width=_FINE + 2)
    elif kind == "wall":
        pen.rectangle((0, middle - 3 * _FINE, width, middle + 3 * _FINE), fill=row.rgb)
    elif kind == "line":
        pen.line((0, middle, width, middle), fill=row.rgb, width=2 * _FINE)
    elif kind == "edge":
        pen.line((0, middle, width, middle), fill=row.rgb, width=2 * _FINE)
        pen.rectangle(_box(np.array([width // 2, middle]), 3 * _FINE), fill=NODE_RGB)
    elif kind == "arrow":
        pen.line((0, middle, width, middle), fill=row.rgb, width=2 * _FINE)
        for side in (-1, 1):
            pen.line((width, middle, width - 8 * _FINE, middle + side * 5 * _FINE), fill=row.rgb, width=2 * _FINE)
    elif kind == "cross":
        for side in (-1, 1):
            ends = (
                width // 2 - 5 * _FINE,
                middle - 5 * side * _FINE,
                width // 2 + 5 * _FINE,
                middle + 5 * side * _FINE,
            )
            pen.line(ends, fill=row.rgb, width=2 * _FINE)
    else:
        pen.ellipse(_box(np.array([width // 2, middle]), 5.5 * _FINE), outline=row.rgb, width=2 * _FINE)
    return picture.resize(_SWATCH, Image.BOX)


def _box(centre: np.ndarray, half: float) -> Tuple[float, float, float, float]:
    return (*(centre - half), *(centre + half))
