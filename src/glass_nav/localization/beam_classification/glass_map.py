"""Learns the probability of glass of each wall cell from beams that passed it or ended there.

A wall seldom lets a beam pass, a pane mostly does except at normal incidence, and every beam passes where a mapped
object is gone. Each beam that crossed a mapped surface is evidence on two questions: can the surface be seen through,
and is it still there? Both are kept as log odds per cell. The seed document glass_localization.txt has no such memory
(it decides cases scan by scan); the formulation is ours. H rows, W columns, B beams.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, Mapping, Sequence, Tuple

import numpy as np

from glass_nav import _beam_vote
from glass_nav.localization.beam_classification import glass_return_model
from glass_nav.localization.beam_classification.expected_ranges import ExpectedRanges
from glass_nav.localization.beam_classification.range_residuals import RangeResiduals
from glass_nav.params import number
from glass_nav.world.grid_map import UNKNOWN, GridMap

_MIN_COS = 0.3  # at more grazing incidence a wall is passed or met by chance
_BEHIND_M = 0.3  # a beam that goes on this far has passed
_ENDED_SIGMAS = 2.5
_GONE_RETURNS = 0.06  # share by chance; that of a pane at oblique incidence, which is therefore no evidence
_THERE = 0.95  # prior probability that what is seen through is glass and not gone
_OPENING_M = 0.5  # from a cell to the ends of the opening that it is in, at most
_GONE = 0.05  # probability of being there below which it is gone: a pane taken for an open door is run into
_OPAQUE_THERE, _OPAQUE_GONE = 0.05, 0.5  # prior and limit for what cannot be glass: if beams pass, it was moved


def crossings(
    measured_m: np.ndarray, expected: ExpectedRanges, residuals: RangeResiduals
) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The evidence of a scan about walls: cell, incidence and passed of GlassMap.learn().

    Only beams for which all samples agree: a wall that the beam crosses from each of them was passed, not
    missed at its edge. The incidence of a cell without a normal is NaN.

    Args:
        measured_m: (B,) ranges by REP 117.
        expected: of preliminary samples around a trusted pose.
        residuals: where in a wall beams end, and how widely.
    """
    first_m, cos, cell = expected.range_m[0], expected.cos_incidence[0], expected.cell[0, 0]
    nearest, farthest = first_m.min(axis=0), first_m.max(axis=0)  # (B,)
    depth = residuals.depth_share * expected.thickness_m[0, 0]
    with np.errstate(invalid="ignore"):
        across = np.abs((measured_m - first_m[0]) * cos[0] - depth)
        passed = measured_m > farthest + (expected.thickness_m[0, 0] + depth) / cos[0] + _BEHIND_M
        ended = (across <= _ENDED_SIGMAS * residuals.sigma_m) & (farthest - nearest < _BEHIND_M / cos[0])
    incidence = expected.pane_incidence[0]
    clear = (cell >= 0) & (cos[0] >= _MIN_COS) & np.isfinite(measured_m) & np.isfinite(farthest) & (passed | ended)
    return cell[clear], incidence[clear], passed[clear]


def reach_m(residuals: RangeResiduals) -> float:
    """How far behind the end of a beam crossings() needs first surfaces."""
    return (_ENDED_SIGMAS * residuals.sigma_m + _BEHIND_M) / _MIN_COS


