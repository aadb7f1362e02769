"""A comparison as one HTML file, as a report is one: pictures inside, nothing fetched."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import Any, Mapping, Sequence

from glass_nav.evaluation.metrics import comparison
from glass_nav.evaluation.metrics.comparison import Comparison
from glass_nav.evaluation.metrics.confidence import Interval
from glass_nav.evaluation.pages import comparison_table, report_page
from glass_nav.evaluation.plots import comparison_pictures
from glass_nav.evaluation.plots.canvas import Picture


def write(path: Path, compared: Comparison, drawn: Sequence[Picture], about: Mapping[str, Any]) -> None:
    """The page; the first of the pictures is that of the first screen."""
    title = f"{' | '.join(compared.contestants)} over {', '.join(compared.logs)}"
    figures, *rest = drawn
    head, *rows = comparison_table.summary(compared)
    body = [
        '<section class="verdict" style="--grade: var(--link)" aria-labelledby="verdict">'
        f'<p class="log">{escape(comparison.counted(compared))}: {escape(", ".join(compared.logs))}</p>',
        f'<h1 id="verdict">{escape(headline(compared))}</h1>',
        *(f"<p>{escape(note)}</p>" for note in compared.notes),
        "</section>",
        '<h2 id="means">All logs</h2><div class="card">',
        report_page.table(head, rows, numbers=True),
        f"<p>{escape(_READING.format(first=compared.contestants[0]))}</p></div>",
        '<h2 id="figures">In pictures</h2>',
        report_page.framed(figures, lazy=False),
    ]
    if len(compared.logs) > 1:
        for log in compared.logs:
            head, *rows = comparison_table.summary(compared, log)
            body += [
                f"<h2>{escape(log)}</h2>",
                '<div class="card">',
                report_page.table(head, rows, numbers=True),
                "</div>",
            ]
    if rest:
        body += [
            '<h2 id="logs">Log by log</h2><div class="pictures">',
            *(report_page.framed(each) for each in rest),
            "</div>",
        ]
        left = len(compared.logs) - comparison_pictures.MAX_LOGS
        if left > 0:
            body.append(f"<p>{left} more logs have no pictures of their own.</p>")
    body += [
        '<h2 id="contestants">Who took part</h2>',
        report_page.table(["name", "what"], [[name, str(about["what"][name])] for name in compared.contestants]),
        '<h2 id="runs">All runs</h2>',
        _runs(compared),
    ]
    path.write_text(report_page.page(title, body), encoding="utf-8")


_READING = (
    "Mean over seeds, ± its 95 % interval (Student's t over the seeds of each log; all logs have the same "
    "weight). Differences are to {first}, seed by seed: told as better or worse where 0 is outside the "
    "interval; of 20 figures that are equal in truth, one is told so by chance."
)


def headline(compared: Comparison) -> str:
    """What the first figure says of each contestant against the first."""
    first, *others = compared.contestants
    figure = compared.figures[0]
    value = comparison.text(figure, compared.interval(first, figure))
    if figure.better == 0:  # nobody knows more than that
        return f"{figure.title[0].upper()}{figure.title[1:]}: " + "; ".join(
            f"{name} {comparison.text(figure, compared.interval(name, figure))} {figure.unit}" for name in others
        )
    words = []
    for name in others:
        difference = compared.difference(name, figure)
        told = comparison.judged(figure, difference)
        if told in ("better", "worse"):
            words.append(f"{name} is {told} than {first}")
        elif told:
            words.append(f"{name} and {first} are {told}")
        else:
            words.append(f"{name} against {first}")
        if difference is not None:
            words[-1] += f" ({comparison.text(figure, difference, signed=True)} {figure.unit})"
    said = "; ".join(words) or f"{first} {value} {figure.unit}"
    return f"{figure.title[0].upper()}{figure.title[1:]}: {said}"


def _runs(compared: Comparison) -> str:
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
    return report_page.table(head, rows, numbers=True)
