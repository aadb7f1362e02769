"""A pane of glass that the map lacks: its position, and the evidence for it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

_SHORTEST_M = 1e-6


@dataclass(frozen=True, eq=False)
class Pane:
    """A straight piece of glass in the frame map."""

    start_m: np.ndarray  # (2,)
    end_m: np.ndarray  # (2,)
    probability: float = 1.0  # that it is glass
    returns: int = 0  # kept scans x pieces of it: the beam near its normal returned from it
    passes: int = 0  # the same, the oblique beam went through
    seen_from_m: float = 0.0  # spread of the robot's places
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((2, 2)))  # of offset [m] and direction [rad]

    def __post_init__(self) -> None:
        for name in ("start_m", "end_m"):
            value = getattr(self, name)
            if np.shape(value) != (2,) or not np.all(np.isfinite(value)):
                raise ValueError(f"a pane goes from x, y to x, y, all finite, got {np.asarray(value).tolist()}")
        if not self.length_m > _SHORTEST_M:
            (x0, y0), (x1, y1) = self.start_m, self.end_m
            raise ValueError(f"a pane needs a length > 0 m, got one from ({x0:g}, {y0:g}) to ({x1:g}, {y1:g}) m")
        if not 0.0 <= self.probability <= 1.0:
            raise ValueError(f"the probability of a pane must be in [0, 1], got {self.probability}")

    @property
    def length_m(self) -> float:
        return float(np.hypot(*(np.asarray(self.end_m) - self.start_m)))

    @property
    def direction(self) -> np.ndarray:
        """(2,) of length 1, from start to end."""
        return (np.asarray(self.end_m, float) - self.start_m) / self.length_m
