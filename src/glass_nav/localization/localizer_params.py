"""All parameters of the filter, a struct per model: names, units, and what is allowed."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from glass_nav import machine
from glass_nav.hypotheses.bearing_weights import BearingMixture
from glass_nav.hypotheses.global_search import SearchParams
from glass_nav.localization.beam_classification.beam_classifier import BeamClassifierParams
from glass_nav.localization.beam_classification.case_votes import CaseVote
from glass_nav.localization.beam_classification.glass_map import GlassEvidence
from glass_nav.localization.beam_classification.preliminary_samples import PreliminarySamples
from glass_nav.localization.beam_classification.unmapped_panes import PaneUse
from glass_nav.localization.integrity.pose_state import QualityLimits
from glass_nav.localization.particle_filter.importance_weights import BeamMixture
from glass_nav.localization.particle_filter.motion import OdometryNoise
from glass_nav.localization.particle_filter.particle_filter import ParticleFilterParams
from glass_nav.localization.particle_filter.proposal import Proposal
from glass_nav.localization.particle_filter.resampling import ParticleCount
from glass_nav.panes.pane_finder import PaneFinderParams
from glass_nav.params import choice, number
from glass_nav.sensing.raycast import BACKENDS

BYTES_PER_PARTICLE = 2000  # at most, with what the filter needs for itself; measured: 0.2 to 1.2 kB
_MEMORY_SHARE = 0.5  # of the computer's, for the particles
_ALWAYS_BYTES = 5000 * BYTES_PER_PARTICLE  # the defaults start on any computer


@dataclass(frozen=True)
class Schedule:
    """When a scan moves the particles; the names and meanings are AMCL's."""

    update_min_d: float = number(0.1, 0.0, 1000.0)  # distance since the last update [m]
    update_min_a: float = number(0.1, 0.0, 1000.0)  # turn since the last update [rad]
    resample_interval: int = number(1, 1, 1000)  # updates between resamplings
    selective_resampling: bool = False  # only when the effective count is below half
    raycast_threads: int = number(1, 1, 256)
    raycast_backend: str = choice("exact", BACKENDS)  # or "mrpt": simulateScanRay, for comparison

    def __post_init__(self) -> None:
        for name in ("update_min_d", "update_min_a"):
            if not getattr(self, name) >= 0.0:
                raise ValueError(f"~{name} must be >= 0, got {getattr(self, name)}")
        for name in ("resample_interval", "raycast_threads"):
            if not getattr(self, name) >= 1:
                raise ValueError(f"~{name} must be >= 1, got {getattr(self, name)}")
        if self.raycast_backend not in BACKENDS:
            raise ValueError(f"~raycast_backend must be one of {', '.join(BACKENDS)}, got {self.raycast_backend!r}")


@dataclass(frozen=True)
class LaserLimits:
    """Ranges that are used; the names and meanings are AMCL's."""

    laser_min_range: float = number(-1.0, -1.0, 1000.0)  # [m] nearer ranges are ignored; < 0: the limit of the scan
    laser_max_range: float = number(-1.0, -1.0, 1000.0)  # [m] farther ranges are ignored; < 0: the limit of the scan

    def __post_init__(self) -> None:
        for name in ("laser_min_range", "laser_max_range"):
            if not np.isfinite(getattr(self, name)):
                raise ValueError(f"~{name} must be finite, got {getattr(self, name)}")
        if 0.0 <= self.laser_max_range <= max(self.laser_min_range, 0.0):
            raise ValueError(
                "~laser_max_range must be above 0 and ~laser_min_range, or < 0 for the scan's own, "
                f"got {self.laser_max_range}"
            )


@dataclass(frozen=True)
class LocalizerParams:
    """All parameters of the filter, a struct per model."""

    schedule: Schedule = field(default_factory=Schedule)
    limits: LaserLimits = field(default_factory=LaserLimits)
    count: ParticleCount = field(default_factory=ParticleCount)
    odometry: OdometryNoise = field(default_factory=OdometryNoise)
    proposal: Proposal = field(default_factory=Proposal)
    samples: PreliminarySamples = field(default_factory=PreliminarySamples)
    vote: CaseVote = field(default_factory=CaseVote)
    glass: GlassEvidence = field(default_factory=GlassEvidence)
    pane_use: PaneUse = field(default_factory=PaneUse)
    panes: PaneFinderParams = field(default_factory=PaneFinderParams)
    mixture: BeamMixture = field(default_factory=BeamMixture)
    quality: QualityLimits = field(default_factory=QualityLimits)
    search: SearchParams = field(default_factory=SearchParams)
    bearings: BearingMixture = field(default_factory=BearingMixture)

    def __post_init__(self) -> None:
        allowed = int(max(_MEMORY_SHARE * machine.memory_bytes(), _ALWAYS_BYTES)) // BYTES_PER_PARTICLE
        if self.count.max_particles > allowed:
            raise ValueError(
                f"~max_particles must be <= {allowed} on this computer: more may take over "
                f"{allowed * BYTES_PER_PARTICLE * 1e-9:.2f} GB of memory, got {self.count.max_particles}"
            )

    @property
    def classifier(self) -> BeamClassifierParams:
        """Parameters of the beam classifier."""
        return BeamClassifierParams(
            self.samples,
            self.vote,
            self.glass,
            self.mixture.laser_sigma_hit,
            self.mixture.laser_sigma_hit_max,
            self.schedule.raycast_threads,
            self.schedule.raycast_backend,
        )

    @property
    def particle_filter(self) -> ParticleFilterParams:
        """Parameters of the particle filter."""
        return ParticleFilterParams(
            self.count,
            self.odometry,
            self.proposal,
            self.mixture,
            self.bearings,
            self.schedule.resample_interval,
            self.schedule.selective_resampling,
        )
