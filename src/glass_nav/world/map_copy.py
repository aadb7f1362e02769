"""Copies a map file with more cells occupied: thresholds, mode, origin and every other pixel stay."""

from __future__ import annotations

from pathlib import Path
from typing import Any, List, Tuple

import numpy as np

from glass_nav.world import image_file, map_file
from glass_nav.world.grid_map import GridMap
from glass_nav.world.map_file import MapError

_RAW_OCCUPIED = 100
_TRUE = ("1", "true", "yes", "on")


def save(source: Path, grid_map: GridMap, path_yaml: Path) -> List[Path]:
    """Write the map of a file with the cells occupied that are so in grid_map only.

    The image is lossless: of the format of the source if that is .pgm or .png, else .png. An MRPT map becomes a
    map_server yaml.

    Args:
        source: the map file.
        grid_map: its map, with some more cells occupied.
        path_yaml: to be written, with its image beside; not the source itself.

    Returns:
        what was written.

    Raises:
        MapError: the source cannot be used, or would be overwritten.
        OSError: a file cannot be written.
    """
    before = map_file.load(source)
    if source.suffix not in (".yaml", ".yml"):
        map_file.save(grid_map, path_yaml)
        return [path_yaml, path_yaml.with_suffix(".pgm")]
    fields, path_image = _fields(source)
    pixels = image_file.channels(path_image).copy()  # of an image as it is: read-only
    new_image = path_yaml.with_suffix(path_image.suffix if _lossless(path_image, pixels) else ".png")
    for path in (path_yaml, new_image):
        check_other(path, source)
    mode = str(fields.get("mode", "trinary"))
    negate = str(fields["negate"]).lower() in _TRUE
    added = (grid_map.occupancy != before.occupancy)[::-1]  # rows as in the image
    fill = _RAW_OCCUPIED if mode == "raw" else 0
    colours = pixels.shape[-1] if mode == "trinary" else min(pixels.shape[-1], 3)  # alpha counts in mode trinary only
    pixels[added, :colours] = 255 - fill if negate else fill
    if colours < pixels.shape[-1]:
        pixels[added, colours:] = 255
    _write_image(new_image, pixels)
    path_yaml.write_text(
        "".join(f"{name}: {_text(value)}\n" for name, value in {**fields, "image": new_image.name}.items())
    )
    if not np.array_equal(map_file.load(path_yaml).occupancy, grid_map.occupancy):
        raise MapError(f"{path_yaml}: does not give the map back; the image of {source} cannot be edited")
    return [path_yaml, new_image]


def check_other(path: Path, source: Path) -> None:
    """Make sure that a file to be written is not the map or its image.

    Raises:
        MapError: it is.
    """
    old = [source] if source.suffix not in (".yaml", ".yml") else [source, _fields(source)[1]]
    if path.exists() and any(path.samefile(each) for each in old):
        raise MapError(f"{path}: is the map itself; choose another folder")


def _fields(source: Path) -> "Tuple[dict[str, Any], Path]":
    import yaml

    fields = next(
        iter(yaml.load_all(source.read_text(encoding="utf-8-sig").replace("\t", " "), Loader=yaml.BaseLoader))
    )
    return fields, source.parent / fields["image"]


def _text(value: Any) -> str:
    return f"[{', '.join(map(str, value))}]" if isinstance(value, list) else str(value)


def _lossless(path_image: Path, pixels: np.ndarray) -> bool:
    return path_image.suffix == ".png" or (path_image.suffix == ".pgm" and pixels.shape[-1] == 1)


def _write_image(path: Path, pixels: np.ndarray) -> None:
    from PIL import Image  # slow to import

    Image.fromarray(np.ascontiguousarray(pixels[..., 0] if pixels.shape[-1] == 1 else pixels)).save(path)
