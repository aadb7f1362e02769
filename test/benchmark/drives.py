"""One simulated drive through a building of maps/, in memory: the same seed, the same drive."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import List, NamedTuple, Optional

from glass_nav.simulation import building_file, building_map, lidar
from glass_nav.simulation.lidar import LidarModel
from glass_nav.simulation.simulation import Frame, Simulation
from glass_nav.world.grid_map import GridMap

MAPS = Path(__file__).resolve().parents[2] / "maps"
SCAN_RATE_HZ = 5.0  # a scan every 0.12 m: enough for each to be an update


class Drive(NamedTuple):
    """One drive of a robot along the path of its building."""

    grid_map: GridMap  # as it was drawn, before anything changed
    frames: List[Frame]


def buildings() -> List[str]:
    """Names of all buildings that ship."""
    return sorted(path.parent.name for path in MAPS.glob("*/building.yaml"))


def lidars() -> List[str]:
    """Names of all presets."""
    return list(lidar.PRESETS)


def drive(name: str, lidar_name: str, seed: int, changed: float = 0.0, max_scans: Optional[int] = None) -> Drive:
    """Drive along the first path of the building.

    Args:
        name: of a building in maps/.
        lidar_name: a preset.
        seed: of everything random.
        changed: share of the movable furniture that was moved since the map was drawn.
        max_scans: stop after this many.
    """
    return drive_with(lidar.preset(lidar_name), name, seed, changed, max_scans)


def drive_with(model: LidarModel, name: str, seed: int, changed: float = 0.0, max_scans: Optional[int] = None) -> Drive:
    """As drive(), with any lidar."""
    building = building_file.load(MAPS / name / "building.yaml")
    simulation = Simulation(building, model, seed=seed, scan_rate_hz=SCAN_RATE_HZ, changed_share=changed)
    frames = list(itertools.islice(simulation.drive(next(iter(building.paths))), max_scans))
    return Drive(building_map.draw(building), frames)
