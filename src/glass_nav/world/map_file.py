"""Files -> GridMap and back: map_server's yaml with its image, MRPT's .gridmap and .gridmap.gz.

The yaml means here what it means to map_server of ROS 1, including its habit of averaging an alpha
channel with the colours in mode trinary. Values that map_server silently accepts but that make no sense
(thresholds out of order, a resolution of 0, an unknown mode) are refused.
"""

from __future__ import annotations

import math
import os
import warnings
from pathlib import Path
from typing import Any, Dict, Union

import numpy as np

from glass_nav.world.grid_map import UNKNOWN, GridMap

MODES = ("trinary", "scale", "raw")
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
    """Write a map_server yaml, and beside it the image of the same name. load() gives an equal map, but 99 percent, which
    mode scale does not have, becomes 98.

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
    _image_module().fromarray(np.ascontiguousarray(image[::-1])).save(path_image)
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
    if not (isinstance(origin, list) and len(origin) == 3 and all(_is_number(value) for value in origin)):
        raise MapError(f"{path}: origin must be [x, y, yaw] in m, m, rad, got {origin!r}")
    negate = fields["negate"]
    if negate not in (0, 1):  # True == 1: yaml's true and false are accepted as well
        raise MapError(f"{path}: negate must be 0 or 1, got {negate!r}")
    mode = fields.get("mode", "trinary")
    if mode not in MODES:
        raise MapError(f"{path}: mode must be trinary, scale or raw, got {mode!r}")
    occupied, free = _number(path, fields, "occupied_thresh"), _number(path, fields, "free_thresh")
    if not 0.0 <= free < occupied <= 1.0:
        raise MapError(
            f"{path}: thresholds must be 0 <= free_thresh < occupied_thresh <= 1, "
            f"got free_thresh {free} and occupied_thresh {occupied}"
        )
    image = fields["image"]
    if not (isinstance(image, str) and image):
        raise MapError(f"{path}: image must be the name of a file, got {image!r}")
    channels = _channels(path, path.parent / image)  # an absolute name stays absolute
    occupancy = _occupancy(channels, str(mode), bool(negate), occupied, free)
    return GridMap(np.ascontiguousarray(occupancy[::-1]), resolution, np.array(origin, float))


def _fields(path: Path) -> Dict[str, Any]:
    import yaml  # here, because the rest of the package reads no yaml

    try:
        text = path.read_text()
    except (OSError, UnicodeDecodeError) as err:
        raise MapError(f"{path}: cannot be read: {_reason(err)}") from err
    try:
        fields = yaml.safe_load(text)
    except yaml.YAMLError as err:
        raise MapError(f"{path}: is no yaml: {' '.join(str(err).split())}") from err
    if not isinstance(fields, dict):
        raise MapError(f"{path}: is no map: expected the keys {', '.join(REQUIRED)}")
    missing = [key for key in REQUIRED if key not in fields]
    if missing:
        raise MapError(f"{path}: missing {', '.join(missing)}; a map needs {', '.join(REQUIRED)}")
    return fields


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _number(path: Path, fields: Dict[str, Any], key: str) -> float:
    if not _is_number(fields[key]):
        raise MapError(f"{path}: {key} must be a finite number, got {fields[key]!r}")
    return float(fields[key])


def _image_module() -> Any:
    from PIL import Image  # slow to import, and only map files need it

    return Image


def _channels(path: Path, path_image: Path) -> np.ndarray:
    """The image as (H, W, C) of 0..255, top row first; C is 1 grey, 3 colour or 4 with alpha."""
    if not path_image.is_file():
        raise MapError(f"{path}: its image {path_image} does not exist")
    Image = _image_module()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # large floors are legitimate
        try:
            image = Image.open(path_image)
        except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as err:
            raise MapError(f"{path}: its image {path_image} cannot be read: {_reason(err)}") from err
        try:
            image.load()
        except (OSError, ValueError, SyntaxError, IndexError) as err:
            raise MapError(
                f"{path}: the data of its image {path_image} do not fit its {image.width} x "
                f"{image.height} pixels: the file is cut short or damaged"
            ) from err
    if image.mode.startswith("I"):  # 16 bit: the high byte, as SDL shows it to map_server
        grey = np.asarray(image).astype(np.int64) >> 8
        return np.clip(grey, 0, 255).astype(np.uint8)[..., None]
    if image.mode == "P":  # map_server would read the palette index as the colour
        image = image.convert("RGBA" if "transparency" in image.info else "RGB")
    elif image.mode == "LA":
        image = image.convert("RGBA")
    elif image.mode not in ("L", "RGB", "RGBA"):
        image = image.convert("L" if image.mode == "1" else "RGB")
    pixels = np.asarray(image)
    return pixels[..., None] if pixels.ndim == 2 else pixels


def _occupancy(channels: np.ndarray, mode: str, negate: bool, occupied: float, free: float) -> np.ndarray:
    """(H, W) int8 by map_server's rules from channels (H, W, C), rows in the same order."""
    has_alpha = channels.shape[-1] == 4
    averaged = channels[..., :3] if has_alpha and mode != "trinary" else channels
    count = averaged.shape[-1]
    total = averaged[..., 0] if count == 1 else averaged.sum(axis=-1, dtype=np.uint16)  # (H, W)
    grey = np.arange(255 * count + 1) / count  # for every possible total: maps have millions of cells
    if negate:
        grey = 255.0 - grey
    if mode == "raw":  # -1 is 255 in a byte; above 100 there is no percentage
        return np.where(grey <= 100.0, np.floor(grey), UNKNOWN).astype(np.int8)[total]
    probability = (255.0 - grey) / 255.0
    between = np.full(grey.shape, float(UNKNOWN))
    if mode == "scale":
        between = np.floor(1.0 + 98.0 * (probability - free) / (occupied - free))
    by_total = np.select([probability > occupied, probability < free], [100.0, 0.0], between).astype(np.int8)
    occupancy = by_total[total]
    if mode == "scale" and has_alpha:  # a transparent cell is unknown unless its colour is beyond doubt
        occupancy[(channels[..., 3] == 0) & (occupancy > 0) & (occupancy < 100)] = UNKNOWN
    return occupancy


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
