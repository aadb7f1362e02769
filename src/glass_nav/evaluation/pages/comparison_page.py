"""A comparison as one HTML file, as a report is one."""

from __future__ import annotations

from pathlib import Path
from typing import Any, List, Mapping, Sequence

from glass_nav.evaluation.metrics import comparison
from glass_nav.evaluation.metrics.comparison import Comparison
from glass_nav.evaluation.metrics.confidence import Interval
from glass_nav.evaluation.pages import comparison_table, templates
from glass_nav.evaluation.plots import comparison_pictures
from glass_nav.evaluation.plots.canvas import Picture


def write(path: Path, compared: Comparison, drawn: Sequence[Picture], about: Mapping[str, Any]) -> None:
    """The page; the first of the pictures is that of the first screen."""
    several = compared.logs if len(compared.logs) > 1 else []
    templates.write(
        path,
        "comparison.html.j2",
        title=f"{' | '.join(compared.contestants)} over {', '.join(compared.logs)}",
        compared=compared,
        counted=comparison.counted(compared),
        headline=headline(compared),
        means=comparison_table.summary(compared),
        by_log=[(log, comparison_table.summary(compared, log)) for log in several],
        pictures=drawn,
        without_pictures=len(compared.logs) - comparison_pictures.MAX_LOGS,
        contestants=[[name, str(about["what"][name])] for name in compared.contestants],
        runs=_runs(compared),
    )


def headline(compared: Comparison) -> str:
    """The first figure of each contestant, compared with the first one."""
    first, *others = compared.contestants
    figure = compared.figures[0]
    value = comparison.text(figure, compared.interval(first, figure))
    if figure.better == 0:  # no figure can be better than another
        return f"{figure.title[0].upper()}{figure.title[1:]}: " + "; ".join(
            f"{name} {comparison.text(figure, compared.interval(name, figure))} {figure.unit}" for name in others
        )
    words = []
    for name in others:
        difference = compared.difference(name, figure)
        verdict = comparison.judged(figure, difference)
        if verdict in ("better", "worse"):
            words.append(f"{name} is {verdict} than {first}")
        elif verdict:
            words.append(f"{name} and {first} are {verdict}")
        else:
            words.append(f"{name} against {first}")
        if difference is not None:
            words[-1] += f" ({comparison.text(figure, difference, signed=True)} {figure.unit})"
    said = "; ".join(words) or f"{first} {value} {figure.unit}"
    return f"{figure.title[0].upper()}{figure.title[1:]}: {said}"


def _runs(compared: Comparison) -> List[List[str]]:
    """Header and rows of the table of runs."""
    head = [
        "log",
        "contestant",
        "seed",
        "scans",
        *(f"{each.title} [{each.unit}]" for each in compared.figures),
        "trajectory",
    ]
    rows = [
        [
            run.log,
            run.contestant,
            "" if run.seed is None else str(run.seed),
            str(len(run.stamps_ns)),
            *(comparison.text(each, Interval(compared.value(run, each), None)) for each in compared.figures),
            run.sha256[:12],
        ]
        for run in compared.runs
    ]
    return [head, *rows]
