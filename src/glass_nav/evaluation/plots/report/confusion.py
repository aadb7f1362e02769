"""Reported cases against true ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from glass_nav.evaluation.plots.canvas import Picture, new_figure, save
from glass_nav.evaluation.plots.confusion_matrix import draw_confusion


def draw(folder: Path, confusion: np.ndarray) -> Picture:
    figure = new_figure(5.6, 5.2)
    draw_confusion(figure.subplots(), confusion)
    right = np.trace(confusion) / max(int(confusion.sum()), 1)
    return save(
        folder,
        figure,
        "confusion",
        "Reported and true cases",
        f"Confusion matrix of the beam cases: {100 * right:.1f} % of {int(confusion.sum())} beams were classified correctly.",
        "The log has the true case of each beam. Rows: true case; columns: reported case.",
    )
