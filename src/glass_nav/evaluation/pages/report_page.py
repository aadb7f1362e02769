"""A report as one HTML file: pictures inside, nothing fetched, no script. Opens from a USB stick and prints.

The page's own Content-Security-Policy forbids it to ask any address for anything.
"""

from __future__ import annotations

import base64
from html import escape
from pathlib import Path
from typing import Any, Iterable, List, Mapping, Sequence

from glass_nav.evaluation.metrics.run_story import Episode, Story, duration
from glass_nav.evaluation.plots.canvas import Picture
from glass_nav.vocabulary import CASES_IN_ORDER, state_colour

_SHOWN = 5  # episodes on the first screen; the longest of more
_MOMENTS = 4  # of the worst scans there

_STYLE = """
:root { color-scheme: light dark; --page: #f4f5f7; --card: #fff; --text: #1c2230; --dim: #59617a; --line: #d9dde6;
  --good: #1d7a3a; --fair: #9a6700; --bad: #b3261e; --link: #0b57d0; }
@media (prefers-color-scheme: dark) { :root { --page: #14171f; --card: #1e222d; --text: #e6e9f0; --dim: #a3abbf;
  --line: #343a49; --good: #5fd083; --fair: #e8b84a; --bad: #ff8a80; --link: #8ab4f8; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--text); line-height: 1.45;
  font-family: system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", "DejaVu Sans", sans-serif; }
main { max-width: 78rem; margin: 0 auto; padding: 1rem 1.25rem 3rem; }
a { color: var(--link); }
.skip { position: absolute; left: -100rem; } .skip:focus { left: 1rem; }
.log { color: var(--dim); margin: 0; font-size: .9rem; overflow-wrap: anywhere; }
h1 { font-size: 1.55rem; line-height: 1.2; margin: .15rem 0 .4rem; }
h2 { font-size: 1.2rem; margin: 2rem 0 .6rem; } h3 { font-size: 1rem; margin: 0 0 .4rem; }
.verdict { background: var(--card); border: 1px solid var(--line); border-left: .5rem solid var(--grade);
  border-radius: .5rem; padding: .7rem 1rem; }
.verdict h1 span { color: var(--grade); } .verdict p { margin: .2rem 0; max-width: 110ch; }
.good { --grade: var(--good); } .fair { --grade: var(--fair); } .bad { --grade: var(--bad); }
dl.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(11rem, 1fr)); gap: .6rem; margin: .6rem 0; }
dl.figures div { background: var(--card); border: 1px solid var(--line); border-radius: .5rem; padding: .5rem .75rem; }
dl.figures dt { color: var(--dim); font-size: .8rem; } dl.figures dd { margin: 0; }
dl.figures dd strong { font-size: 1.4rem; font-variant-numeric: tabular-nums; display: block; line-height: 1.2; }
dl.figures dd small { color: var(--dim); }
.first { display: grid; grid-template-columns: minmax(0, 1.9fr) minmax(16rem, 1fr); gap: .8rem; align-items: start; }
@media (max-width: 55rem) { .first { grid-template-columns: minmax(0, 1fr); } }
.card, figure { background: var(--card); border: 1px solid var(--line); border-radius: .5rem; padding: .75rem;
  margin: 0; }
figure img { display: block; width: auto; max-width: 100%; height: auto; margin: 0 auto; background: #fff;
  border-radius: .25rem; }
.first figure img { max-height: 50vh; }
figcaption { color: var(--dim); font-size: .85rem; margin-top: .4rem; } figcaption strong { color: var(--text); }
ul.moments { list-style: none; margin: 0; padding: 0; font-size: .88rem; }
.card + .card { margin-top: .8rem; }
ol.story { list-style: none; margin: 0; padding: 0; font-size: .88rem; }
ol.story li { border-left: .3rem solid var(--state); padding: .1rem 0 .1rem .6rem; margin-bottom: .45rem; }
ol.story time, ol.story small { color: var(--dim); } ol.story small { display: block; }
.ribbon { display: flex; height: 1.1rem; border-radius: .25rem; overflow: hidden; margin: .3rem 0 .8rem; }
.pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(30rem, 100%), 1fr)); gap: .8rem; }
.pictures .wide { grid-column: 1 / -1; }
nav ul { display: flex; flex-wrap: wrap; gap: .2rem 1rem; list-style: none; padding: 0; margin: .6rem 0 0;
  font-size: .9rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .88rem; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: .2rem .8rem .2rem 0; border-bottom: 1px solid var(--line); vertical-align: top;
  overflow-wrap: anywhere; }
table.numbers th, table.numbers td { overflow-wrap: normal; }
th { font-weight: 600; } td.number, th.number { text-align: right; }
@media print { :root { --page: #fff; --card: #fff; --text: #000; --dim: #444; --line: #bbb; --good: #1d7a3a;
  --fair: #7a5200; --bad: #b3261e; } body { font-size: 10pt; } main { max-width: none; padding: 0; }
  nav { display: none; }
  figure, .card, .verdict, dl.figures div { break-inside: avoid; } h2 { break-after: avoid; }
  .first figure img { max-height: 11cm; } * { print-color-adjust: exact; -webkit-print-color-adjust: exact; } }
"""


