"""Beams that passed or ended at walls -> the probability of glass of each wall cell.

A wall seldom lets a beam through, a pane mostly does unless it is looked at head on, and where a mapped
thing is gone every beam passes. Every beam that was known to cross a surface of the map is evidence on
both questions: can it be seen through, and is it still there? Each is kept as log odds per cell. The
seed document glass_localization.txt has no such memory (its cases are decided scan by scan); the
formulation is ours. H rows, W columns, B beams.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Tuple

import numpy as np

from glass_nav.localization.beam_classification import glass_return_model
from glass_nav.localization.beam_classification.expected_ranges import ExpectedRanges
from glass_nav.localization.beam_classification.range_residuals import RangeResiduals
from glass_nav.world.grid_map import UNKNOWN, GridMap

_MIN_COS = 0.3  # a wall seen flatter than that is passed or met by chance
_BEHIND_M = 0.3  # a beam that goes on for so long has passed
_ENDED_SIGMAS = 2.5
_GONE_ANSWERS = 0.06  # by chance; as many as a pane far from head on, which therefore proves nothing
_THERE = 0.95  # chance of what is seen through to be glass, before it answered or failed to


def crossings(
    measured_m: np.ndarray, references: ExpectedRanges, residuals: RangeResiduals
) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What a scan says about walls: cell, incidence and passed of GlassMap.learn().

    Only beams for which all samples agree: a wall that stands in the beam's way from each of them was passed, not
    missed at its edge. The incidence of a cell without a normal is NaN.

    Args:
        measured_m: (B,) ranges by REP 117.
        references: of preliminary samples around a pose that is believed.
        residuals: where in a wall beams end, and how widely.
    """
    first_m, cos, cell = references.range_m[0], references.cos_incidence[0], references.cell[0, 0]
    nearest, farthest = first_m.min(axis=0), first_m.max(axis=0)  # (B,)
    depth = residuals.depth_share * references.thickness_m[0, 0]
    with np.errstate(invalid="ignore"):
        across = np.abs((measured_m - first_m[0]) * cos[0] - depth)
        passed = measured_m > farthest + (references.thickness_m[0, 0] + depth) / cos[0] + _BEHIND_M
        ended = (across <= _ENDED_SIGMAS * residuals.sigma_m) & (farthest - nearest < _BEHIND_M / cos[0])
    incidence = references.pane_incidence[0]
    clear = (cell >= 0) & (cos[0] >= _MIN_COS) & np.isfinite(measured_m) & np.isfinite(farthest) & (passed | ended)
    return cell[clear], incidence[clear], passed[clear]


def reach_m(residuals: RangeResiduals) -> float:
    """How far behind the end of a beam crossings() asks for first surfaces."""
    return (_ENDED_SIGMAS * residuals.sigma_m + _BEHIND_M) / _MIN_COS


