"""How people with deuteranopia or protanopia see a colour, and how far apart two colours are for them.

    python test/support/colour_vision.py IN.png OUT.png

writes a picture as it is, and below it as they see it. Colours (..., 3) are sRGB, 0..255; C colours.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Dict

import numpy as np
from PIL import Image, ImageDraw

VIEWS: Dict[str, np.ndarray] = {  # Machado, Oliveira, Fernandes (2009), severity 1.0, on linear RGB
    "normal vision": np.eye(3),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
}
_XYZ = np.array(  # of linear sRGB, IEC 61966-2-1
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
_WHITE = np.array([0.95047, 1.0, 1.08883])  # D65


def linear(rgb: np.ndarray) -> np.ndarray:
    """(..., 3) linear, 0..1."""
    share = np.asarray(rgb, float) / 255.0
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def seen(rgb: np.ndarray, view: str) -> np.ndarray:
    """(..., 3) linear, 0..1: what is left of colours in a view of VIEWS."""
    return np.clip(linear(rgb) @ VIEWS[view].T, 0.0, 1.0)


def lab(linear_rgb: np.ndarray) -> np.ndarray:
    """(..., 3) CIE L*a*b* (1976) for D65."""
    share = linear_rgb @ _XYZ.T / _WHITE
    root = np.where(share > (6 / 29) ** 3, np.cbrt(share), share / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.stack(
        [
            116.0 * root[..., 1] - 16.0,
            500.0 * (root[..., 0] - root[..., 1]),
            200.0 * (root[..., 1] - root[..., 2]),
        ],
        axis=-1,
    )


def distances(colours: np.ndarray, view: str) -> np.ndarray:
    """(C, C) in CIE Lab between colours (C, 3) as a view of VIEWS shows them; inf from each to itself."""
    points = lab(seen(colours, view))
    apart = np.linalg.norm(points[:, None] - points, axis=2)
    np.fill_diagonal(apart, np.inf)
    return apart


def picture(image: Image.Image) -> Image.Image:
    """The picture in each view, one below the other, with the view's name."""
    pixels = np.asarray(image.convert("RGB"))
    width, height = image.size
    sheet = Image.new("RGB", (width, height * len(VIEWS)))
    for row, view in enumerate(VIEWS):
        share = seen(pixels, view)
        srgb = np.where(share <= 0.0031308, 12.92 * share, 1.055 * share ** (1 / 2.4) - 0.055)
        part = Image.fromarray(np.rint(255.0 * srgb).astype(np.uint8))
        pen = ImageDraw.Draw(part)
        pen.rectangle((0, 0, 8 + 7 * len(view), 16), fill="white")
        pen.text((4, 3), view, fill="black")
        sheet.paste(part, (0, row * height))
    return sheet


if __name__ == "__main__":
    with Image.open(sys.argv[1]) as shown:
        picture(shown).quantize(256, kmeans=3).save(Path(sys.argv[2]), optimize=True)
