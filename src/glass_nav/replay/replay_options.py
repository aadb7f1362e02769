"""The options of `glass_nav replay`, without the command line."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Optional, Tuple

from glass_nav.recording.recording import LogOptions
from glass_nav.replay.window import Window

Triple = Tuple[float, float, float]


@dataclass(frozen=True)
class StartOptions:
    """The initial pose; by default the first pose of the ground truth, else that of the parameters."""

    pose: Optional[Triple] = None  # x [m], y [m], yaw [rad] in the map
    variance: Optional[Triple] = None  # of x [m^2], y [m^2], yaw [rad^2]; None: that of the parameters
    everywhere: bool = False  # anywhere in the map, whatever the pose


@dataclass(frozen=True)
class LogUse:
    """What to read from a log, and the initial pose: common to all runs over it."""

    source: LogOptions = field(default_factory=LogOptions)
    start: StartOptions = field(default_factory=StartOptions)
    window: Window = field(default_factory=Window)


@dataclass(frozen=True)
class ReplayOptions:
    """The options of one run over one log."""

    log: Tuple[Path, ...]  # several: the parts of one run
    map: Path
    params: Optional[Path] = None  # None: the defaults
    seed: int = 0  # of the filter's random numbers
    use: LogUse = field(default_factory=LogUse)

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise ValueError(f"--seed must be >= 0, got {self.seed}")
