"""The files of a comparison: tables, pictures and the page."""

from __future__ import annotations

from pathlib import Path
from typing import Mapping, Sequence

from glass_nav.compare.contestants import Contestant
from glass_nav.evaluation.metrics import comparison
from glass_nav.evaluation.metrics.comparison import Comparison
from glass_nav.evaluation.pages import comparison_page
from glass_nav.evaluation.plots import comparison_pictures
from glass_nav.replay import replay_files
from glass_nav.world import map_file


def write(folder: Path, compared: Comparison, maps: Mapping[str, Path], everyone: Sequence[Contestant]) -> Path:
    """Writes all files; returns the path of the page.

    Raises:
        MapError, OSError: a map cannot be read, or the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    about = {
        "versions": replay_files.versions(),
        "maps": {log: str(maps[log]) for log in compared.logs},
        "what": {each.name: str(each) for each in everyone},
    }
    comparison.write(compared, folder, about)
    grids = {}
    for log in compared.logs[: comparison_pictures.MAX_LOGS]:
        if maps[log].exists():  # results may come from elsewhere
            grids[log] = map_file.load(maps[log])
    drawn = comparison_pictures.draw_all(folder, compared, grids)
    page = folder / "compare.html"
    comparison_page.write(page, compared, drawn, about)
    return page
