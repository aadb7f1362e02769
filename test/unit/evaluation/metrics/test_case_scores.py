from __future__ import annotations

import numpy as np
import pytest

from glass_nav.evaluation.metrics import case_scores
from glass_nav.evaluation.metrics.case_scores import SurfaceScores


def scores(true, reported, answered=None):
    return case_scores.of_cases(
        np.array(true, np.uint8),
        np.array(reported, np.uint8),
        np.ones(len(true), bool) if answered is None else np.array(answered, bool),
    )


def test_ten_beams_worked_by_hand():
    # 4 diffuse: 3 reported so, 1 uncertain; 3 penetrations: 2 reported, 1 taken for diffuse; 1 mirrored, unexplained;
    # 2 without an answer, uncertain as they should be.
    found = scores([1, 1, 1, 1, 3, 3, 3, 2, 0, 0], [1, 1, 1, 0, 3, 3, 1, 0, 0, 0], [1] * 8 + [0, 0])
    expected = np.zeros((5, 5), int)
    expected[1, 1], expected[1, 0], expected[3, 3], expected[3, 1], expected[2, 0], expected[0, 0] = 3, 1, 2, 1, 1, 2
    np.testing.assert_array_equal(found.confusion, expected)
    figures = found.metrics()
    assert figures["beams"] == 10
    assert figures["beams_answered"] == 8
    assert figures["accuracy"] == pytest.approx(0.7)
    assert figures["accuracy_answered"] == pytest.approx(5 / 8)
    assert figures["precision"] == pytest.approx([2 / 4, 3 / 4, None, 1.0, None])
    assert figures["recall"] == pytest.approx([1.0, 3 / 4, 0.0, 2 / 3, None])
    assert figures["f1"] == pytest.approx([2 / 3, 3 / 4, 0.0, 4 / 5, None])
    assert figures["macro_f1_cases"] == [0, 1, 2, 3]
    assert figures["macro_f1"] == pytest.approx((2 / 3 + 3 / 4 + 0.0 + 4 / 5) / 4)
    assert figures["used_share"] == pytest.approx(6 / 8)
    assert figures["true_share"] == pytest.approx([0.2, 0.4, 0.1, 0.3, 0.0])
    assert figures["told_share"] == pytest.approx([0.4, 0.4, 0.0, 0.2, 0.0])


def test_a_case_below_one_percent_of_the_beams_counts_in_no_macro_f1():
    figures = scores([2] + [1] * 199, [1] * 200).metrics()
    assert figures["macro_f1_cases"] == [1]
    assert scores([2] + [1] * 99, [1] * 100).metrics()["macro_f1_cases"] == [1, 2]


def test_scores_of_parts_add_up_to_the_scores_of_the_whole():
    rng = np.random.default_rng(5)
    true, reported, answered = rng.integers(0, 5, 500), rng.integers(0, 5, 500), rng.random(500) < 0.7
    parts = case_scores.none_yet()
    for part in (slice(0, 13), slice(13, 500)):
        parts = parts + scores(true[part], reported[part], answered[part])
    assert parts.metrics() == scores(true, reported, answered).metrics()


def test_the_figures_agree_with_a_count_beam_by_beam():
    rng = np.random.default_rng(6)
    true, reported = rng.integers(0, 5, 300), rng.integers(0, 5, 300)
    figures = scores(true, reported).metrics()
    assert figures["accuracy"] == pytest.approx(np.mean(true == reported))
    for case in range(5):
        assert figures["precision"][case] == pytest.approx(np.mean(true[reported == case] == case))
        assert figures["recall"][case] == pytest.approx(np.mean(reported[true == case] == case))


def test_without_a_beam_every_figure_is_none():
    figures = case_scores.none_yet().metrics()
    assert figures["accuracy"] is figures["macro_f1"] is figures["used_share"] is None
    assert figures["precision"] == [None] * 5


@pytest.mark.parametrize(
    "true, reported, text",
    [
        ([1, 1], [1], r"expected as many true as reported cases and answers, got \(2,\), \(1,\), \(2,\)"),
        ([5], [1], "true cases must be 0 to 4, got 5 to 5"),
        ([1], [255], "reported cases must be 0 to 4, got 255 to 255"),
    ],
)
def test_what_are_no_cases_is_refused(true, reported, text):
    with pytest.raises(ValueError, match=f"^{text}$"):
        scores(true, reported)


def test_five_beams_of_scan_surfaces_worked_by_hand():
    crossing = np.array([2.0, 2.0, 2.0, np.nan, np.nan])
    # cut where the pane is, cut 0.2 m before it, left alone; one cut that met no pane, one left alone
    found = case_scores.of_surfaces(crossing, np.array([2.1, 1.8, 7.0, 3.0, np.inf]), np.array([1, 1, 0, 1, 0]), True)
    assert found == SurfaceScores(
        at_pane=3, at_pane_cut=2, at_pane_cut_near=1, others=2, others_cut=1, scans=1, scans_trusted=1
    )
    both = found + case_scores.of_surfaces(crossing, np.full(5, 9.0), np.zeros(5), False)
    figures = both.metrics()
    assert figures["cut_at_pane_share"] == pytest.approx(1 / 6)
    assert figures["cut_wrongly_share"] == pytest.approx(1 / 4)
    assert figures["trusted_share"] == 0.5
    assert figures["at_pane"] == 6
    assert SurfaceScores().metrics()["cut_at_pane_share"] is None
