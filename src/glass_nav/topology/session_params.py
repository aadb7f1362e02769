"""The parameters of a search session; config/topology.yaml explains them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from glass_nav.params import number


@dataclass(frozen=True)
class SessionParams:
    """How searches are begun, fed and reported."""

    check_map: bool = True  # refuse the atlas if another map is served than it was made from
    end_without_atlas: bool = False  # when the atlas is refused, rather than wait for its map
    judge_by_scans: bool = True  # as use_scans of the search, which has taken its place
    search_at_start: bool = True  # with the first meetpoint; else when asked
    publish_initial_pose: bool = True
    listed_candidates: int = number(1000, 1, 100_000)  # at most, with their poses
    # [s] between the stamps of an edge traversal and its meetpoint
    pairing_tolerance_s: float = number(2.0, 0.0, 100.0)
    visits_file: str = ""  # the atlas with its statistics is read there and saved there; empty: nowhere

    def __post_init__(self) -> None:
        if self.listed_candidates < 1:
            raise ValueError(f"~listed_candidates must be >= 1, got {self.listed_candidates}")
        if not (math.isfinite(self.pairing_tolerance_s) and self.pairing_tolerance_s > 0.0):
            raise ValueError(f"~pairing_tolerance_s must be finite and > 0, got {self.pairing_tolerance_s}")
        if self.visits_file and not self.visits_file.endswith((".json", ".npz")):
            raise ValueError(f"~visits_file must be a .json or a .npz, got {self.visits_file!r}")
