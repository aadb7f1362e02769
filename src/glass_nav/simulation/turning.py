"""Simulates the sweep of a rotating lidar on a moving robot, in sectors of some milliseconds each."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from glass_nav.geometry import se2
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.simulation import lidar
from glass_nav.simulation.building import Building
from glass_nav.simulation.lidar import LidarModel, TrueScan

SECTOR_S = 0.002  # at 1 rad/s the robot turns by 0.1 degrees meanwhile
MIN_BEAMS = 2  # in a sector


def scan(
    model: LidarModel,
    building: Building,
    map_from_laser: Trajectory,
    turn_ns: int,
    start_ns: int,
    rng: np.random.Generator,
) -> TrueScan:
    """Simulates a sweep, from the first beam at the first pose to the last beam at the last one.

    Args:
        model: the lidar.
        building: its people keep walking.
        map_from_laser: poses during the sweep.
        turn_ns: from the first beam to the last one.
        start_ns: zero of the building's clock, in the stamps of map_from_laser.
        rng: as in lidar.scan().
    """
    sectors = int(np.clip(round(turn_ns * 1e-9 / SECTOR_S), 1, model.beams // MIN_BEAMS))
    parts = []
    for beams in np.array_split(np.arange(model.beams), sectors):
        angles_rad = model.angles_rad[beams]
        middle_rad = 0.5 * (angles_rad[0] + angles_rad[-1])
        stamp_ns = map_from_laser.stamps_ns[0] + round(turn_ns * float(beams.mean()) / (model.beams - 1))
        pose = se2.compose(map_from_laser.at(np.int64(stamp_ns)), np.array([0.0, 0.0, middle_rad]))
        part = replace(model, beams=len(beams), field_of_view_rad=float(angles_rad[-1] - angles_rad[0]))
        parts.append(lidar.scan(part, building, pose, (stamp_ns - start_ns) * 1e-9, rng))
    return TrueScan(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(TrueScan)))
