"""The list of the pictures of a report, each a PNG file with an alternative text."""

from __future__ import annotations

from pathlib import Path
from typing import Callable, List, Optional, Tuple

import numpy as np

from glass_nav.evaluation.metrics.replay_result import ReplayResult
from glass_nav.evaluation.plots.canvas import Picture
from glass_nav.evaluation.plots.report import (
    candidates,
    cases_over_time,
    driven_path,
    errors,
    integrity,
    reliability,
    update_time,
    walls,
    worst_scans,
)
from glass_nav.evaluation.plots.report import confusion as confusion_picture
from glass_nav.evaluation.plots.report.ground import Ground

OF_THE_RUN = (driven_path, cases_over_time, walls, errors, integrity, reliability, candidates, update_time)


def draw_all(
    folder: Path,
    result: ReplayResult,
    ground: Ground,
    confusion: Optional[np.ndarray],
    drawn: Callable[[], None] = lambda: None,
) -> "Tuple[List[Picture], List[Picture]]":
    """All pictures that the run has something for, and those of its worst scans, the worst first.

    Args:
        folder: for the PNG files.
        result: the run, at least one scan.
        ground: the map.
        confusion: (5, 5) beams of each true case (rows) reported as each case, None without the truth.
        drawn: called after each picture.
    """
    pictures = []
    for each in OF_THE_RUN:
        picture = each.draw(folder, result, ground)
        if picture is not None:
            pictures.append(picture)
        drawn()
    if confusion is not None:
        pictures.append(confusion_picture.draw(folder, confusion))
        drawn()
    worst = []
    for number, kept in enumerate(result.worst, 1):
        worst.append(worst_scans.draw(folder, result, ground, number, kept))
        drawn()
    return pictures, worst
