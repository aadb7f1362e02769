"""Fills the templates beside this file with values, all of them escaped.

A page is one file that asks no address for anything: style and pictures inside, no script; its own
Content-Security-Policy forbids the rest. It opens from a USB stick and prints.
"""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

from glass_nav.evaluation.metrics.run_story import duration
from glass_nav.vocabulary import state_colour

FOLDER = Path(__file__).parent / "templates"


def write(path: Path, template: str, **values: Any) -> None:
    """Fill a template into a file.

    Raises:
        OSError: the file cannot be written.
    """
    path.write_text(_environment().get_template(template).render(**values), encoding="utf-8")


def _environment() -> Any:
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(str(FOLDER)),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters.update(data_uri=_data_uri, duration=duration, share_of=_share_of, state_colour=state_colour)
    return environment


def _data_uri(png: Path) -> str:
    return "data:image/png;base64," + base64.b64encode(png.read_bytes()).decode("ascii")


def _share_of(part: float, whole: float) -> float:
    """The part as a share of the whole for the width of a bar, which must not be 0."""
    return max(part / max(whole, 1e-9), 1e-4)
