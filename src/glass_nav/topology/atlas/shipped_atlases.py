"""Finds the file of a shipped atlas in atlas/ by name."""

from __future__ import annotations

from pathlib import Path
from typing import Dict

from glass_nav import package_files
from glass_nav.topology.atlas import atlas_file
from glass_nav.topology.atlas.atlas import AtlasError


def find(atlas: str) -> Path:
    """The file of an atlas.

    Args:
        atlas: a .json or .npz, a folder with atlas.json or atlas.npz, or the name of an atlas of the package.

    Raises:
        AtlasError: none of these.
    """
    path = Path(atlas)
    if path.exists() or path.suffix in (".json", ".npz"):
        return atlas_file.find(path)
    known = shipped()
    if atlas not in known:
        raise AtlasError(package_files.not_found(atlas, "an atlas", known))
    return known[atlas]


def shipped() -> Dict[str, Path]:
    """Name -> file of all atlases that come with the package, by name."""
    return package_files.by_name("atlas", atlas_file.NPZ_NAME, atlas_file.JSON_NAME)
