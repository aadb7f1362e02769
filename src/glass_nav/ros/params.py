"""The private parameters of the localization node: the parameter server -> validated dataclasses.

Names and defaults are AMCL's where AMCL has the parameter. Parameters of AMCL that mean nothing to
this filter are taken off first, so that launch files written for amcl load; whatever else is unknown
is refused with the nearest known name.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Any, List, Mapping, Tuple

import numpy as np

from glass_nav import amcl_parameters, params
from glass_nav.localization.glass_mcl import GlassMclParams
from glass_nav.localization.start_pose import StartPose
from glass_nav.params import ParamError

__all__ = ["LocalizationNodeParams", "LocalizationParams", "ParamError", "localization_params"]

@dataclass(frozen=True)
class LocalizationNodeParams:
    """What the node itself needs: frames, map, start, rates. Units by REP 103."""
    odom_frame_id: str = "odom"
    base_frame_id: str = "base_link"
    global_frame_id: str = "map"
    tf_broadcast: bool = True
    transform_tolerance: float = 0.1       # [s] how far ahead of the scan map -> odom is stamped
    transform_wait_s: float = 1.0          # [s] how long a scan waits for odom <- base <- laser
    use_map_topic: bool = False
    first_map_only: bool = False
    force_update_after_initialpose: bool = False
    force_update_after_set_map: bool = False
    gui_publish_rate: float = -1.0         # [Hz] of particlecloud, ~beam_cloud, ~beam_markers; <= 0: no limit
    glass_map_period_s: float = 2.0        # [s] ~glass_map goes out no more often
    save_pose_rate: float = 0.5            # [Hz]; <= 0: only when the node ends
    std_warn_level_x: float = 0.2          # [m]
    std_warn_level_y: float = 0.2          # [m]
    std_warn_level_yaw: float = 0.1        # [rad]
    landmark_file: str = ""                # landmarks.yaml; "": bearings are not used
    random_seed: int = 0                   # < 0: another one at every start

    def __post_init__(self) -> None:
        for name in ("odom_frame_id", "base_frame_id", "global_frame_id"):
            frame = getattr(self, name)
            object.__setattr__(self, name, frame.lstrip("/"))  # tf2 has no "/" in front; tf1 files do
            if not frame.strip("/ "):
                raise ValueError(f"~{name} must name a frame, got {frame!r}")
        frames = self.odom_frame_id, self.base_frame_id, self.global_frame_id
        if len(set(frames)) < 3:
            raise ValueError("~odom_frame_id, ~base_frame_id and ~global_frame_id must differ, "
                             f"got {frames[0]!r}, {frames[1]!r}, {frames[2]!r}")
        for name, kind in [(f.name, f.type) for f in dataclasses.fields(self)]:
            if kind in (float, "float") and not math.isfinite(getattr(self, name)):
                raise ValueError(f"~{name} must be finite, got {getattr(self, name)}")
        for name in ("transform_tolerance", "transform_wait_s", "glass_map_period_s", "std_warn_level_x",
                     "std_warn_level_y", "std_warn_level_yaw"):
            if not getattr(self, name) >= 0.0:
                raise ValueError(f"~{name} must be >= 0, got {getattr(self, name)}")

    @property
    def rng(self) -> np.random.Generator:
        """A generator that repeats itself from start to start, unless ~random_seed is negative."""
        return np.random.default_rng(None if self.random_seed < 0 else self.random_seed)


@dataclass(frozen=True)
class LocalizationParams:
    """Everything the node reads: its own parameters and the filter's, one flat set of names."""
    node: LocalizationNodeParams = field(default_factory=LocalizationNodeParams)
    start: StartPose = field(default_factory=StartPose)
    mcl: GlassMclParams = field(default_factory=GlassMclParams)


def localization_params(mapping: Mapping[str, Any], owner: str) -> Tuple[LocalizationParams, List[str]]:
    """The parameters of the node, and the names in the mapping that are AMCL's and not used here.

    Args:
        mapping: names -> values as the parameter server has them under the node's name.
        owner: the node's name, the first word of an error.

    Raises:
        ParamError: a name nobody knows, a wrong type, a value out of its range.
    """
    ours, unused = amcl_parameters.without_unused(mapping, LocalizationParams)
    return params.load(LocalizationParams, ours, owner), unused
