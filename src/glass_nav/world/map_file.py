"""Reads and writes maps: map_server's yaml with its image, MRPT's .gridmap and .gridmap.gz.

The yaml means here what it means to map_server of ROS 1: numbers as yaml-cpp reads them, an alpha channel averaged with
the colours in mode trinary. Values that map_server silently accepts but that make no sense
(thresholds out of order, a resolution of 0, an unknown mode) are refused.
"""

from __future__ import annotations

import math
import os
import re
from pathlib import Path
from typing import Any, Dict, Optional, Union

import numpy as np

from glass_nav.world import image_file
from glass_nav.world.grid_map import UNKNOWN, GridMap

MODES = ("trinary", "scale", "raw")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_INTEGER = re.compile(r"[+-]?(?:(0x[0-9a-f]+)|(0[0-7]+)|0|[1-9]\d*)")
_TRUE, _FALSE, _NULL = ("true", "yes", "on"), ("false", "no", "off"), ("", "~", "null", "Null", "NULL")
_BLOCK = 2**22  # cells
REQUIRED = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")


class MapError(ValueError):
    """A map file is unusable; one line: the file, what was given, what is allowed."""


def load(path: "Union[str, os.PathLike[str]]") -> GridMap:
    """The map in a map_server yaml, or in an MRPT grid map (.gridmap, .gridmap.gz).

    Raises:
        MapError: the file, its image or one of its values cannot be used.
    """
    path = Path(path)
    if path.name.endswith((".gridmap", ".gridmap.gz")):
        return _load_mrpt(path)
    if path.suffix in (".yaml", ".yml"):
        return _load_yaml(path)
    raise MapError(f"{path}: a map is a map_server .yaml or an MRPT .gridmap[.gz]")


def save(grid_map: GridMap, path_yaml: "Union[str, os.PathLike[str]]", image_suffix: str = ".pgm") -> None:
    """Write a map_server yaml, and beside it the image of the same name. load() gives an equal map, but 99 percent,
    which mode scale does not have, becomes 98.

    The image has the given suffix (.pgm, .png) and is in mode trinary; for a map with percentages between 0 and 100 it
    is a .png in mode scale with the unknown cells transparent.
    """
    path_yaml = Path(path_yaml)
    path_image = path_yaml.with_suffix(image_suffix)
    occupancy = grid_map.occupancy.astype(int)
    graded = not np.isin(occupancy, (UNKNOWN, 0, 100)).all()
    free, occupied = (0.002, 0.998) if graded else (0.196, 0.65)  # map_saver's, or nearly everything graded
    if graded:
        path_image = path_yaml.with_suffix(".png")
        step = (occupied - free) / 98.0  # mode scale has 98 steps for 1..98, each of at least two greys
        probability = np.select(
            [occupancy <= 0, occupancy == 100], [0.0, 1.0], free + step * (np.minimum(occupancy, 98) - 0.5)
        )
        grey = np.where(occupancy == UNKNOWN, 128, np.rint(255.0 * (1.0 - probability)))
        alpha = np.where(occupancy == UNKNOWN, 0, 255)
        image = np.stack([grey, grey, grey, alpha], axis=-1).astype(np.uint8)
    else:
        image = np.select([occupancy == 100, occupancy == 0], [0, 254], 205).astype(np.uint8)
    from PIL import Image  # slow to import, and only map files need it

    Image.fromarray(np.ascontiguousarray(image[::-1])).save(path_image)
    x, y, yaw = (float(value) for value in grid_map.map_from_grid)
    path_yaml.write_text(
        f"image: {path_image.name}\nmode: {'scale' if graded else 'trinary'}\n"
        f"resolution: {float(grid_map.resolution_m)!r}\norigin: [{x!r}, {y!r}, {yaw!r}]\n"
        f"negate: 0\noccupied_thresh: {occupied}\nfree_thresh: {free}\n"
    )


def _load_yaml(path: Path) -> GridMap:
    fields = _fields(path)
    resolution = _number(path, fields, "resolution")
    if not resolution > 0.0:
        raise MapError(f"{path}: resolution must be > 0 m, got {resolution}")
    origin = fields["origin"]
    if not (isinstance(origin, list) and len(origin) == 3 and all(math.isfinite(_float(value)) for value in origin)):
        raise MapError(f"{path}: origin must be [x, y, yaw] in m, m, rad, got {origin!r}")
    negate = _flag(fields["negate"])
    if negate is None:
        raise MapError(f"{path}: negate must be 0 or 1, got {fields['negate']!r}")
    mode = fields.get("mode", "")
    if mode in _NULL:
        mode = "trinary"
    if mode not in MODES:
        raise MapError(f"{path}: mode must be trinary, scale or raw, got {mode!r}")
    occupied, free = _number(path, fields, "occupied_thresh"), _number(path, fields, "free_thresh")
    if not 0.0 <= free < occupied <= 1.0:
        raise MapError(
            f"{path}: thresholds must be 0 <= free_thresh < occupied_thresh <= 1, "
            f"got free_thresh {free} and occupied_thresh {occupied}"
        )
    image = fields["image"]
    if not isinstance(image, str) or image in _NULL or "\0" in image:
        raise MapError(f"{path}: image must be the name of a file, got {image!r}")
    try:
        channels = image_file.channels(path.parent / image)  # an absolute name stays absolute
    except image_file.ImageError as err:
        raise MapError(f"{path}: {err}") from err
    occupancy = _occupancy(channels, str(mode), negate, occupied, free)
    return GridMap(occupancy, resolution, np.array([_float(value) for value in origin]))


