"""Beam cases reported against true ones, as a matrix."""

from __future__ import annotations

from typing import Any

import numpy as np

from glass_nav.vocabulary import CASES_IN_ORDER


def draw_confusion(axes: Any, confusion: np.ndarray) -> None:
    """Beams of each true case (rows) by the case reported, (5, 5) by number, drawn in the order of the vocabulary."""
    labels = [case.label for case in CASES_IN_ORDER]
    confusion = confusion[np.ix_(CASES_IN_ORDER, CASES_IN_ORDER)]
    share = confusion / np.maximum(confusion.sum(axis=1, keepdims=True), 1)
    axes.imshow(share, cmap="Blues", vmin=0.0, vmax=1.0)
    for true, row in enumerate(confusion):
        for reported, count in enumerate(row):
            axes.text(
                reported,
                true,
                f"{100 * share[true, reported]:.1f} %\n{count}" if row.any() else "-",
                ha="center",
                va="center",
                fontsize=8,
                color="white" if share[true, reported] > 0.6 else "black",
            )
    axes.set_xticks(range(len(labels)))
    axes.set_xticklabels(labels, rotation=30, ha="right", fontsize=8)
    axes.set_yticks(range(len(labels)))
    axes.set_yticklabels(labels, fontsize=8)
    axes.set_xlabel("reported case")
    axes.set_ylabel("true case")
