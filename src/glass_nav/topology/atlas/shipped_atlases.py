"""A name -> the file of an atlas: those in atlas/ of the package, in a checkout and where it is installed."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Dict, Optional

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
    if atlas in known:
        return known[atlas]
    near = difflib.get_close_matches(atlas, list(known), n=1)
    hint = f"; did you mean {near[0]}?" if near else ""
    raise AtlasError(
        f"{atlas}: no such file, nor an atlas of the package, which are {', '.join(known) or 'none'}{hint}"
    )


def shipped() -> Dict[str, Path]:
    """Name -> file of all atlases that come with the package, by name."""
    folder = atlas_folder()
    if folder is None:
        return {}
    return {
        path.parent.name: path
        for name in (atlas_file.NPZ_NAME, atlas_file.JSON_NAME)
        for path in sorted(folder.glob(f"*/{name}"))
    }


def atlas_folder(module: Path = Path(__file__)) -> Optional[Path]:
    """atlas/ of the checkout that this file is part of, or of the share folder beside the lib folder it is in."""
    for above in module.resolve().parents:
        if (above / "package.xml").is_file() and (above / "atlas").is_dir():
            return above / "atlas"
        if (above / "share" / "glass_nav" / "atlas").is_dir():
            return above / "share" / "glass_nav" / "atlas"
    return None
