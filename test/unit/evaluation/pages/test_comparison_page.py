from __future__ import annotations

import numpy as np
import pytest

from glass_nav.evaluation.metrics import comparison, pose_errors
from glass_nav.evaluation.metrics.comparison import Run
from glass_nav.evaluation.pages import comparison_page
from glass_nav.evaluation.plots import comparison_pictures
from glass_nav.geometry.trajectory import Trajectory

STAMPS_NS = np.arange(3, dtype=np.int64) * 10**9
TRUTH = Trajectory(STAMPS_NS, np.zeros((3, 3)))


def run(contestant, seed, error_m, log="a.bag", reference=TRUTH):
    way = np.full((3, 3), [error_m, 0.0, 0.0])
    return Run(
        contestant,
        log,
        seed,
        STAMPS_NS,
        way,
        pose_errors.of(STAMPS_NS, way, reference),
        None,
        None,
        None,
        1.0,
        reference,
    )


def compared(errors_m, log="a.bag"):
    """The first contestant and the others, two runs of each."""
    runs = [run(name, seed, error) for name, errors in errors_m.items() for seed, error in enumerate(errors)]
    return comparison.of(runs, list(errors_m), [log])


def test_the_headline_says_who_is_better_and_by_how_much():
    found = compared({"old": (0.4, 0.5), "new": (0.3, 0.4), "odd": (0.9, 0.2), "same": (0.4, 0.5)})
    assert comparison_page.headline(found) == (
        "Position error, mean: new is better than old (-0.1000 ± 0.0000 m); odd and old are not significantly "
        "different (+0.1000 ± 5.0825 m); same and old are equal (+0.0000 ± 0.0000 m)"
    )
    assert comparison_page.headline(compared({"old": (0.5, 0.5)})) == "Position error, mean: old 0.5000 ± 0.0000 m"


def test_without_a_ground_truth_the_headline_is_how_far_they_are_apart():
    runs = [run("one", 0, 0.1, reference=None), run("two", 0, 0.4, reference=None)]
    assert comparison_page.headline(comparison.of(runs, ["one", "two"], ["a.bag"])) == (
        "Distance from the first: two 0.3000 m"
    )


@pytest.mark.long_run
def test_names_are_no_markup(tmp_path):
    found = compared({"<b>": (0.4, 0.5), "a&b": (0.3, 40.0)})
    drawn = comparison_pictures.draw_all(tmp_path, found, {})
    comparison_page.write(tmp_path / "page.html", found, drawn, {"what": {"<b>": "<i>", "a&b": "x"}})
    page = (tmp_path / "page.html").read_text()
    assert "<b>" not in page and "<i>" not in page
    assert "&lt;b&gt;" in page and "a&amp;b" in page


@pytest.mark.long_run
def test_numbers_of_a_table_are_aligned(tmp_path):
    found = compared({"old": (0.4, 0.5), "new": (0.3, 0.4)})
    drawn = comparison_pictures.draw_all(tmp_path, found, {})
    comparison_page.write(tmp_path / "page.html", found, drawn, {"what": {"old": "a", "new": "b"}})
    page = (tmp_path / "page.html").read_text()
    assert '<th scope="col">figure</th><th scope="col" class="number">old</th>' in page
    assert '<th scope="row">position error, mean [m]</th><td class="number">0.450' in page
    assert '<th scope="row">old</th><td>a</td>' in page


@pytest.mark.long_run
def test_a_sweep_over_many_logs_has_pictures_of_the_first_ones(tmp_path):
    logs = [f"{number}.bag" for number in range(comparison_pictures.MAX_LOGS + 2)]
    found = comparison.of([run("one", 0, 0.1, log=log) for log in logs], ["one"], logs)
    drawn = comparison_pictures.draw_all(tmp_path, found, {})
    assert len(drawn) == 1 + comparison_pictures.MAX_LOGS
    comparison_page.write(tmp_path / "page.html", found, drawn, {"what": {"one": "the defaults"}})
    assert "<p>2 more logs have no pictures of their own.</p>" in (tmp_path / "page.html").read_text()


@pytest.mark.long_run
def test_a_run_that_never_came_back_and_one_without_an_end_are_drawn(tmp_path):
    found = compared({"old": (0.0, 0.5), "new": (np.nan, np.nan)})
    assert {picture.path.name for picture in comparison_pictures.draw_all(tmp_path, found, {})} == {
        "compare.png",
        "errors_01.png",
    }
