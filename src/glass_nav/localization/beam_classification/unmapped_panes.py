"""Adds panes that the map lacks to a second map beside it, from scans at trusted poses.

They are found by panes/pane_finder.py. A pane that is probable enough becomes a surface for the beam classifier. The
map itself, which everything else uses, never changes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import List, Optional, Sequence, Tuple

import numpy as np

from glass_nav.panes.pane_finder import PaneFinder, PaneFinderParams
from glass_nav.params import number
from glass_nav.sensing.scan import Scan
from glass_nav.world import drawn_panes
from glass_nav.world.drawn_panes import PaneError
from glass_nav.world.grid_map import GridMap
from glass_nav.world.pane import Pane

_SAME_M = 0.1  # a pane whose ends move by less stays as it is drawn
_KEPT_PROBABILITY = 0.7  # of the least one: a drawn pane stays until it falls below


@dataclass(frozen=True)
class PaneUse:
    """Whether panes that the map lacks are looked for, and which of them count."""

    find_panes: bool = True
    pane_min_probability: float = number(0.9, 0.0, 1.0)  # of a pane that beams and scan_surfaces respect


class UnmappedPanes:
    """The panes that one map lacks, as far as they are known."""

    def __init__(self, grid_map: GridMap, use: PaneUse, finder: PaneFinderParams, known: Sequence[Pane] = ()) -> None:
        """
        Args:
            grid_map: the map.
            use: of the panes.
            finder: how they are found.
            known: panes in that map that were found before.
        """
        self._map, self._use = grid_map, use
        self._finder = PaneFinder(grid_map, finder, known=known)
        self._drawn: Tuple[Pane, ...] = tuple(pane for pane in known if pane.probability >= use.pane_min_probability)

    def reconfigure(self, use: PaneUse) -> None:
        """Use other limits from the next scan on; what was found stays."""
        self._use = use

    @property
    def drawn(self) -> Tuple[Pane, ...]:
        """The panes that count as surfaces."""
        return self._drawn

    @property
    def candidates(self) -> Tuple[Pane, ...]:
        """All panes found, most probable first."""
        return tuple(self._finder.panes())

    def grid_map(self) -> GridMap:
        """The map with those panes."""
        return drawn_panes.drawn(self._map, self._drawn)

    def observe(self, scan: Scan, map_from_base: np.ndarray, covariance: np.ndarray) -> bool:
        """Learn from a scan at a trusted pose; whether other panes count as surfaces now.

        Args:
            scan: of one lidar.
            map_from_base: (3,) the pose.
            covariance: (3, 3) of it.
        """
        if not self._use.find_panes or not self._finder.observe(scan, map_from_base, covariance):
            return False
        if not self._finder.due:
            return False
        before = self._drawn
        self._drawn = tuple(self._believed())
        return self._drawn != before

    def _believed(self) -> List[Pane]:
        """The probable panes; one that hardly changed stays as it is drawn."""
        found = self._finder.panes()
        least = self._use.pane_min_probability
        believed = []
        for pane, old in zip(found, _alike(found, self._drawn)):
            if old is not None and pane.probability >= _KEPT_PROBABILITY * least:
                believed.append(old)
            elif pane.probability >= least and self._in_map(pane):
                believed.append(pane)
        return believed

    def _in_map(self, pane: Pane) -> bool:
        try:
            return bool(len(drawn_panes.cells(self._map, pane)))
        except PaneError:
            return False


def _alike(panes: Sequence[Pane], drawn: Sequence[Pane]) -> List[Optional[Pane]]:
    """Of each pane the drawn one that is the same, and hardly shorter or elsewhere; None: there is none."""
    if not drawn:
        return [None] * len(panes)
    ends_m = _ends(panes)[:, None]  # (P, 1, 2, 2)
    moved_m = np.minimum(*(np.hypot(*np.moveaxis(ends_m - each, -1, 0)).max(axis=-1) for each in _both_ways(drawn)))
    nearest = moved_m.argmin(axis=1)
    return [
        drawn[number] if moved < _SAME_M else None
        for number, moved in zip(nearest.tolist(), moved_m.min(axis=1).tolist())
    ]


def _both_ways(panes: Sequence[Pane]) -> Tuple[np.ndarray, np.ndarray]:
    """(P, 2, 2) ends from start to end, and from end to start."""
    ends_m = _ends(panes)
    return ends_m, ends_m[:, ::-1]


def _ends(panes: Sequence[Pane]) -> np.ndarray:
    """(P, 2, 2)."""
    return np.array([[pane.start_m, pane.end_m] for pane in panes], float).reshape(-1, 2, 2)
