"""A compact fingerprint of the free space of a map, which counts the cells that differ from another map.

Two drawings of one floor may differ in the few cells that a line just touches; a hash only shows that the maps are not
identical.
"""

from __future__ import annotations

import base64
import binascii
import zlib
from dataclasses import dataclass, field
from typing import Optional

import numpy as np

from glass_nav.world.grid_map import GridMap


@dataclass(frozen=True)
class FreeSpace:
    """Which cells of a map are free."""

    place: str  # GridMap.place of the map
    packed: bytes = field(repr=False)  # a bit for each cell, row by row

    def __post_init__(self) -> None:
        try:
            rows, columns = (int(word) for word in self.place.split()[:2])
        except ValueError as err:
            raise ValueError(f"the place must begin with rows and columns, got {self.place!r}") from err
        if len(self.packed) != (rows * columns + 7) // 8:
            raise ValueError(f"{rows} x {columns} cells need {(rows * columns + 7) // 8} bytes, got {len(self.packed)}")

    @classmethod
    def of(cls, grid_map: GridMap) -> "FreeSpace":
        """The free space of a map."""
        return cls(grid_map.place, np.packbits(grid_map.free).tobytes())

    @classmethod
    def from_text(cls, place: str, text: str) -> "FreeSpace":
        """Decode the text that `text` returned.

        Raises:
            ValueError: it cannot be decoded, or is of another size.
        """
        try:
            packed = zlib.decompress(base64.b64decode(text, validate=True))
        except (binascii.Error, zlib.error) as err:
            raise ValueError(f"cells must be packed by zlib, in base64: {err}") from err
        return cls(place, packed)

    @property
    def text(self) -> str:
        """The cells for a text file: zlib in base64."""
        return base64.b64encode(zlib.compress(self.packed, 9)).decode()

    @property
    def free_cells(self) -> int:
        """Number of free cells."""
        return int(np.unpackbits(np.frombuffer(self.packed, np.uint8)).sum())

    def cells_that_differ(self, grid_map: GridMap) -> Optional[int]:
        """Number of cells that are free in only one of the two; None if their cells differ in place or size."""
        if grid_map.place != self.place:
            return None
        ours, theirs = (np.frombuffer(packed, np.uint8) for packed in (self.packed, FreeSpace.of(grid_map).packed))
        return int(np.unpackbits(ours ^ theirs).sum())
