"""Finds the dart of the atlas at which a robot with a given pose stands, by its place rather than by the forest."""

from __future__ import annotations

import numpy as np

from glass_nav.geometry import angles, se2
from glass_nav.topology.atlas.atlas import Atlas
from glass_nav.topology.observations import Meetpoint
from glass_nav.topology.search.belief import NO_DART

_NODE_M, _EDGE_RAD = 0.7, 0.6  # from where a pose expects a meetpoint, and the directions of its edges in the mean


def like(atlas: Atlas, poses: np.ndarray, meetpoint: Meetpoint) -> np.ndarray:
    """(K,) the darts that are the reference edge of a meetpoint where a robot with pose (K, 3) stands, by its place and the
    directions of its edges alone; NO_DART where no node of that degree is near.
    """
    bearings = meetpoint.bearings_rad if len(meetpoint.bearings_rad) else np.array([np.pi])
    dart = np.full(len(poses), NO_DART, np.int64)
    for k, pose in enumerate(poses):
        off_m = np.hypot(*(atlas.nodes.position_m - se2.transform_points(pose, meetpoint.centre_m)).T)
        node = int(off_m.argmin())
        ring = atlas.rings[node]
        if off_m[node] >= _NODE_M or len(ring) != meetpoint.degree:
            continue
        turned = ring[(np.arange(len(ring))[:, None] + np.arange(len(bearings))) % len(ring)]
        off_rad = np.abs(angles.wrap(atlas.darts.bearing_rad[turned] - pose[2] - bearings)).mean(axis=1)
        if off_rad.min() < _EDGE_RAD:
            dart[k] = ring[off_rad.argmin()]
    return dart


def beside(atlas: Atlas, pose: np.ndarray, meetpoint: Meetpoint) -> int:
    """A dart of the node where a robot with pose (3,) stands, whatever its degree; NO_DART: none is near."""
    if not len(meetpoint.bearings_rad):
        return NO_DART
    off_m = np.hypot(*(atlas.nodes.position_m - se2.transform_points(pose, meetpoint.centre_m)).T)
    node = int(off_m.argmin())
    ring = atlas.rings[node]
    return int(ring[0]) if len(ring) and off_m[node] < _NODE_M else NO_DART
