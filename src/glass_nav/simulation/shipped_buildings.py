"""A name -> the file of a building: those in maps/ of the package, in a checkout and where it is installed."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Dict, Optional

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
    near = difflib.get_close_matches(building, list(known), n=1)
    hint = f"; did you mean {near[0]}?" if near else ""
    raise BuildingError(
        f"{building}: no such file, nor a building of the package, which are {', '.join(known) or 'none'}{hint}"
    )


def shipped() -> Dict[str, Path]:
    """Name -> yaml file of all buildings that come with the package, by name."""
    folder = maps_folder()
    return {} if folder is None else {path.parent.name: path for path in sorted(folder.glob(f"*/{FILE_NAME}"))}


def maps_folder(module: Path = Path(__file__)) -> Optional[Path]:
    """maps/ of the checkout that this file is part of, or of the share folder beside the lib folder it is in."""
    for above in module.resolve().parents:
        if (above / "package.xml").is_file() and (above / "maps").is_dir():
            return above / "maps"
        if (above / "share" / "glass_nav" / "maps").is_dir():
            return above / "share" / "glass_nav" / "maps"
    return None
