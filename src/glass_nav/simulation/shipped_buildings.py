"""Finds the file of a shipped building in maps/ by name."""

from __future__ import annotations

from pathlib import Path
from typing import Dict

from glass_nav import package_files
from glass_nav.simulation.building_file import FILE_NAME, BuildingError


def find(building: str) -> Path:
    """The yaml file of a building.

    Args:
        building: a yaml file, a folder with building.yaml, or the name of a building of the package.

    Raises:
        BuildingError: none of these.
    """
    path = Path(building)
    if path.is_file():
        return path
    if path.is_dir() and (path / FILE_NAME).is_file():
        return path / FILE_NAME
    known = shipped()
    if building in known:
        return known[building]
    if path.is_dir():
        raise BuildingError(f"{path}: a folder without {FILE_NAME}")
    raise BuildingError(package_files.not_found(building, "a building", known))


def shipped() -> Dict[str, Path]:
    """Name -> yaml file of all buildings that come with the package, by name."""
    return package_files.by_name("maps", FILE_NAME)
