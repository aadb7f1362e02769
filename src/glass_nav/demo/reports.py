"""The reports that the demo has received from a robot that wakes up, by stamp."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Deque, Dict, List, Optional, Tuple

import numpy as np

from glass_nav.geometry.trajectory import Trajectory
from glass_nav.topology.observations import Meetpoint, Traversal
from glass_nav.vocabulary import LocalizationState, SearchState
from glass_nav.world.grid_map import GridMap


@dataclass(frozen=True)
class SearchNews:
    """The last report of the search."""

    stamp_ns: int  # of the meetpoint; 0: of none
    state: SearchState
    reason: str
    depth: int  # edges driven
    candidates: int
    turn: str  # "" if there is none to take


@dataclass(frozen=True)
class Candidates:
    """The candidates of the search."""

    total: int
    nodes: List[int]  # of the first candidates
    edges: List[int]  # that the robot came along
    poses: np.ndarray  # (K, 3)


class Reports:
    """Filled by a listener, read by the demo."""

    def __init__(self) -> None:
        self.truth: Dict[int, np.ndarray] = {}  # (3,) poses by stamp
        self.poses: Dict[int, np.ndarray] = {}  # (3,) of the localization, by stamp
        self.meetpoints: Dict[int, Meetpoint] = {}
        self.traversals: Dict[int, Traversal] = {}
        self.candidates: Dict[int, Candidates] = {}
        self.localization: Optional[LocalizationState] = None
        self.initial_pose: Optional[Tuple[int, np.ndarray]] = None  # stamp [ns] and pose (3,)
        self.grid_map: Optional[GridMap] = None
        self.search: Optional[SearchNews] = None
        self.rows: Deque[SearchNews] = deque()  # of the search forest, not shown yet

    def take_search(self, news: SearchNews) -> None:
        """Keep it; the first of each meetpoint is a row of the search forest."""
        if news.stamp_ns and (self.search is None or self.search.stamp_ns != news.stamp_ns):
            self.rows.append(news)
        self.search = news

    @property
    def simulated_s(self) -> float:
        """Time of the newest truth: the clock may be later than the reports."""
        return max(self.truth, default=0) * 1e-9

    @property
    def newest_truth(self) -> np.ndarray:
        """(3,) where the robot is."""
        return self.truth[max(self.truth)]

    def true_trajectory(self) -> Trajectory:
        """The whole true trajectory."""
        stamps_ns = np.array(sorted(self.truth), np.int64)
        return Trajectory(stamps_ns, np.array([self.truth[stamp] for stamp in stamps_ns.tolist()]).reshape(-1, 3))

    def true_path_m(self, from_ns: float = 0, to_ns: float = math.inf) -> np.ndarray:
        """(N, 2) between two stamps."""
        path = [self.truth[stamp][:2] for stamp in sorted(self.truth) if from_ns <= stamp <= to_ns]
        return np.array(path).reshape(-1, 2)
