"""The report of one run, as one HTML file."""

from __future__ import annotations

from pathlib import Path
from typing import Any, List, Mapping, Sequence

from glass_nav.evaluation.metrics.run_story import BAD, FAIR, GOOD, Story
from glass_nav.evaluation.pages import templates
from glass_nav.evaluation.plots.canvas import Picture
from glass_nav.vocabulary import CASES_IN_ORDER

EPISODES = 5  # on the first screen; the longest of more
MOMENTS = 4  # of the worst scans there
MARKS = {GOOD: "✔", FAIR: "◐", BAD: "✘"}


def write(
    path: Path,
    title: str,
    story: Story,
    pictures: Sequence[Picture],
    worst: Sequence[Picture],
    metrics: Mapping[str, Any],
) -> None:
    """The report; the first of the pictures is that of the first screen."""
    longest = sorted(story.episodes, key=lambda each: each.duration_s, reverse=True)[:EPISODES]
    templates.write(
        path,
        "report.html.j2",
        title=title,
        story=story,
        mark=MARKS[story.grade],
        longest=sorted(longest, key=lambda each: each.first),
        total_s=story.episodes[-1].end_s,
        pictures=pictures,
        worst=worst,
        moments=MOMENTS,
        cases=CASES_IN_ORDER,
        rows=_rows(metrics),
    )


def _rows(metrics: Mapping[str, Any], prefix: str = "") -> "List[List[str]]":
    rows: List[List[str]] = []
    for name, value in metrics.items():
        if isinstance(value, Mapping):
            rows += _rows(value, f"{prefix}{name}.")
        else:
            rows.append([prefix + str(name), _text(value)])
    return rows


def _text(value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, (list, tuple)):
        return "; ".join(_text(item) for item in value)
    return str(value)
