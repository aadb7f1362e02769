"""Reads and writes atlases: atlas/NAME/atlas.json for people and editors, atlas.npz for many nodes.

Each reader checks its format, and Atlas the rules that a format cannot express.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Union

import numpy as np

from glass_nav.topology.atlas import atlas_json, atlas_npz
from glass_nav.topology.atlas.atlas import Atlas, AtlasError

JSON_NAME, NPZ_NAME = "atlas.json", "atlas.npz"

AnyPath = Union[str, "os.PathLike[str]"]


def find(path: AnyPath) -> Path:
    """The file itself, or the atlas.json or atlas.npz of a folder.

    Raises:
        AtlasError: there is none.
    """
    path = Path(path)
    if not path.is_dir():
        return path
    for name in (JSON_NAME, NPZ_NAME):
        if (path / name).is_file():
            return path / name
    raise AtlasError(f"{path}: holds neither {JSON_NAME} nor {NPZ_NAME}")


def load(path: AnyPath) -> Atlas:
    """The atlas in a .json, a .npz or a folder with one of them.

    Raises:
        AtlasError: the file cannot be read or breaks a rule; one line that starts with the file.
    """
    path = find(path)
    if path.suffix not in (".json", ".npz"):
        raise AtlasError(f"{path}: an atlas is a .json, a .npz or a folder with {JSON_NAME} or {NPZ_NAME}")
    if not path.is_file():
        raise AtlasError(f"{path}: does not exist")
    try:
        return atlas_npz.load(path) if path.suffix == ".npz" else atlas_json.load(path)
    except AtlasError as err:
        raise AtlasError(f"{path}: {err}") from err


def save(atlas: Atlas, path: AnyPath) -> None:
    """Write a .json or a .npz atomically: the old file stays until the new one is complete."""
    path = Path(path)
    if path.suffix not in (".json", ".npz"):
        raise AtlasError(f"{path}: an atlas is saved as .json or .npz")
    unfinished = path.with_name(f".{path.name}.unfinished")
    try:
        if path.suffix == ".npz":
            with open(unfinished, "wb") as file:
                np.savez(file, **atlas_npz.arrays_of(atlas))
        else:
            unfinished.write_text(atlas_json.text_of(atlas))
        os.replace(str(unfinished), str(path))
    finally:
        if unfinished.exists():
            unfinished.unlink()
