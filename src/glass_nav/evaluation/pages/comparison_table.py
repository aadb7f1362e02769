"""The figures of a comparison side by side: for the page and, as lines, for a terminal."""

from __future__ import annotations

from typing import List, Optional

from glass_nav.evaluation.metrics import comparison
from glass_nav.evaluation.metrics.comparison import Comparison


def summary(compared: Comparison, log: Optional[str] = None) -> List[List[str]]:
    """Head and rows of the table: a figure a row, means, then differences to the first."""
    first, *others = compared.contestants
    rows = [["figure", *compared.contestants, *(f"{name} − {first}" for name in others)]]
    for figure in compared.figures:
        rows.append(
            [
                f"{figure.title} [{figure.unit}]",
                *(comparison.text(figure, compared.interval(name, figure, log)) for name in compared.contestants),
                *(comparison.difference_text(compared, name, figure, log) for name in others),
            ]
        )
    return rows


def lines(compared: Comparison) -> List[str]:
    """A figure a line, means, then the differences to the first."""
    rows = summary(compared)
    widths = [max(map(len, column)) for column in zip(*rows)]
    return [
        f"{comparison.counted(compared)}; mean ± 95 % interval over seeds",
        *("  ".join(f"{cell:<{width}s}" for cell, width in zip(row, widths)).rstrip() for row in rows),
    ]
