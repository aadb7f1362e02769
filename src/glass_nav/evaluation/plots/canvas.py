"""An empty picture without a display, the frame of a map, and the PNG file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

DPI = 110


@dataclass(frozen=True)
class Picture:
    """A picture of a report."""

    path: Path
    title: str
    alt: str  # what it shows, in words
    caption: str  # how to read it


def new_figure(width: float, height: float, dpi: int = DPI) -> Any:
    """An empty one [inch], without a display."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=dpi, constrained_layout=True)
    FigureCanvasAgg(figure)
    return figure


def frame(axes: Any, low: np.ndarray, high: np.ndarray) -> None:
    """Axes of a map from corner to corner (2,) [m]."""
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.tick_params(labelsize=7)
    axes.set_xlabel("x [m]", fontsize=8)
    axes.set_ylabel("y [m]", fontsize=8)


def legend_below(axes: Any, columns: int) -> None:
    """The legend below the name of the x axis."""
    axes.legend(
        loc="upper center", bbox_to_anchor=(0.5, 0.0), borderaxespad=3.6, ncol=columns, fontsize=9, frameon=False
    )


def save(folder: Path, figure: Any, name: str, title: str, alt: str, caption: str) -> Picture:
    """The figure as a PNG file."""
    path = folder / f"{name}.png"
    figure.savefig(path)
    return Picture(path, title, alt, caption)
