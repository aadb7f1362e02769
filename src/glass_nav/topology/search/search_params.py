"""Parameters of a search in the atlas."""

from __future__ import annotations

from dataclasses import dataclass, field

from glass_nav.params import choice
from glass_nav.topology.search.edge_segments import SegmentTest
from glass_nav.topology.search.matching import Tolerances

VOTE_MODES = ("best", "seed")


@dataclass(frozen=True)
class SearchParams:
    """How the search is done."""

    vote_mode: str = choice("best", VOTE_MODES)  # best: fewest expected survivors; seed: the document's procedure
    confirm_edges: int = 2  # edges that must match after one candidate is left
    max_detection_errors: int = 2  # missed or spurious meetpoints; not with vote_mode seed
    use_edge_angles: bool = True  # as evidence; not with vote_mode seed
    tolerances: Tolerances = field(default_factory=Tolerances)
    segments: SegmentTest = field(default_factory=SegmentTest)
    use_scans: bool = True  # as evidence, where there are scans, odometry and a map; not with vote_mode seed
    least_explained: float = 0.6  # share of the walls seen that the map must explain from a place that is confirmed

    def __post_init__(self) -> None:
        if self.vote_mode not in VOTE_MODES:
            raise ValueError(f"~vote_mode must be {' or '.join(VOTE_MODES)}, got {self.vote_mode!r}")
        if self.confirm_edges < 0:
            raise ValueError(f"~confirm_edges must be >= 0, got {self.confirm_edges}")
        if not 0 <= self.max_detection_errors <= 2:
            raise ValueError(f"~max_detection_errors must be 0, 1 or 2, got {self.max_detection_errors}")
        if not 0.0 <= self.least_explained < 1.0:
            raise ValueError(f"~least_explained must be in [0, 1), got {self.least_explained}")

    @property
    def document(self) -> bool:
        """Whether the document's procedure is asked for."""
        return self.vote_mode == "seed"
