"""Where a search session has its atlas from: read from a file or built from the served map, with the visits of robots."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path
from typing import Callable, List, Optional, Tuple

import numpy as np

from glass_nav.log_line import LogLine
from glass_nav.topology.atlas import atlas_file
from glass_nav.topology.atlas.atlas import Atlas, AtlasError
from glass_nav.world.grid_map import GridMap

ReadAtlas = Callable[[], Tuple[str, Atlas]]  # where it was found, and the atlas


class AtlasSource:
    """An atlas is accepted only if it was made from the served map, once one is served."""

    def __init__(self, read: Optional[ReadAtlas], visits_file: str = "") -> None:
        """
        Args:
            read: reads the atlas, whenever it is loaded; None: there is none, it is to be built from the served map.
            visits_file: the statistics of the atlas are read there and saved there; empty: nowhere.
        """
        self._read, self._builds = read, read is None
        self._visits_file = visits_file
        self._map: Optional[Tuple[GridMap, str]] = None  # that is served, and its name for people

    @property
    def builds(self) -> bool:
        """Whether the atlas is built from the served map."""
        return self._builds

    @property
    def has_atlas(self) -> bool:
        """Whether there is an atlas to load."""
        return self._read is not None

    @property
    def map_name(self) -> str:
        """The name of the served map, for people; empty: none was served."""
        return "" if self._map is None else self._map[1]

    def serve(self, grid_map: GridMap, name: str) -> None:
        """Take the map from which the atlas must have been made.

        Args:
            grid_map: the map.
            name: for people, as "that of topic /map".
        """
        self._map = grid_map, name

    def is_served(self, grid_map: GridMap) -> bool:
        """Whether this is the map that was served last."""
        return self._map is not None and self._map[0] is grid_map

    def take_built(self, atlas: Atlas) -> None:
        """Take an atlas that was built from the served map."""
        found_at = f"the atlas built from {self.map_name}"
        self._read = lambda: (found_at, atlas)

    def check(self, atlas: Atlas) -> str:
        """In which way an atlas differs from the served map, though it can be used; empty: in none.

        Raises:
            AtlasError: it was made from another map.
        """
        return "" if self._map is None else atlas.check_map(*self._map)

    def load(self) -> Tuple[Atlas, LogLine]:
        """The atlas with the statistics of its visits, and what to log about it.

        Raises:
            AtlasError: it was made from another map than the served one, or the visits are of another atlas.
            ValueError, OSError: it cannot be read.
        """
        if self._read is None:
            raise AtlasError("no atlas has been built yet")
        found_at, atlas = self._read()
        atlas = self._with_visits(atlas)
        try:
            warning = self.check(atlas)
        except AtlasError as err:
            raise AtlasError(f"{found_at}: {err}") from err
        text = f"{found_at}: {len(atlas.nodes)} nodes, {len(atlas.edges)} edges"
        return atlas, LogLine(f"{text}; it {warning}", logging.WARNING) if warning else LogLine(text)

    def save_visits(self, atlas: Atlas) -> List[LogLine]:
        """Save the atlas with its statistics, if a file is named for them; a failure is logged."""
        if not self._visits_file:
            return []
        try:
            atlas_file.save(atlas, self._visits_file)
        except OSError as err:
            text = f"the atlas with its statistics is not saved: {self._visits_file}: {err.strerror}"
            return [LogLine(text, logging.ERROR)]
        return []

    def _with_visits(self, atlas: Atlas) -> Atlas:
        path = self._visits_file
        if not path or not Path(path).exists():
            return atlas
        kept = atlas_file.load(path)
        if not np.array_equal(kept.darts.node, atlas.darts.node) or len(kept.nodes) != len(atlas.nodes):
            raise AtlasError(
                f"~visits_file {path}: has visits of another atlas: {len(kept.nodes)} nodes and {len(kept.edges)} "
                f"edges, got an atlas of {len(atlas.nodes)} and {len(atlas.edges)}; delete it, or name another file"
            )
        return replace(atlas, visits=kept.visits)
