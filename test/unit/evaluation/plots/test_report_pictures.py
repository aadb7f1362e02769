from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from made_results import GRID, a_result
from matplotlib.figure import Figure
from PIL import Image

from glass_nav.evaluation.metrics import replay_result, run_story
from glass_nav.evaluation.metrics.replay_result import NO_BEAM, KeptScan
from glass_nav.evaluation.pages import report_page
from glass_nav.evaluation.plots import report_pictures
from glass_nav.evaluation.plots.report import cases_over_time, driven_path, reliability, worst_scans
from glass_nav.evaluation.plots.report.ground import Ground
from glass_nav.vocabulary import BeamCase
from glass_nav.world.grid_map import GridMap

KEPT = [
    KeptScan(1, np.array([0.1, 0.0, 0.0]), np.array([[2.0, 0.0], [np.nan, np.nan]])),
    KeptScan(3, np.zeros(3), np.array([[0.0, 1.0]])),
]
GLASS = np.where(GRID.occupancy == 100, 80, -1).astype(np.int8)


@pytest.mark.long_run
@pytest.mark.parametrize(
    "changes, there, absent",
    [
        pytest.param({}, {"reliability", "errors"}, {"candidates"}, id="with a reference"),
        pytest.param(
            {"reference": None, "states": ["GLOBAL_SEARCH"] * 4}, {"candidates"}, set(), id="never found, no truth"
        ),
        pytest.param(
            {"states": ["GLOBAL_SEARCH", "GLOBAL_SEARCH", "LOCALIZED", "NEW"]},
            {"candidates"},
            set(),
            id="found, and a state of tomorrow",
        ),
        pytest.param({"map_from_base": np.full((4, 3), np.nan)}, {"way"}, set(), id="no pose at all"),
        pytest.param(
            {"cases": np.full((4, 2), NO_BEAM, np.uint8), "updated": np.zeros(4, bool)},
            {"update_time"},
            set(),
            id="no beam, no update",
        ),
    ],
)
def test_pictures_are_drawn_whatever_came_out(tmp_path, changes, there, absent, recwarn):
    drawn, worst = report_pictures.draw_all(tmp_path, a_result(worst=KEPT, **changes), Ground(GRID, GLASS), None)
    names = {picture.path.stem for picture in drawn}
    assert {"way", "cases_over_time", "glass", "errors", "reliability", "update_time"} | there <= names
    assert not absent & names
    assert [picture.path.name for picture in worst] == ["worst_01.png", "worst_02.png"]
    for picture in drawn + worst:
        with Image.open(picture.path) as image:
            assert min(image.size) > 200
    assert not [str(warning.message) for warning in recwarn if "glass_nav" in str(warning.filename)]


@pytest.mark.long_run
def test_one_scan_is_a_run_too(tmp_path):
    whole = a_result(worst=KEPT[:1])
    one = replace(
        whole,
        **{
            name: value[1:2]
            for name, value in vars(whole).items()
            if isinstance(value, (np.ndarray, list)) and name not in ("worst", "examples")
        },
        worst=[replace(KEPT[0], row=0)],
    )
    drawn, worst = report_pictures.draw_all(tmp_path, one, Ground(GRID, None), np.eye(5, dtype=int))
    assert "confusion" in {picture.path.stem for picture in drawn}
    assert "glass" not in {picture.path.stem for picture in drawn}
    report_page.write(tmp_path / "report.html", "one", run_story.of(one), drawn, worst, {})
    assert (tmp_path / "report.html").stat().st_size > 10_000


def test_the_ribbon_holds_the_share_of_each_case_at_each_time():
    edges, share = cases_over_time.case_shares(a_result())
    np.testing.assert_allclose(edges[:4], [0.0, 1.0, 2.0, 3.0])
    np.testing.assert_allclose(share, [[0, 1, 0, 0, 0], [0.5, 0, 0, 0.5, 0], [0, 0.5, 0.5, 0, 0], [0, 1, 0, 0, 0]])


def test_a_long_run_has_pieces_that_hold_all_of_its_beams():
    rng = np.random.default_rng(3)
    scans = 1003
    result = a_result()
    cases = rng.integers(0, 5, (scans, 7)).astype(np.uint8)
    long = replace(result, stamps_ns=10**9 * np.arange(scans), cases=cases)
    edges, share = cases_over_time.case_shares(long)
    assert len(edges) == len(share) + 1 == 401
    assert (np.diff(edges) > 0).all()
    seconds = np.arange(scans)
    piece = (seconds >= edges[17]) & (seconds < edges[18])
    np.testing.assert_allclose(share[17], np.bincount(cases[piece].ravel(), minlength=5) / cases[piece].size)


def test_a_class_of_reliability_tells_how_often_it_was_right():
    reported = np.array([0.05, 0.95, 0.96, 0.99, 1.0, 0.55, 0.51])
    right = np.array([False, True, True, True, False, True, False])
    middle, share, counts = reliability.calibration(reported, right)
    np.testing.assert_allclose(middle, [0.05, 0.55, 0.95])
    np.testing.assert_allclose(share, [0.0, 0.5, 0.75])
    np.testing.assert_array_equal(counts, [1, 2, 4])