def _fields(path: Path) -> Dict[str, Any]:
    """Name -> text, or list of texts, of all fields; converted when they are read, as yaml-cpp does."""
    import yaml  # here, because the rest of the package reads no yaml

    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as err:
        raise MapError(f"{path}: cannot be read: {_reason(err)}") from err
    try:
        # The first document, as map_server; and tabs between a name and its value, which yaml-cpp takes for spaces.
        fields = next(iter(yaml.load_all(text.replace("\t", " "), Loader=yaml.BaseLoader)), None)
    except (yaml.YAMLError, RecursionError) as err:
        raise MapError(f"{path}: is not yaml: {' '.join(str(err).split())}") from err
    if not isinstance(fields, dict):
        raise MapError(f"{path}: is no map: expected the keys {', '.join(REQUIRED)}")
    missing = [key for key in REQUIRED if key not in fields]
    if missing:
        raise MapError(f"{path}: missing {', '.join(missing)}; a map needs {', '.join(REQUIRED)}")
    return fields


def _float(value: Any) -> float:
    """The number as yaml-cpp reads it, else NaN: 5e-2, .05 and "0.05" are numbers; 0x1 and 1_000 are not."""
    return float(value) if isinstance(value, str) and _NUMBER.fullmatch(value.strip()) else math.nan


def _flag(value: Any) -> Optional[bool]:
    """`negate`: an integer of any base, as in yaml-cpp, or a boolean word of YAML 1.1, which other tools write."""
    if not isinstance(value, str):
        return None
    word = value.strip().lower()
    if word in _TRUE or word in _FALSE:
        return word in _TRUE
    match = _INTEGER.fullmatch(word)
    number = -1 if match is None else int(word.lstrip("+"), 16 if match[1] else 8 if match[2] else 10)
    return bool(number) if number in (0, 1) else None


def _number(path: Path, fields: Dict[str, Any], key: str) -> float:
    value = _float(fields[key])
    if not math.isfinite(value):
        raise MapError(f"{path}: {key} must be a finite number, got {fields[key]!r}")
    return value


def _occupancy(channels: np.ndarray, mode: str, negate: bool, occupied: float, free: float) -> np.ndarray:
    """(H, W) int8 by map_server's rules from channels (H, W, C); the lowest row of the image is the first one."""
    has_alpha = channels.shape[-1] == 4
    count = 3 if has_alpha and mode != "trinary" else channels.shape[-1]
    by_total = _by_total(count, mode, negate, occupied, free)
    height, width = channels.shape[:2]
    occupancy = np.empty((height, width), np.int8)
    step = max(1, _BLOCK // width)
    for top in range(0, height, step):  # in blocks: numpy's indices take eight times the memory of the cells
        block = channels[top : top + step]
        cells = by_total[block[..., 0] if count == 1 else block[..., :count].sum(axis=-1, dtype=np.uint16)]
        if mode == "scale" and has_alpha:  # a transparent cell is unknown unless its colour is beyond doubt
            cells[(block[..., 3] == 0) & (cells > 0) & (cells < 100)] = UNKNOWN
        occupancy[height - top - len(block) : height - top] = cells[::-1]
    return occupancy


def _by_total(count: int, mode: str, negate: bool, occupied: float, free: float) -> np.ndarray:
    """int8 occupancy for every possible sum of the channels: a table, since maps have millions of cells."""
    grey = np.arange(255 * count + 1) / count
    if negate:
        grey = 255.0 - grey
    if mode == "raw":  # -1 is 255 in a byte; above 100 there is no percentage
        return np.where(grey <= 100.0, np.floor(grey), UNKNOWN).astype(np.int8)
    probability = (255.0 - grey) / 255.0
    between = np.full(grey.shape, float(UNKNOWN))
    if mode == "scale":
        between = np.floor(1.0 + 98.0 * (probability - free) / (occupied - free))
    return np.select([probability > occupied, probability < free], [100.0, 0.0], between).astype(np.int8)


def _load_mrpt(path: Path) -> GridMap:
    from glass_nav import _mrpt_io  # compiled; yaml maps do not need it

    if not path.is_file():
        raise MapError(f"{path}: does not exist")
    try:
        grid = _mrpt_io.read_grid_map(str(path))
        return GridMap(grid["occupancy"], grid["resolution_m"], np.array([grid["x_min_m"], grid["y_min_m"], 0.0]))
    except ValueError as err:
        raise MapError(f"{path}: {err}") from err


def _reason(err: Exception) -> str:
    if isinstance(err, OSError) and err.strerror:
        return str(err.strerror)
    return str(err).splitlines()[0] if str(err) else type(err).__name__


def name_of(path: Path) -> str:
    """Name of a map for people and atlases: the file's stem, or its folder's name if it is called map.yaml."""
    stem = path.name.partition(".")[0]
    return path.resolve().parent.name if stem == "map" else stem
