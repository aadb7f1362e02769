"""What the commands about panes print and write."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import List, Optional, Sequence

from glass_nav.evaluation.plots import panes_picture
from glass_nav.world import drawn_panes, map_copy, map_file, panes_file
from glass_nav.world.grid_map import GridMap
from glass_nav.world.pane import Pane

MAP_NAME, PANES_NAME, PICTURE_NAME = "map.yaml", "panes.yaml", "panes.png"


def check_folder(folder: Path) -> None:
    """Make a folder and make sure that files can be written there, before a long job begins.

    Raises:
        OSError: they cannot.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder):
        pass


def write(
    folder: Path,
    path_map: Path,
    grid_map: GridMap,
    panes: Sequence[Pane],
    title: str,
    candidates: Optional[Sequence[Pane]] = None,
) -> List[Path]:
    """The map with the panes, the panes and a picture; files that are there stay as they are until all is ready.

    Args:
        folder: for the files.
        path_map: the map, which is not touched.
        grid_map: the same, loaded.
        panes: to be drawn and written.
        title: of the picture.
        candidates: in the picture, by number; default: the panes.

    Returns:
        what was written.

    Raises:
        MapError, PaneError, OSError: a pane outside the map, or a file that cannot be written or is the map itself.
    """
    after = drawn_panes.drawn(grid_map, panes)
    check_folder(folder)
    name = map_file.name_of(path_map)
    with tempfile.TemporaryDirectory(prefix=".panes.", dir=folder) as temporary:
        unfinished = Path(temporary)
        written = map_copy.save(path_map, after, unfinished / MAP_NAME)
        panes_file.save(unfinished / PANES_NAME, grid_map, panes)
        panes_picture.draw(unfinished / PICTURE_NAME, grid_map, candidates or panes, f"{name}: {title}", after)
        written += [unfinished / PANES_NAME, unfinished / PICTURE_NAME]
        for path in written:
            map_copy.check_other(folder / path.name, path_map)
        for path in written:
            os.replace(path, folder / path.name)
    return [folder / path.name for path in written]


def table(panes: Sequence[Pane], drawn: Sequence[int]) -> List[str]:
    """Lines about all candidates, and which of them are drawn."""
    if not panes:
        return ["no pane found that the map lacks"]
    lines = ["  no.        from [m]          to [m]  length [m]  probability  returns  passes  seen from [m]"]
    for number, pane in enumerate(panes, start=1):
        (x0, y0), (x1, y1) = pane.start_m, pane.end_m
        lines.append(
            f"{number:5d} {f'({x0:.2f}, {y0:.2f})':>16} {f'({x1:.2f}, {y1:.2f})':>16} {pane.length_m:10.2f} "
            f"{pane.probability:12.3f} {pane.returns:8d} {pane.passes:7d} {pane.seen_from_m:14.1f}"
            + ("" if number in drawn else "  not drawn")
        )
    length_m = sum(panes[number - 1].length_m for number in drawn)
    return [*lines, f"{counted(len(drawn))} drawn, {length_m:.1f} m of glass that the map lacks"]


def counted(panes: int) -> str:
    """1 -> 1 pane, 2 -> 2 panes."""
    return f"{panes} pane{'' if panes == 1 else 's'}"
