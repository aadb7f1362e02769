"""A second opinion on the glass map: what is learnt and asked, in numpy. The tests hold the compiled one against it."""

from __future__ import annotations

from typing import Tuple

import numpy as np

from glass_nav.localization.beam_classification.glass_map import (
    _GONE,
    _OPAQUE_GONE,
    _OPAQUE_THERE,
    _OPENING_M,
    GlassMap,
)


class SlowGlassMap(GlassMap):
    """As GlassMap."""

    def chances(self, cell: np.ndarray) -> np.ndarray:
        """As GlassMap.chances()."""
        found, at = self._numbers(np.where(cell >= 0, self._bordered(cell), -1).ravel())
        log_odds = np.zeros((2, cell.size))
        log_odds[:, found] = self._log_odds[:, at[found]]
        return _chance(self._prior + log_odds).reshape(2, *cell.shape)

    def is_gone(self, cell: np.ndarray, axis_rad: np.ndarray, opaque: np.ndarray) -> np.ndarray:
        """As GlassMap.is_gone()."""
        walls, at = self._numbers(np.where(cell >= 0, self._bordered(cell), -1))
        own = np.where(walls, self._log_odds[1, at], 0.0) if len(self._wall) else np.zeros(len(cell))
        gone = opaque & (_chance(np.log(_OPAQUE_THERE / (1.0 - _OPAQUE_THERE)) + own) < _OPAQUE_GONE)
        known = np.flatnonzero((own < 0.0) & ~gone & np.isfinite(axis_rad))  # only few: the rest costs milliseconds
        if not len(known):
            return gone
        normal_rad = (axis_rad[known] - self._grid_yaw_rad)[:, None, None]
        reach = max(1, round(_OPENING_M / self._resolution_m))
        along, across = np.arange(-reach, reach + 1)[:, None], np.arange(-1, 2)  # walls of cells are staircases
        row, column = (index[:, None, None] for index in np.divmod(cell[known], self._shape[1]))
        rows = np.rint(row + along * np.cos(normal_rad) + across * np.sin(normal_rad)).astype(int)
        columns = np.rint(column - along * np.sin(normal_rad) + across * np.cos(normal_rad)).astype(int)
        np.clip(rows, 0, self._shape[0] - 1, out=rows)
        np.clip(columns, 0, self._shape[1] - 1, out=columns)
        found, at = self._numbers(self._bordered(rows * self._shape[1] + columns).ravel())
        learnt = np.zeros(rows.shape)  # (B, 2 reach + 1, 3)
        learnt.flat[found] = self._log_odds[1, at[found]]
        odds = np.where(learnt.max(axis=2) > -learnt.min(axis=2), learnt.max(axis=2), learnt.min(axis=2))
        after, before = odds[:, reach + 1 :], odds[:, reach - 1 :: -1]
        opening = odds[:, reach] + sum(np.minimum(side.cumsum(axis=1).min(axis=1), 0.0) for side in (before, after))
        spread = 2.0 * sum(self._SPREAD) - self._SPREAD[0]  # so many cells learn from a beam
        gone[known] = _chance(self._prior[1] + opening / spread) < _GONE
        return gone

    def learn(self, cell: np.ndarray, incidence_rad: np.ndarray, passed: np.ndarray) -> None:
        """As GlassMap.learn()."""
        if not len(cell):
            return
        evidence = self._evidence_of(incidence_rad, passed)
        offsets, weights = self._neighbours()
        at = (self._bordered(cell)[:, None] + offsets).ravel()
        share = np.tile(weights, len(cell))
        touched, group = np.unique(at, return_inverse=True)
        walls, number = self._numbers(touched)
        number = number[walls]
        total = np.bincount(group, share)
        limit = self._evidence.glass_memory
        for log_odds, added_odds, scan_share in zip(self._log_odds, evidence, self._SCAN_SHARE):
            # Many beams of one scan at a wall cell are one piece of evidence.
            mean = np.bincount(group, share * np.repeat(added_odds, len(offsets))) / total
            added = scan_share * mean[walls] * np.minimum(total[walls], 1.0)
            log_odds[number] = np.clip(log_odds[number] + added, -limit, limit)
        self._crossed[number] = True

    def _neighbours(self) -> Tuple[np.ndarray, np.ndarray]:
        """Offsets (25,) of the cells around one, and what a crossing counts there."""
        step = np.arange(-2, 3)
        ring = np.maximum(np.abs(step)[:, None], np.abs(step))
        return ((step[:, None] * self._stride + step).ravel(), np.array(self._SPREAD)[ring].ravel())


def _chance(log_odds: np.ndarray) -> np.ndarray:
    return 1.0 / (1.0 + np.exp(-log_odds))
