"""Floors for the benchmarks' simulated robots: shipped buildings, random floors, maps of real ones."""

from __future__ import annotations

import functools
import sys
from pathlib import Path
from typing import NamedTuple

sys.path.append(str(Path(__file__).resolve().parents[1] / "support"))

import twin_wings

from glass_nav.simulation import building_file, building_map, mapped_building, random_building, shipped_buildings
from glass_nav.simulation.building import Building
from glass_nav.topology.atlas import atlas_builder, atlas_file, shipped_atlases
from glass_nav.topology.atlas.atlas import Atlas
from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap

RANDOM = "random"
HELP = (
    "names of shipped buildings, map_server .yaml files, or another floor for each seed: random, "
    f"{', '.join(twin_wings.KINDS)}"
)


class Floor(NamedTuple):
    """A building, and what the robot knows of it."""

    building: Building
    grid_map: GridMap
    atlas: Atlas


def load(name: str, seed: int, opaque: bool) -> Floor:
    """The floor of a name: see HELP.

    Args:
        name: of the floor.
        seed: of a random one.
        opaque: film on all glass. The walls of maps are opaque anyway.
    """
    if name in (RANDOM, *twin_wings.KINDS):
        building = random_building.build(seed) if name == RANDOM else twin_wings.build(name, seed)
        grid_map = building_map.draw(building)
        atlas = _built(grid_map, building.name)
    elif name.endswith(".yaml"):
        building, grid_map, atlas = _of_map(name)
    else:
        building = building_file.load(shipped_buildings.find(name))
        grid_map = building_map.draw(building)
        atlas = atlas_file.load(shipped_atlases.find(name))
    return Floor(building.opaque() if opaque else building, grid_map, atlas)


@functools.lru_cache(maxsize=2)
def _of_map(path: str) -> Floor:
    grid_map = map_file.load(Path(path))
    building = mapped_building.build(grid_map, Path(path).stem)
    return Floor(building, grid_map, _built(grid_map, building.name))


def _built(grid_map: GridMap, name: str) -> Atlas:
    return atlas_builder.build(grid_map, name, name)[0]
