"""The private parameters of the topology node; explained in config/topology.yaml."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Dict, List, Mapping, Tuple

from glass_nav.topology.search.search_params import SearchParams
from glass_nav.topology.session_params import SessionParams


@dataclass(frozen=True)
class TopologyNodeParams:
    """Parameters of the node itself."""

    atlas: str = ""  # atlas.json, atlas.npz, the folder of one, the name of a shipped one, or map: made
    global_frame_id: str = "map"
    odom_frame_id: str = "odom"  # of the odometry by which scans are deskewed and poses are followed
    base_frame_id: str = "base_link"  # of the robot, until a meetpoint names another one
    initial_pose_sigma_m: float = 0.25  # of initialpose
    initial_pose_sigma_rad: float = 0.17  # [rad] 10 degrees

    def __post_init__(self) -> None:
        for name in ("global_frame_id", "odom_frame_id", "base_frame_id"):
            object.__setattr__(self, name, getattr(self, name).lstrip("/"))
            if not getattr(self, name).strip():
                raise ValueError(f"~{name} must name a frame, got {getattr(self, name)!r}")
        for name in ("initial_pose_sigma_m", "initial_pose_sigma_rad"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise ValueError(f"~{name} must be finite and > 0, got {getattr(self, name)}")


@dataclass(frozen=True)
class TopologyParams:
    """All parameters of the node, one flat set of names."""

    node: TopologyNodeParams = field(default_factory=TopologyNodeParams)
    session: SessionParams = field(default_factory=SessionParams)
    search: SearchParams = field(default_factory=SearchParams)


_GONE = {  # parameters of earlier versions -> what does their work
    "searches": "the belief decides when a robot is LOST",
    "follow_places": "the belief follows every place that is possible",
    "follow_lead": "~risk says when a place is confirmed",
}


def without_gone(given: Mapping[str, Any]) -> Tuple[Dict[str, Any], List[str]]:
    """The parameters without those that only earlier versions had, and a line on each of these."""
    kept = {name: value for name, value in given.items() if name not in _GONE}
    return kept, [f"~{name} is ignored: it is gone, {_GONE[name]}" for name in given if name in _GONE]
