"""The pose of the robot's environment frame in the atlas, from a confirmed meetpoint.

Seed document global_localization_procedure.txt: the localization is complete if one place is left "and the robot has
enough information to determine its environment frame's relation to the solution meetpoint's frame". The environment
frame is that of dead reckoning, the only frame of a robot that is not localized. The frame of a meetpoint has its
origin at the meetpoint and its x axis along the meetpoint's first edge.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from glass_nav.geometry import se2
from glass_nav.topology.atlas.atlas import Atlas


@dataclass(frozen=True)
class FrameRelation:
    """The pose of the environment frame; poses (3,) x [m], y [m], yaw [rad]."""

    map_from_environment: np.ndarray  # (3,) in the map of the atlas
    node: Optional[int] = None  # the solution meetpoint; None: scans confirmed a place that the atlas does not have
    node_from_environment: Optional[np.ndarray] = None  # (3,) in the frame of that meetpoint


def of(
    atlas: Atlas, node: Optional[int], map_from_base: np.ndarray, environment_from_base: Optional[np.ndarray]
) -> Optional[FrameRelation]:
    """The relation of frames; None if dead reckoning was not reported at the meetpoint.

    Args:
        atlas: that was searched.
        node: where the robot is confirmed to be; None: at no node of it.
        map_from_base: (3,) the confirmed pose of the robot at the meetpoint.
        environment_from_base: (3,) dead reckoning at the same time; None: not known.
    """
    if environment_from_base is None:
        return None
    map_from_environment = se2.compose(map_from_base, se2.inverse(environment_from_base))
    if node is None:
        return FrameRelation(map_from_environment)
    map_from_node = node_frame(atlas, node)
    return FrameRelation(map_from_environment, node, se2.compose(se2.inverse(map_from_node), map_from_environment))


def node_frame(atlas: Atlas, node: int) -> np.ndarray:
    """(3,) map_from_node: the pose in the map of a robot at the meetpoint that looks along its first edge."""
    return atlas.map_from_dart(atlas.rings[node][0])
