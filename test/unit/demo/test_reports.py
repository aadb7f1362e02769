from __future__ import annotations

import numpy as np

from glass_nav.demo.reports import Reports, SearchNews
from glass_nav.vocabulary import SearchState


def news(stamp_ns: int, state: SearchState) -> SearchNews:
    return SearchNews(stamp_ns, state, "why", 0, 1, "")


def test_the_first_news_of_each_meetpoint_is_a_row() -> None:
    reports = Reports()
    for stamp_ns, state in (
        (0, SearchState.WAITING),
        (5, SearchState.SEARCHING),
        (5, SearchState.IDLE),
        (9, SearchState.LOST),
        (0, SearchState.WAITING),
    ):
        reports.take_search(news(stamp_ns, state))
    assert [(row.stamp_ns, row.state) for row in reports.rows] == [(5, "SEARCHING"), (9, "LOST")]
    assert reports.search is not None and reports.search.state == SearchState.WAITING


def test_truth_is_in_order_however_it_came() -> None:
    reports = Reports()
    assert reports.simulated_s == 0.0 and reports.true_path_m().shape == (0, 2)
    for second in (3, 1, 2):
        reports.truth[second * 10**9] = np.array([float(second), 0.0, 0.0])
    assert reports.simulated_s == 3.0 and reports.newest_truth[0] == 3.0
    assert reports.true_path_m(from_ns=2 * 10**9)[:, 0].tolist() == [2.0, 3.0]
    assert reports.true_path_m(to_ns=2 * 10**9)[:, 0].tolist() == [1.0, 2.0]
    assert reports.true_trajectory().at(np.int64(15 * 10**8))[0] == 1.5
