"""The file of --params: parameters of the search, under the names of topology_node.

The file of a running node serves as it is: what only a node can use is left aside.
"""

from __future__ import annotations

from pathlib import Path
from typing import Optional

from glass_nav import params
from glass_nav.replay import replay_params
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.topology.session_params import SessionParams

NODE_ONLY = frozenset(
    [
        "atlas",
        "base_frame_id",
        "global_frame_id",
        "odom_frame_id",
        "initial_pose_sigma_m",
        "initial_pose_sigma_rad",
        *params.names(SessionParams),
    ]
)


def load(path: Optional[Path]) -> SearchParams:
    """The parameters of a yaml file; the defaults without one.

    Raises:
        ParamError: no such file, no flat yaml, or a parameter that params.load() refuses.
    """
    if path is None:
        return SearchParams()
    mapping = replay_params.read_mapping(path)
    return params.load(
        SearchParams, {name: value for name, value in mapping.items() if name not in NODE_ONLY}, str(path)
    )
