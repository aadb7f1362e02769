"""Reads an image file completely or not at all, of any size that the memory holds. H rows, W columns, C channels."""

from __future__ import annotations

import re
import warnings
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Iterator, List

import numpy as np

from glass_nav import machine

_PLAIN = {b"P1": 1, b"P2": 1, b"P3": 3}  # PNM as text, and its channels: Pillow fills what is missing of these
_COMMENT = re.compile(rb"#[^\r\n]*")
_BYTES_PER_PIXEL = 3  # beside its channels: a copy, and the cells that are made of them


class ImageError(ValueError):
    """An image that cannot be used; one line with its name."""


def channels(path: Path) -> np.ndarray:
    """The image as (H, W, C) uint8, top row first; C is 1 grey, 3 colour or 4 with alpha.

    Raises:
        ImageError: no image, one whose data end early, or one too large for the memory.
    """
    if not path.is_file():
        raise ImageError(f"its image {path} does not exist")
    with _any_size():
        try:
            image = _module().open(path)
        except (OSError, ValueError, SyntaxError, EOFError) as err:
            raise ImageError(f"its image {path} cannot be read: {_reason(err)}") from err
        except Exception as err:
            raise ImageError(f"its image {path} is damaged: {_reason(err)}") from err
        with image:
            _check_size(path, image)
            with path.open("rb") as file:
                magic = file.read(2)
            if magic in _PLAIN:
                return _plain(path, magic, image.height, image.width)
            return _pixels(_loaded(path, image))


def _check_size(path: Path, image: Any) -> None:
    needed = image.width * image.height * (len(image.getbands()) + _BYTES_PER_PIXEL)
    free = machine.free_bytes()
    if needed > free:
        raise ImageError(
            f"its image {path} has {image.width} x {image.height} pixels, which take about {needed * 1e-9:.1f} GB of "
            f"memory; {free * 1e-9:.1f} GB are free"
        )


def _loaded(path: Path, image: Any) -> Any:
    """The image, converted to 8 or 16 bits per channel."""
    try:
        image.load()
    except MemoryError:
        raise
    except Exception as err:
        raise _incomplete(path, image.height, image.width) from err
    if image.mode == "P":  # map_server would read the palette index as the colour
        return image.convert("RGBA" if "transparency" in image.info else "RGB")
    if image.mode == "LA":
        return image.convert("RGBA")
    if image.mode not in ("L", "RGB", "RGBA") and not image.mode.startswith("I"):
        return image.convert("L" if image.mode == "1" else "RGB")
    return image


def _pixels(image: Any) -> np.ndarray:
    if image.mode.startswith("I"):  # 16 bit: the high byte, as SDL shows it to map_server
        return np.clip(np.asarray(image).astype(np.int64) >> 8, 0, 255).astype(np.uint8)[..., None]
    pixels = np.asarray(image)
    return pixels[..., None] if pixels.ndim == 2 else pixels


def _plain(path: Path, magic: bytes, height: int, width: int) -> np.ndarray:
    """A PNM image whose pixels are written as numbers: magic, width, height, maxval (not of P1), pixels."""
    words: List[bytes] = _COMMENT.sub(b" ", path.read_bytes()).split()
    count = height * width * _PLAIN[magic]
    try:
        if magic == b"P1":  # digits, with or without spaces between them; 1 is black
            digits = np.frombuffer(b"".join(words[3:])[:count], np.uint8) - ord("0")
            values, highest = 1 - digits.astype(np.int64), 1
        else:
            values, highest = np.array([int(word) for word in words[4 : 4 + count]], np.int64), int(words[3])
    except (ValueError, IndexError, OverflowError) as err:
        raise _incomplete(path, height, width) from err
    if len(values) < count or values.min() < 0 or values.max() > highest:
        raise _incomplete(path, height, width)
    scaled = values * 255 // highest if highest > 255 else np.rint(values * 255.0 / highest)
    return scaled.astype(np.uint8).reshape(height, width, _PLAIN[magic])


def _incomplete(path: Path, height: int, width: int) -> ImageError:
    return ImageError(
        f"the data of its image {path} do not fit its {width} x {height} pixels: the file is cut short or damaged"
    )


@contextmanager
def _any_size() -> Iterator[None]:
    """Lift Pillow's limit on pixels while an image is read; _check_size() is our limit."""
    Image = _module()
    limit, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        Image.MAX_IMAGE_PIXELS = limit


def _module() -> Any:
    from PIL import Image  # slow to import, and only map files need it

    return Image


def _reason(err: Exception) -> str:
    if isinstance(err, OSError) and err.strerror:
        return str(err.strerror)
    return str(err).splitlines()[0] if str(err) else type(err).__name__