def test_places_that_were_only_candidates_do_not_widen_the_picture():
    poses = np.array([[900.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]])
    result = a_result(map_from_base=poses, reference=None, states=["GLOBAL_SEARCH"] + ["LOCALIZED"] * 3)
    low, high = driven_path.bounds(result)
    assert (low <= [1 - 3.0, -3.0]).all() and (high >= [3 + 3.0, 3.0]).all()
    assert high[0] < 20.0


@pytest.mark.long_run
def test_a_bad_scan_is_shown_where_it_was_thought_to_be_and_where_it_was(tmp_path):
    """A beam of case 4 that ends 2 m ahead: left at the estimate, right at the truth, a metre lower in the map."""
    empty = GridMap(np.zeros((100, 100), np.int8), 0.1, np.array([-5.0, -5.0, 0.0]))
    result = a_result(
        cases=np.full((4, 1), 4, np.uint8),
        worst=[KeptScan(1, np.zeros(3), np.array([[2.0, 0.0]]))],
        map_from_base=np.array([[i, 1.0, 0.0] for i in range(4)], float),
    )
    _, (picture,) = report_pictures.draw_all(tmp_path, result, Ground(empty, None), None)
    assert "2 m" not in picture.title and picture.title.startswith("1. At 1.0 s: 1.00 m and 0.0° off")
    with Image.open(picture.path) as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    wanted = [int(BeamCase(4).colour[i : i + 2], 16) for i in (1, 3, 5)]
    rows, columns = np.nonzero(np.abs(pixels - wanted).max(axis=2) < 3)
    left = columns < pixels.shape[1] / 2
    assert left.any() and (~left).any()
    assert rows[left].mean() < rows[~left].mean() - 20


@pytest.mark.long_run
def test_the_page_takes_texts_as_texts(tmp_path):
    result = a_result(reasons=["<script>alert(1)</script> & more"] * 4)
    drawn, worst = report_pictures.draw_all(tmp_path, result, Ground(GRID, None), None)
    report_page.write(
        tmp_path / "report.html",
        "a <b> log",
        run_story.of(result),
        drawn,
        worst,
        {"a": {"b": None, "c": [1.25, 2]}, "d<": "x"},
    )
    page = (tmp_path / "report.html").read_text()
    assert "<script" not in page
    assert "&lt;script&gt;alert(1)&lt;/script&gt; &amp; more" in page
    assert "<title>a &lt;b&gt; log</title>" in page
    assert '<th scope="row">a.b</th><td>–</td>' in page
    assert '<th scope="row">a.c</th><td>1.25; 2</td>' in page
    assert "worst" not in page.partition("<main")[2].replace("worst scans, pictured below", "")


def test_a_kept_scan_comes_back_as_it_was(tmp_path):
    replay_result.write(a_result(worst=KEPT), tmp_path, {})
    kept = replay_result.read(tmp_path)[0].worst
    assert [each.row for each in kept] == [1, 3]
    np.testing.assert_allclose(kept[0].points_m, KEPT[0].points_m)
    np.testing.assert_allclose(kept[1].points_m, [[0.0, 1.0], [np.nan, np.nan]])
    np.testing.assert_array_equal(kept[0].base_from_laser, [0.1, 0.0, 0.0])


NAMED = re.compile(r".+ \[.+\]$")


@pytest.mark.long_run
def test_every_axis_of_a_report_has_a_name_and_a_unit(tmp_path, monkeypatch):
    figures = []
    made = Figure.__init__

    def remember(self, *args, **kwargs):
        made(self, *args, **kwargs)
        figures.append(self)

    monkeypatch.setattr(Figure, "__init__", remember)
    report_pictures.draw_all(tmp_path, a_result(worst=KEPT[:1]), Ground(GRID, None), None)
    assert len(figures) >= 6
    for figure in figures:
        for axes in figure.axes:
            labels = [axes.get_ylabel()] if axes.get_xlabel() == "" else [axes.get_xlabel(), axes.get_ylabel()]
            assert all(NAMED.match(label.replace("\n", " ")) for label in labels), labels


def test_the_worst_scan_is_laid_over_itself_at_the_true_pose(tmp_path):
    empty = GridMap(np.zeros((100, 100), np.int8), 0.1, np.array([-5.0, -5.0, 0.0]))
    result = a_result(
        cases=np.full((4, 1), 4, np.uint8),
        worst=[KeptScan(1, np.zeros(3), np.array([[2.0, 0.0]]))],
        map_from_base=np.array([[i, 1.0, 0.0] for i in range(4)], float),
    )
    picture = worst_scans.draw(tmp_path, result, Ground(empty, None), 1, result.worst[0])
    assert "where the same beams end at the true pose" in picture.caption
