"""Reports the panes that the map lacks, and stores them with the glass map in a file for the next run."""

from __future__ import annotations

import logging
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Optional

from glass_nav.localization.method import PoseFilter
from glass_nav.world import panes_file
from glass_nav.world.grid_map import GridMap
from glass_nav.world.panes_file import PanesFileError

_NEWS_M = 1.0  # of glass more than was told before
_NEWS_SHARE = 0.5

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class PanesFilePath:
    """The file for panes and the glass map."""

    panes_file: str = ""  # "": nowhere

    def __post_init__(self) -> None:
        if self.panes_file and not self.path.parent.is_dir():
            raise ValueError(f"~panes_file must lie in a folder that exists, got {self.panes_file!r}")

    @property
    def path(self) -> Path:
        """The file; ~ is the user's home."""
        return Path(os.path.expanduser(self.panes_file))


class PanesMemory:
    """Reads the file when a localizer begins, tells what was found, writes it when asked and at the end."""

    def __init__(self, file: PanesFilePath) -> None:
        self._path = file.path if file.panes_file else None
        self._told_m = 0.0

    def recall(self, localizer: PoseFilter, grid_map: GridMap) -> None:
        """Give a localizer that has just begun on this map what the file holds; one line says what, or why not."""
        self._told_m = 0.0
        if self._path is None:
            return
        try:
            kept = panes_file.load(self._path, grid_map)
            localizer.remember(kept.panes, kept.arrays)
        except FileNotFoundError:
            _log.info(f"{self._path} does not exist yet: service ~save_panes and the end of the node write it")
        except ValueError as err:
            _log.error(f"{err if isinstance(err, PanesFileError) else f'{self._path}: {err}'}; it is not used")
        else:
            self._told_m = _length_m(localizer)
            _log.info(f"{self._path}: {len(kept.panes)} panes that the map lacks, {self._told_m:.1f} m of them in use")

    def tell(self, localizer: PoseFilter) -> None:
        """A log line if markedly more glass was found than was reported before."""
        if _length_m(localizer) >= self._told_m + max(_NEWS_M, _NEWS_SHARE * self._told_m):
            self._told_m = _length_m(localizer)
            _log.warning(self.summary(localizer))

    def summary(self, localizer: PoseFilter) -> Optional[str]:
        """How much glass the map lacks and how to draw it in; None if none was found."""
        count = len(localizer.unmapped_panes)
        if not count:
            return None
        lacks = f"the map lacks {_length_m(localizer):.1f} m of glass ({count} pane{'' if count == 1 else 's'})"
        if self._path is None:
            return f"{lacks}; glass_nav map panes BAG --map MAP.yaml --out DIR draws it into the map"
        return f"{lacks}; call ~save_panes, then glass_nav map draw MAP.yaml --panes {self._path} --out DIR draws it into the map"

    def save(self, localizer: PoseFilter, grid_map: GridMap) -> str:
        """Write the file; what was written, in words.

        Raises:
            ValueError: there is no ~panes_file, it holds something else, or it cannot be written; one line.
        """
        if self._path is None:
            raise ValueError("~panes_file is not set: there is nowhere to write the panes to")
        if self._path.exists():
            try:
                panes_file.load(self._path, grid_map)
            except PanesFileError as err:
                raise ValueError(f"{err}; it is left as it is") from err
        panes = localizer.found_panes
        try:
            panes_file.save(self._path, grid_map, panes, localizer.glass_map.arrays())
        except OSError as err:
            raise ValueError(f"{self._path}: cannot be written: {err.strerror or err}") from err
        return f"{len(panes)} panes ({_length_m(localizer):.1f} m in use) and the glass map written to {self._path}"

    def keep(self, localizer: PoseFilter, grid_map: GridMap) -> None:
        """Write the file, if there is one and anything to write, before this localizer ends; a line if that fails."""
        if self._path is None or not (localizer.found_panes or len(localizer.glass_map.arrays()["glass_cell"])):
            return
        try:
            _log.info(self.save(localizer, grid_map))
        except ValueError as err:
            _log.error(f"panes are not kept: {err}")


def _length_m(localizer: PoseFilter) -> float:
    return sum((pane.length_m for pane in localizer.unmapped_panes), 0.0)
