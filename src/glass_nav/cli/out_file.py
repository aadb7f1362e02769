"""--out of the subcommands that write one file: a folder, or a file by its full name."""

from __future__ import annotations

from pathlib import Path


def in_folder(out: Path, name: str) -> Path:
    """The file to write; its folder is made.

    Args:
        out: as given; with the suffix of `name` it is the file itself, unless there is a folder of that name.
        name: of the file in a folder.
    """
    is_file = out.suffix == Path(name).suffix and not out.is_dir()
    path = out if is_file else out / name
    path.parent.mkdir(parents=True, exist_ok=True)
    return path