@dataclass(frozen=True)
class GlassEvidence:
    """How strong the evidence of one crossing is."""

    glass_prior: float = number(0.15, 0.0, 1.0)  # prior probability that a wall cell can be seen through
    glass_wall_leak: float = number(0.03, 0.0, 1.0)  # share of the beams that pass a solid wall: errors of map and pose
    glass_memory: float = number(6.0, 0.0, 100.0)  # limit of the log odds that beams add: a door may be opened

    def __post_init__(self) -> None:
        for name in ("glass_prior", "glass_wall_leak"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise ValueError(f"~{name} must be in (0, 1), got {getattr(self, name)}")
        if not (np.isfinite(self.glass_memory) and self.glass_memory >= 0.0):
            raise ValueError(f"~glass_memory must be finite and >= 0, got {self.glass_memory}")


class GlassMap:
    """Log odds of being glass for each wall cell of one map."""

    _SPREAD = (1.0, 0.7, 0.3)  # weight of a crossing for cells 0, 1, 2 away
    _SCAN_SHARE = (0.25, 0.7)  # of a scan's evidence on each question: scans a step apart have the same errors

    def __init__(self, grid_map: GridMap, evidence: GlassEvidence) -> None:
        self._shape = grid_map.occupancy.shape
        self._resolution_m, self._grid_yaw_rad = grid_map.resolution_m, float(grid_map.map_from_grid[2])
        self._stride = self._shape[1] + 4  # cells are counted as if the map had a border of 2
        self._mapped = self._walls(grid_map)
        self._drawn_in = np.zeros(0, np.int64)  # cells of panes that the map lacks
        self._look_at(self._mapped)
        # Of each wall: log odds that beams added: can be seen through, and is there though it can.
        self._log_odds = np.zeros((2, len(self._wall)), np.float32)
        self._crossed = np.zeros(len(self._wall), bool)
        self.reconfigure(evidence)

    def reconfigure(self, evidence: GlassEvidence) -> None:
        """Use other evidence per crossing from now on; what was learnt stays."""
        self._evidence = evidence
        self._prior = np.log([[evidence.glass_prior / (1.0 - evidence.glass_prior)], [_THERE / (1.0 - _THERE)]])

    def redraw(self, grid_map: GridMap, panes: Sequence[Tuple[np.ndarray, float]]) -> None:
        """Go on with the same map after panes were drawn in; what was learnt of the walls stays.

        Args:
            grid_map: with the panes.
            panes: of each, its flat cells and its probability.
        """
        before, self._drawn_in = self._drawn_in, np.zeros(0, np.int64)
        odds: Dict[int, float] = {}  # of new cells
        for cell, probability in panes:
            cells = np.setdiff1d(self._bordered(cell), self._mapped)
            believed = min(np.log(probability / max(1.0 - probability, 1e-9)), self._evidence.glass_memory)
            odds.update(dict.fromkeys(np.setdiff1d(cells, before).tolist(), believed))
            self._drawn_in = np.union1d(self._drawn_in, cells)
        old, log_odds, crossed = self._wall, self._log_odds, self._crossed
        self._look_at(np.union1d(self._walls(grid_map), self._mapped))
        self._log_odds = np.zeros((2, len(self._wall)), np.float32)
        self._crossed = np.zeros(len(self._wall), bool)
        kept, at = self._numbers(old)
        self._log_odds[:, at[kept]], self._crossed[at[kept]] = log_odds[:, kept], crossed[kept]
        new, at = self._numbers(np.array(list(odds), np.int64))
        added = np.array(list(odds.values())) - np.minimum(self._prior, 0.0)
        self._log_odds[:, at[new]], self._crossed[at[new]] = added[:, new], True

    def chances(self, cell: np.ndarray) -> np.ndarray:
        """(2, ...) probabilities for flat cells (...) of the map: that it can be seen through, and if so that it is there,
        that is glass and no object that is gone; the priors for -1.
        """
        through, there = self._prior[:, 0].tolist()
        return self._cells_of_walls.chances(self._log_odds, through, there, cell)

    def is_gone(self, cell: np.ndarray, axis_rad: np.ndarray, opaque: np.ndarray) -> np.ndarray:
        """Whether what the map shows is no longer there, so that a beam behind it passed nothing.

        A door is open if beams passed head on along a piece of wall so often that it is neither glass nor wall.

        The opening is the piece of wall around the cell that speaks most for one, since a door opens as a whole: a robot
        that drives past meets each cell head on in a scan or two.

        Args:
            cell: (B,) flat cells of the map, -1: none.
            axis_rad: (B,) of the normals of the wall there in map; NaN: none, and then it is no door.
            opaque: (B,) bool: it cannot be glass, by its shape: it is gone unless beams returned from it.
        """
        return self._cells_of_walls.gone(
            self._log_odds[1],
            cell,
            axis_rad,
            opaque,
            self._grid_yaw_rad,
            self._prior[1, 0],
            _GONE,
            np.log(_OPAQUE_THERE / (1.0 - _OPAQUE_THERE)),
            _OPAQUE_GONE,
            2.0 * sum(self._SPREAD) - self._SPREAD[0],  # so many cells learn from a beam
            max(1, round(_OPENING_M / self._resolution_m)),
        )

    def occupancy(self) -> np.ndarray:
        """(H, W) int8 [percent]: probability of glass for each wall cell; -1 where no beam crossed it.

        What lets beams pass and never returned one may be gone: at most 50.
        """
        prior = np.stack([self._prior[0], [0.0]])
        chances = _chance(prior + self._log_odds[:, self._crossed])
        percent = np.full(self._shape, UNKNOWN, np.int8)
        row, column = np.divmod(self._wall[self._crossed], self._stride)
        percent[row - 2, column - 2] = np.rint(100.0 * np.prod(chances, axis=0))
        return percent

    def arrays(self) -> Dict[str, np.ndarray]:
        """What was learnt, as named arrays for restore()."""
        learnt = self._crossed
        return {"glass_cell": self._wall[learnt].astype(np.int32), "glass_log_odds": self._log_odds[:, learnt]}

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Restore the arrays() of the same map.

        Raises:
            ValueError: it is not that.
        """
        cell, log_odds = (arrays.get(name, np.zeros(0)) for name in ("glass_cell", "glass_log_odds"))
        if cell.ndim != 1 or log_odds.shape != (2, len(cell)) or not np.isfinite(log_odds).all():
            raise ValueError(f"a glass map needs cells (C,) and log odds (2, C), got {cell.shape}, {log_odds.shape}")
        if len(cell) and not (cell.dtype.kind == "i" and 0 <= cell.min() and cell.max() < self._cells):
            raise ValueError("the cells of a glass map must be whole numbers within its map")
        found, at = self._numbers(cell)
        self._log_odds[:, at[found]], self._crossed[at[found]] = log_odds[:, found], True

    def learn(self, cell: np.ndarray, incidence_rad: np.ndarray, passed: np.ndarray) -> None:
        """Learn from one scan.

        Args:
            cell: (B,) flat cells that beams certainly crossed or ended at.
            incidence_rad: (B,) angle to the wall's normal there.
            passed: (B,) bool: went on behind it; else it ended there.
        """
        if not len(cell):
            return
        evidence = np.stack(self._evidence_of(incidence_rad, passed))
        self._cells_of_walls.learn(
            self._log_odds, self._crossed, cell, evidence, self._SPREAD, self._SCAN_SHARE, self._evidence.glass_memory
        )

    def _evidence_of(self, incidence_rad: np.ndarray, passed: np.ndarray) -> "Tuple[np.ndarray, np.ndarray]":
        """(B,) log odds of glass against wall, and against gone. The lidar is not known: it may be any."""
        leak = self._evidence.glass_wall_leak
        low, high = glass_return_model.min_share(incidence_rad), glass_return_model.max_share(incidence_rad)
        return (
            np.where(passed, np.log((1.0 - low) / leak), np.log(high / (1.0 - leak))),
            np.where(passed, np.log((1.0 - low) / (1.0 - _GONE_RETURNS)), np.log(high / _GONE_RETURNS)),
        )

    @property
    def _cells(self) -> int:
        """Cells of the map with its border."""
        return (self._shape[0] + 4) * self._stride

    def _look_at(self, wall: np.ndarray) -> None:
        """(W,) cells of the walls and of those panes, ascending."""
        self._wall = wall
        self._cells_of_walls = _beam_vote.WallCells(wall, *self._shape)

    def _walls(self, grid_map: GridMap) -> np.ndarray:
        """(W,) occupied cells, ascending."""
        row, column = np.nonzero(grid_map.occupied)
        return (row + 2) * self._stride + column + 2

    def _numbers(self, cell: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """For cells (C,): which of them are walls, and the number of each that is; (C,) bool, (C,) int."""
        if not len(self._wall):
            return np.zeros(len(cell), bool), np.zeros(len(cell), np.intp)
        at = np.minimum(np.searchsorted(self._wall, cell), len(self._wall) - 1)
        return self._wall[at] == cell, at

    def _bordered(self, cell: np.ndarray) -> np.ndarray:
        row, column = np.divmod(cell, self._shape[1])
        return (row + 2) * self._stride + column + 2


def _chance(log_odds: np.ndarray) -> np.ndarray:
    return 1.0 / (1.0 + np.exp(-log_odds))