@dataclass(frozen=True)
class GlassEvidence:
    """How much a crossing of a wall of the map says."""

    glass_prior: float = 0.15  # chance of a wall cell to be seen through before any beam crossed it
    glass_wall_leak: float = 0.03  # share of the beams that pass a solid wall: errors of map and pose
    glass_memory: float = 6.0  # largest log odds that beams can add up to: a door may be opened

    def __post_init__(self) -> None:
        for name in ("glass_prior", "glass_wall_leak"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise ValueError(f"~{name} must be in (0, 1), got {getattr(self, name)}")
        if not (np.isfinite(self.glass_memory) and self.glass_memory >= 0.0):
            raise ValueError(f"~glass_memory must be finite and >= 0, got {self.glass_memory}")


class GlassMap:
    """Log odds of being glass for each wall cell of one map."""

    _SPREAD = (1.0, 0.7, 0.3)  # weight of a crossing for cells 0, 1, 2 away
    _SCAN_SHARE = (0.25, 0.7)  # of a scan's evidence on each question: scans a step apart err alike

    def __init__(self, grid_map: GridMap, evidence: GlassEvidence) -> None:
        self._shape = grid_map.occupancy.shape
        self._occupied = np.pad(grid_map.occupied, 2).ravel()
        self._stride = self._shape[1] + 4
        # Log odds that beams added: can be seen through, and is there though it can; bordered by 2 cells.
        self._log_odds = np.zeros((2, len(self._occupied)), np.float32)
        self._crossed = np.zeros(len(self._occupied), bool)
        self._kernel = self._neighbours()
        self.weigh_by(evidence)

    def weigh_by(self, evidence: GlassEvidence) -> None:
        """What a crossing says from now on; what was learnt before stays."""
        self._evidence = evidence
        self._prior = np.log([[evidence.glass_prior / (1.0 - evidence.glass_prior)], [_THERE / (1.0 - _THERE)]])

    def chances(self, cell: np.ndarray) -> np.ndarray:
        """(2, ...) chances of flat cells (...) of the map: to be seen through, and if so to be there, which is glass
        and not a thing that is gone; the priors for -1.
        """
        at = self._bordered(np.maximum(cell, 0)).ravel()
        log_odds = np.where(cell.ravel() >= 0, self._log_odds[:, at], 0.0)
        return _chance(self._prior + log_odds).reshape(2, *cell.shape)

    def occupancy(self) -> np.ndarray:
        """(H, W) int8 [percent]: probability of glass of each wall cell; -1 where no beam was evidence.

        What lets beams pass and never answered any has not proved to be there: at most 50.
        """
        prior = np.stack([self._prior[0], [0.0]])
        chances = _chance(prior + self._log_odds[:, self._crossed])
        percent = np.full(len(self._crossed), UNKNOWN, np.int8)
        percent[self._crossed] = np.rint(100.0 * np.prod(chances, axis=0))
        return percent.reshape(-1, self._stride)[2:-2, 2:-2].copy()

    def learn(self, cell: np.ndarray, incidence_rad: np.ndarray, passed: np.ndarray) -> None:
        """Take in one scan.

        Args:
            cell: (B,) flat cells that beams crossed or ended at, known for sure.
            incidence_rad: (B,) angle to the wall's normal there.
            passed: (B,) bool: went on behind it; else it ended there.
        """
        if not len(cell):
            return
        says = self._says(incidence_rad, passed)
        offsets, weights = self._kernel
        at = (self._bordered(cell)[:, None] + offsets).ravel()
        share = np.tile(weights, len(cell))
        touched, group = np.unique(at, return_inverse=True)
        walls = self._occupied[touched]
        total = np.bincount(group, share)
        limit = self._evidence.glass_memory
        for log_odds, said, scan_share in zip(self._log_odds, says, self._SCAN_SHARE):
            # A wall cell that many beams of one scan hit has one piece of evidence, not many.
            mean = np.bincount(group, share * np.repeat(said, len(offsets))) / total
            added = scan_share * mean[walls] * np.minimum(total[walls], 1.0)
            log_odds[touched[walls]] = np.clip(log_odds[touched[walls]] + added, -limit, limit)
        self._crossed[touched[walls]] = True

    def _says(self, incidence_rad: np.ndarray, passed: np.ndarray) -> "Tuple[np.ndarray, np.ndarray]":
        """(B,) log odds of glass against wall, and against gone. What lidar it is is not known: each may be."""
        leak = self._evidence.glass_wall_leak
        least, most = glass_return_model.least(incidence_rad), glass_return_model.most(incidence_rad)
        return (
            np.where(passed, np.log((1.0 - least) / leak), np.log(most / (1.0 - leak))),
            np.where(passed, np.log((1.0 - least) / (1.0 - _GONE_ANSWERS)), np.log(most / _GONE_ANSWERS)),
        )

    def _bordered(self, cell: np.ndarray) -> np.ndarray:
        row, column = np.divmod(cell, self._shape[1])
        return (row + 2) * self._stride + column + 2

    def _neighbours(self) -> Tuple[np.ndarray, np.ndarray]:
        """Offsets (25,) of the cells around one, and what a crossing counts there."""
        step = np.arange(-2, 3)
        ring = np.maximum(np.abs(step)[:, None], np.abs(step))
        return ((step[:, None] * self._stride + step).ravel(), np.array(self._SPREAD)[ring].ravel())


def _chance(log_odds: np.ndarray) -> np.ndarray:
    return 1.0 / (1.0 + np.exp(-log_odds))
