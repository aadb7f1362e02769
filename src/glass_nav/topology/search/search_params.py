"""How a search in the atlas is done."""

from __future__ import annotations

from dataclasses import dataclass, field

from glass_nav.hypotheses.followed_poses import MAX_LEAD
from glass_nav.params import choice, number
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
    least_explained: float = 0.6  # share of a scan that the map must explain from a candidate; where scans are judged
    # before LOST: another one begins where nothing matches any more; where scans are judged
    searches: int = number(6, 1, 1000)
    follow_places: int = number(4, 0, 1000)  # places whose scans a followed pose must explain; 0: no pose is followed
    follow_lead: float = 0.15  # by which the best followed pose must lead, in the mean share of the scans

    def __post_init__(self) -> None:
        if self.vote_mode not in VOTE_MODES:
            raise ValueError(f"~vote_mode must be {' or '.join(VOTE_MODES)}, got {self.vote_mode!r}")
        if self.confirm_edges < 0:
            raise ValueError(f"~confirm_edges must be >= 0, got {self.confirm_edges}")
        if not 0 <= self.max_detection_errors <= 2:
            raise ValueError(f"~max_detection_errors must be 0, 1 or 2, got {self.max_detection_errors}")
        if not 0.0 <= self.least_explained < 1.0:
            raise ValueError(f"~least_explained must be in [0, 1), got {self.least_explained}")
        if self.searches < 1:
            raise ValueError(f"~searches must be >= 1, got {self.searches}")
        if self.follow_places < 0:
            raise ValueError(f"~follow_places must be >= 0, got {self.follow_places}")
        if not 0.0 < self.follow_lead <= MAX_LEAD:
            raise ValueError(f"~follow_lead must be in (0, {MAX_LEAD:g}], got {self.follow_lead}")

    @property
    def document(self) -> bool:
        """Whether the document's procedure is asked for."""
        return self.vote_mode == "seed"
