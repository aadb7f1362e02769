from __future__ import annotations

import math

import pytest

from glass_nav.evaluation.metrics import thresholds

METRICS = {
    "scans": 10,
    "scans_without_ground_truth": 2,
    "position_p95_m": 0.31,
    "position_max_m": None,
    "times_real_time": 25.0,
    "state_share": {"LOCALIZED": 1.0},
    "case_share": {"0": 0.1},
    "cases": None,
}


@pytest.mark.parametrize(
    "text, failure",
    [
        ("position_p95_m>0.3", "position_p95_m is 0.31: failed by --fail-if position_p95_m > 0.3"),
        ("position_p95_m > 0.31", None),
        ("position_p95_m>=0.31", "position_p95_m is 0.31: failed by --fail-if position_p95_m >= 0.31"),
        ("times_real_time<20", None),
        ("times_real_time <= 25", "times_real_time is 25: failed by --fail-if times_real_time <= 25"),
        ("state_share.LOST>0", None),
        ("state_share.LOCALIZED<1", None),
        ("position_max_m>1e6", "position_max_m is inf: failed by --fail-if position_max_m > 1e+06"),
    ],
)
def test_a_run_fails_beyond_a_limit_and_not_at_it(text, failure):
    assert thresholds.parse(text).failure(METRICS) == failure


@pytest.mark.parametrize(
    "text, metrics",
    [
        ("cases.accuracy<0.9", METRICS),
        ("position_p95_m>0.3", {"scans": 10, "scans_without_ground_truth": None, "position_p95_m": None}),
        ("position_p95_m>0.3", {"scans": 10, "scans_without_ground_truth": 10, "position_p95_m": None}),
    ],
)
def test_a_figure_that_the_log_cannot_give_neither_passes_nor_fails(text, metrics):
    limit = thresholds.parse(text)
    with pytest.raises(ValueError, match=f"^--fail-if {limit.metric} .*: this log gives no {limit.metric}; it has no "):
        limit.failure(metrics)


@pytest.mark.parametrize(
    "text",
    [
        "position_p95_m",
        "position_p95_m=0.3",
        "position_p95_m>",
        "position_p95_m>far",
        "position_p95_m>nan",
        "> 0.3",
        "",
    ],
)
def test_what_is_no_limit_is_refused(text):
    with pytest.raises(ValueError) as caught:
        thresholds.parse(text)
    assert str(caught.value) == (
        f"--fail-if must be METRIC, one of >= <= > <, and a number, such as position_p95_m>0.3, got {text!r}"
    )


def test_an_unknown_figure_is_refused_with_the_known_ones_on_one_line():
    with pytest.raises(ValueError) as caught:
        thresholds.parse("position_p59_m>0.3")
    line = str(caught.value)
    assert line.startswith("--fail-if: unknown metric 'position_p59_m'; did you mean position_p95_m? Known: position_")
    assert "\n" not in line
    with pytest.raises(ValueError, match=r"^--fail-if: unknown metric 'x'\. Known: position_"):
        thresholds.parse("x>1")
    assert all(name in line for name in thresholds.KNOWN)


def test_limits_are_numbers():
    assert math.isfinite(thresholds.parse("lost_share>0").limit)