def write(
    path: Path,
    title: str,
    story: Story,
    pictures: Sequence[Picture],
    worst: Sequence[Picture],
    metrics: Mapping[str, Any],
) -> None:
    """The report of one run; the first of the pictures is that of the first screen."""
    first, *rest = pictures
    body = [
        f'<section class="verdict {story.grade}" aria-labelledby="verdict"><p class="log">{escape(title)}</p>',
        f'<h1 id="verdict"><span>{escape(_MARKS[story.grade])}</span> {escape(story.headline)}</h1>',
        f"<p>{' '.join(escape(sentence) for sentence in story.sentences)}</p></section>",
        '<dl class="figures">',
        *(
            f"<div><dt>{escape(each.name)}</dt><dd><strong>{escape(each.value)}</strong>"
            f"<small>{escape(each.note)}</small></dd></div>"
            for each in story.figures
        ),
        "</dl>",
        '<div class="first">',
        framed(first, lazy=False),
        "<div>",
        _happened(story.episodes),
        _moments(worst),
        "</div></div>",
        _contents(bool(worst)),
        '<h2 id="run">The run in pictures</h2><div class="pictures">',
        *(framed(each) for each in rest),
        "</div>",
    ]
    if worst:
        body += [
            '<h2 id="worst">The worst scans</h2><p>Each from another part of the log, the worst first; beams '
            f"coloured by case: {_legend()}.</p>",
            '<div class="pictures">',
            *(framed(each) for each in worst),
            "</div>",
        ]
    body += ['<h2 id="figures">All figures</h2>', table(["figure", "value"], _rows(metrics))]
    path.write_text(page(title, body), encoding="utf-8")


_MARKS = {"good": "✔", "fair": "◐", "bad": "✘"}


def page(title: str, body: Iterable[str]) -> str:
    """A whole page, which asks no address for anything."""
    return "\n".join(
        [
            "<!DOCTYPE html>",
            '<html lang="en">',
            "<head>",
            '<meta charset="utf-8">',
            '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; img-src data:; '
            "style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'\">",
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            '<meta name="color-scheme" content="light dark">',
            f"<title>{escape(title)}</title>",
            '<link rel="icon" href="data:,">',
            f"<style>{_STYLE}</style>",
            "</head>",
            "<body>",
            '<a class="skip" href="#content">To the content</a>',
            '<main id="content">',
            *body,
            "</main>",
            "</body>",
            "</html>",
            "",
        ]
    )


def table(head: Sequence[str], rows: Iterable[Sequence[str]], numbers: bool = False) -> str:
    """A table, the first column naming the rows; with numbers, all others are aligned to the right."""
    kind = ' class="number"' if numbers else ""
    titles = "".join(f'<th scope="col"{kind if column else ""}>{escape(cell)}</th>' for column, cell in enumerate(head))
    lines = "".join(
        f'<tr><th scope="row">{escape(row[0])}</th>'
        + "".join(f"<td{kind}>{escape(cell)}</td>" for cell in row[1:])
        + "</tr>"
        for row in rows
    )
    whole = ' class="numbers"' if numbers else ""
    return f'<div class="scroll"><table{whole}><thead><tr>{titles}</tr></thead><tbody>{lines}</tbody></table></div>'


def picture(path: Path, alt: str, lazy: bool = True) -> str:
    """An <img> with the file inside."""
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    loading = ' loading="lazy"' if lazy else ""
    return f'<img src="data:image/png;base64,{data}" alt="{escape(alt, quote=True)}"{loading}>'


def framed(each: Picture, lazy: bool = True) -> str:
    """A picture with its title and caption, its id the name of the file."""
    wide = "" if each.path.stem.startswith(("worst", "confusion")) else ' class="wide"'
    return (
        f'<figure{wide} id="{escape(each.path.stem)}">'
        f"<h3>{escape(each.title)}</h3>{picture(each.path, each.alt, lazy)}"
        f"<figcaption>{escape(each.caption)} <span>({escape(each.path.name)})</span></figcaption></figure>"
    )


def _happened(episodes: List[Episode]) -> str:
    """What it said of itself and when: all in a ribbon, the longest in words."""
    total = max(episodes[-1].end_s, 1e-9)
    ribbon = "".join(
        f'<span style="flex:{max(each.duration_s / total, 1e-4):.5f} 1 0;background:{_colour(each)}"></span>'
        for each in episodes
    )
    told = sorted(
        sorted(episodes, key=lambda each: each.duration_s, reverse=True)[:_SHOWN], key=lambda each: each.first
    )
    items = [
        f'<li style="--state:{_colour(each)}"><strong>{escape(each.state)}</strong> <time>'
        f"{each.start_s:.1f} s – {each.end_s:.1f} s ({duration(each.duration_s)})</time>"
        f"<small>{escape(each.reason)}</small></li>"
        for each in told
    ]
    more = len(episodes) - len(told)
    note = f"<p>The {len(told)} longest of {len(episodes)} spells.</p>" if more else ""
    return (
        f'<section class="card" aria-label="What it said of itself"><h3>What it said of itself, and when</h3>'
        f'<div class="ribbon" aria-hidden="true">{ribbon}</div><ol class="story">{"".join(items)}</ol>{note}'
        "</section>"
    )


def _moments(worst: Sequence[Picture]) -> str:
    """Where to look first."""
    if not worst:
        return ""
    items = "".join(f'<li><a href="#{each.path.stem}">{escape(each.title)}</a></li>' for each in worst[:_MOMENTS])
    return (
        '<section class="card" aria-label="Worst moments"><h3>Its worst moments</h3>'
        f'<ul class="moments">{items}</ul></section>'
    )


def _colour(episode: Episode) -> str:
    return state_colour(episode.state)


def _contents(worst: bool) -> str:
    links = [
        ("run", "The run in pictures"),
        *([("worst", "The worst scans")] if worst else []),
        ("figures", "All figures"),
    ]
    return (
        '<nav aria-label="Contents"><ul>'
        + "".join(f'<li><a href="#{target}">{name}</a></li>' for target, name in links)
        + "</ul></nav>"
    )


def _legend() -> str:
    return ", ".join(
        f'<span style="border-left:.8rem solid {case.colour};padding-left:.3rem">{escape(case.label)}</span>'
        for case in CASES_IN_ORDER
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
