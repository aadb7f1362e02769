"""The private parameters of the topology node; explained in config/topology.yaml."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from glass_nav.topology.search.atlas_localizer import SearchParams


@dataclass(frozen=True)
class TopologyNodeParams:
    """What the node itself needs."""

    atlas: str = ""  # atlas.json, atlas.npz, the folder of one, or the name of a shipped one
    global_frame_id: str = "map"
    odom_frame_id: str = "odom"  # of the odometry by which scans are deskewed
    check_map: bool = True  # refuse the atlas if the topic map has another map
    judge_by_scans: bool = True  # candidates by the scan at a meetpoint, where there are scans and a map
    search_at_start: bool = True  # with the first meetpoint; else when asked
    publish_initial_pose: bool = True
    initial_pose_sigma_m: float = 0.25  # of initialpose
    initial_pose_sigma_rad: float = 0.17  # [rad] 10 degrees
    listed_candidates: int = 1000  # at most, in ~candidates and ~markers
    pairing_tolerance_s: float = 2.0  # [s] between the stamps of an edge traversal and its meetpoint
    visits_file: str = ""  # the atlas with its statistics is saved there; empty: nowhere

    def __post_init__(self) -> None:
        for name in ("global_frame_id", "odom_frame_id"):
            object.__setattr__(self, name, getattr(self, name).lstrip("/"))
            if not getattr(self, name).strip():
                raise ValueError(f"~{name} must name a frame, got {getattr(self, name)!r}")
        for name in ("initial_pose_sigma_m", "initial_pose_sigma_rad", "pairing_tolerance_s"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise ValueError(f"~{name} must be finite and > 0, got {getattr(self, name)}")
        if self.listed_candidates < 1:
            raise ValueError(f"~listed_candidates must be >= 1, got {self.listed_candidates}")
        if self.visits_file and not self.visits_file.endswith((".json", ".npz")):
            raise ValueError(f"~visits_file must be a .json or a .npz, got {self.visits_file!r}")


@dataclass(frozen=True)
class TopologyParams:
    """Everything the node reads, one flat set of names."""

    node: TopologyNodeParams = field(default_factory=TopologyNodeParams)
    search: SearchParams = field(default_factory=SearchParams)
