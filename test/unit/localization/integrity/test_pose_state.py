"""Is it lost? What the state is, and what it says why."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.hypotheses.global_search import Candidates
from glass_nav.localization.integrity.kidnap_detector import Verdict
from glass_nav.localization.integrity.pose_state import PoseQuality, QualityLimits
from glass_nav.localization.particle_filter.pose_estimate import PoseEstimate


def best(position_sigma_m=0.05, heading_sigma_rad=0.02, share=1.0):
    covariance = np.diag([0.01, position_sigma_m, heading_sigma_rad]) ** 2
    return PoseEstimate(np.zeros(3), covariance, share, np.ones(1, bool))


LIMITS = QualityLimits(
    localized_max_position_sigma_m=0.3,
    localized_max_heading_sigma_rad=0.2,
    localized_min_cluster_share=0.8,
    uncertain_used_share=0.4,
    lost_used_share=0.2,
)


SURE = dict(fit=0.95, usual=0.95, log_ratio=-np.inf, doubted=False, found=None, candidates=None)


def candidates(count=3, fit=0.9):
    weights = np.exp(-3.0 * np.arange(count))
    poses = np.column_stack([2.0 + 3.0 * np.arange(count), np.ones(count), np.full(count, np.pi / 2)])
    return Candidates(poses, weights / weights.sum(), fit, 3.0, False)


def judgement(inlier_ratios, estimate=None, **verdict):
    quality = PoseQuality(LIMITS)
    for inlier_ratio in inlier_ratios:
        quality.observe(inlier_ratio)
    if verdict:
        quality.doubt(Verdict(**{**SURE, **verdict}))
    return quality.judge(best() if estimate is None else estimate)


def judged(inlier_ratios, estimate=None, **verdict):
    told = judgement(inlier_ratios, estimate, **verdict)
    return told.state, told.reason


def test_a_narrow_pose_that_explains_the_scan_is_localized():
    state, reason = judged([0.9, 0.9, 0.9])
    assert state == "LOCALIZED"
    assert reason == (
        "the map explains 90% of the beams that it covers; 100% of the weight in one place, sigma 0.05 m, 1.1 deg"
    )


def test_before_the_first_scan_nothing_is_believed():
    assert judged([]) == (
        "UNCERTAIN",
        "no scan has been used yet; 100% of the weight in one place, sigma 0.05 m, 1.1 deg",
    )


@pytest.mark.parametrize(
    "estimate",
    [
        pytest.param(best(position_sigma_m=0.31), id="position"),
        pytest.param(best(heading_sigma_rad=0.21), id="heading"),
        pytest.param(best(share=0.79), id="two places"),
    ],
)
def test_a_wide_pose_is_uncertain_however_well_it_explains_the_scan(estimate):
    assert judged([1.0] * 10, estimate)[0] == "UNCERTAIN"


def test_the_widest_direction_counts_not_an_axis():
    turn = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])
    covariance = np.zeros((3, 3))
    covariance[:2, :2] = turn @ np.diag([0.35**2, 0.0]) @ turn.T  # neither sigma_x nor sigma_y is above 0.3
    assert judged([1.0], PoseEstimate(np.zeros(3), covariance, 1.0, np.ones(1, bool)))[0] == "UNCERTAIN"


@pytest.mark.parametrize(
    "inlier_ratio, state",
    [(0.41, "LOCALIZED"), (0.39, "UNCERTAIN"), (0.21, "UNCERTAIN"), (0.19, "LOST"), (0.0, "LOST")],
)
def test_what_the_map_explains_decides_however_sure_the_filter_is(inlier_ratio, state):
    assert judged([inlier_ratio] * 3)[0] == state


def test_one_bad_scan_loses_nobody_and_many_do():
    assert judged([0.9] * 5 + [0.0])[0] == "LOCALIZED"
    assert judged([0.9] * 5 + [0.0] * 20)[0] == "LOST"


def test_a_lost_robot_that_sees_what_it_should_again_is_found():
    assert judged([0.0] * 5 + [0.9] * 20)[0] == "LOCALIZED"


def test_the_past_weighs_four_fifths():
    # 0.5 -> 0.8 x 0.5 + 0.2 x 0.1 = 0.42 -> 0.356
    assert judged([0.5, 0.1])[1].startswith("the map explains 42% ")
    assert judged([0.5, 0.1, 0.1])[1].startswith("the map explains 36% ")


def test_a_scan_without_answers_says_nothing():
    assert judged([0.9, np.nan, np.nan]) == judged([0.9])


def test_a_given_pose_that_was_not_compared_with_other_places_must_be_rather_right_than_wrong():
    told = judgement([0.55] * 3, best(0.1), given=True)
    assert told.state == "UNCERTAIN" and 0.05 < told.confidence < 0.5
    assert told.reason.startswith(f"the probability that the pose is right is only {told.confidence:.0%}; ")
    assert judgement([0.55] * 3, best(0.1)).state == "LOCALIZED"
    assert judgement([0.9] * 3, best(0.05), given=True).state == "LOCALIZED"


def test_a_place_that_overtook_a_given_pose_contests_it():
    places = dict(candidates=candidates(), elsewhere=np.array([5.0, 1.0, 0.0]))
    assert judgement([0.9] * 3, given=True, log_ratio=0.5, **places).state == "UNCERTAIN"
    assert judgement([0.9] * 3, given=True, log_ratio=-0.5, **places).state == "LOCALIZED"
    assert judgement([0.9] * 3, log_ratio=0.5, **places).state == "LOCALIZED"


@pytest.mark.parametrize(("share", "state"), [(0.45, "UNCERTAIN"), (0.65, "LOCALIZED")])
def test_a_given_pose_that_loses_its_lead_needs_the_usual_reliability(share, state):
    """It starts ahead by 3, and a reliability of 0.5 is enough only while it stays ahead by two thirds of that."""
    judged = judgement([share] * 3, given=True, log_ratio=-1.0, candidates=candidates())
    assert judged.confidence > 0.5
    assert judged.state == state


def test_the_fewer_beams_say_something_the_less_a_scan_counts():
    quality = PoseQuality(LIMITS)
    quality.observe(0.9)
    for _ in range(5):
        quality.observe(0.0, judged_share=0.02)
    assert quality.judge(best()).state == "LOCALIZED"
    for _ in range(5):
        quality.observe(0.0)
    assert quality.judge(best()).state == "UNCERTAIN"


def test_scans_that_fit_better_elsewhere_make_a_pose_uncertain_and_lost_if_they_do_by_far():
    better = dict(fit=0.8, doubted=True, candidates=candidates(), elsewhere=np.array([2.0, 1.0, 0.5]))
    assert judged([0.9], log_ratio=2.0, **better) == (
        "UNCERTAIN",
        "the scans fit as well or better elsewhere, best at x 2.0 m, y 1.0 m, 29 deg; the map explains 90% of the "
        "beams that it covers; 100% of the weight in one place, sigma 0.05 m, 1.1 deg",
    )
    assert judged([0.9], log_ratio=4.0, **better) == (
        "LOST",
        "the scans fit as well or better elsewhere, best at x 2.0 m, y 1.0 m, 29 deg; the map explains 90% of the "
        "beams that it covers",
    )
    assert judged([0.9], log_ratio=-2.0, **better)[0] == "LOCALIZED"


def test_scans_that_fit_here_as_they_used_to_are_not_called_elsewhere():
    """In a corridor without a mark many places fit as well."""
    assert judged([0.9], log_ratio=4.0, candidates=candidates())[0] == "LOCALIZED"


def test_scans_that_fit_far_worse_than_they_used_to_make_a_pose_uncertain():
    state, reason = judged([0.9], fit=0.5, usual=0.9, doubted=True)
    assert state == "UNCERTAIN" and reason.startswith("scan fit 50%, usually 90%; ")
    assert judged([0.9], fit=0.5, usual=0.9)[0] == "UNCERTAIN"
    assert judged([0.9], fit=0.87, usual=0.9, doubted=True)[0] == "LOCALIZED"


def test_odometry_vouches_for_a_pose_where_visitors_hide_the_map():
    assert judged([0.6], fit=0.6, usual=0.9)[0] == "UNCERTAIN"
    assert judged([0.6], fit=0.6, usual=0.9, kept=True)[0] == "LOCALIZED"


def test_a_search_says_how_many_places_are_possible():
    quality = PoseQuality(LIMITS)
    quality.observe(0.9)
    quality.follow_search(candidates(2))
    told = quality.judge(best(share=0.6))
    assert told.state == "GLOBAL_SEARCH"
    assert told.reason == "2 places are possible, the best at x 2.0 m, y 1.0 m, 90 deg, scan fit 90%"
    assert told.confidence == 0.6
    quality.follow_search(candidates(1))
    assert quality.judge(best()).reason.startswith("one place is possible, the best at x 2.0 m")
    quality.follow_search(Candidates(np.zeros((0, 3)), np.zeros(0), np.nan, 0.0, False))
    assert quality.judge(best()).reason == "no usable scan yet"


@pytest.mark.parametrize(
    "worse", [dict(fit=0.6), dict(doubted=True, log_ratio=3.0, candidates=candidates())], ids=["fit", "behind"]
)
def test_each_sign_of_a_wrong_pose_makes_it_less_reliable(worse):
    assert judgement([0.95], **worse).confidence < judgement([0.95], fit=0.95).confidence - 0.1


def test_reliability_is_a_chance_and_falls_with_what_the_map_explains_and_with_other_clusters():
    values = [
        judgement([used], best(share=share), fit=0.95).confidence
        for used, share in [(1.0, 1.0), (0.7, 1.0), (0.3, 1.0), (0.3, 0.5), (0.0, 0.5)]
    ]
    assert all(0.0 <= value <= 1.0 for value in values) and values == sorted(values, reverse=True)
    assert values[0] > 0.9 and judgement([]).confidence == 0.0


def test_a_pose_that_is_more_likely_wrong_is_not_called_localized():
    """No sign alone is bad enough."""
    told = judgement([0.6], fit=0.85, usual=0.95, doubted=True)
    assert 0.0 < told.confidence < 0.7 and told.state == "UNCERTAIN"
    assert told.reason.startswith(
        f"the probability that the pose is right is only {told.confidence:.0%}; the map explains "
    )
    assert judgement([0.6], fit=0.95, usual=0.95).state == "LOCALIZED"  # scans fit as they always did here
    assert judgement([0.9], fit=0.93, usual=0.95, doubted=True).state == "LOCALIZED"


@pytest.mark.parametrize(
    "values, text",
    [
        (dict(localized_max_position_sigma_m=0.0), "~localized_max_position_sigma_m must be > 0, got 0.0"),
        (dict(localized_max_heading_sigma_rad=-1.0), "~localized_max_heading_sigma_rad must be > 0, got -1.0"),
        (
            dict(lost_used_share=0.5),
            "~lost_used_share and ~uncertain_used_share must ascend in [0, 1], got 0.5 and 0.4",
        ),
        (
            dict(uncertain_used_share=1.1),
            "~lost_used_share and ~uncertain_used_share must ascend in [0, 1], got 0.2 and 1.1",
        ),
        (dict(localized_min_cluster_share=1.5), "~localized_min_cluster_share must be in [0, 1], got 1.5"),
        (dict(localized_min_reliability=-0.1), "~localized_min_reliability must be in [0, 1], got -0.1"),
    ],
)
def test_wrong_limits_are_refused_in_one_line(values, text):
    with pytest.raises(ValueError) as err:
        QualityLimits(**values)
    assert str(err.value) == text
