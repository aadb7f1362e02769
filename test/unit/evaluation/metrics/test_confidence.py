from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from glass_nav.evaluation.metrics import confidence
from glass_nav.evaluation.metrics.confidence import Interval


def test_the_interval_of_three_runs_is_students():
    found = confidence.of_strata([np.array([1.0, 2.0, 3.0])])
    assert found.mean == 2.0
    assert found.half_width == pytest.approx(4.302653 * 1.0 / math.sqrt(3.0))  # t of 2 degrees of freedom, by the table


def test_what_differs_between_logs_is_no_uncertainty():
    near, far = np.array([1.0, 1.1, 1.2]), np.array([101.0, 101.1, 101.2])
    found = confidence.of_strata([near, far])
    assert found.mean == pytest.approx(51.1)
    # Both groups have the variance 0.01 and 2 degrees of freedom: together 4, by Welch and Satterthwaite.
    assert found.half_width == pytest.approx(2.776445 * math.sqrt(2 * 0.25 * 0.01 / 3))


@pytest.mark.parametrize("seed", range(5))
def test_a_difference_of_two_groups_ends_where_welchs_test_does(seed):
    """Second implementation: at either end of the interval scipy's test has the p value 0.05."""
    rng = np.random.default_rng(seed)
    a, b = rng.normal(0.0, 1.0, 4), rng.normal(0.5, 3.0, 7)
    found = confidence.of_sum([(1.0, a), (-1.0, b)])
    for end in (found.mean - found.half_width, found.mean + found.half_width):
        assert stats.ttest_ind(a - end, b, equal_var=False).pvalue == pytest.approx(0.05)


@pytest.mark.parametrize("runs, least, most", [(3, 0.95, 0.98), (5, 0.935, 0.965)])  # of very few: rather too wide
def test_nineteen_of_twenty_intervals_hold_the_truth(runs, least, most):
    rng, trials = np.random.default_rng(7), 2000
    held = 0
    for _ in range(trials):
        found = confidence.of_strata([rng.normal(mean, 0.5, runs) for mean in (1.0, 2.0, 3.0)])
        held += abs(found.mean - 2.0) <= found.half_width
    assert least < held / trials < most


def test_one_run_alone_says_nothing_of_its_scatter():
    assert confidence.of_strata([np.array([1.0, 2.0]), np.array([5.0])]) == Interval(3.25, None)


def test_runs_that_are_all_alike_leave_no_doubt():
    assert confidence.of_strata([np.array([0.5, 0.5]), np.array([1.5, 1.5])]) == Interval(1.0, 0.0)


def test_a_run_that_never_came_back_makes_the_mean_infinite():
    assert confidence.of_strata([np.array([0.5, math.inf])]) == Interval(math.inf, None)


@pytest.mark.parametrize(
    "interval, sign",
    [
        (Interval(0.3, 0.2), 1),
        (Interval(-0.3, 0.2), -1),
        (Interval(0.1, 0.2), 0),
        (Interval(0.2, 0.2), 0),
        (Interval(0.3, None), 0),
        (Interval(0.0, 0.0), 0),
    ],
)
def test_a_sign_is_told_where_zero_is_outside(interval, sign):
    assert interval.sign == sign
