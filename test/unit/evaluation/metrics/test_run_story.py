"""Runs made by hand, and what the report says of them."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from glass_nav.evaluation.metrics import run_story
from glass_nav.evaluation.metrics.replay_result import NO_BEAM, ReplayResult
from glass_nav.geometry.trajectory import Trajectory

SCANS = 100


def a_run(**changes):
    """100 scans, one a second and a metre along x, LOCALIZED and 0.02 m beside the reference; one bad scan refused."""
    stamps = 10**18 + 10**9 * np.arange(SCANS)
    true = np.stack([np.arange(SCANS), np.zeros(SCANS), np.zeros(SCANS)], axis=1).astype(float)
    fields = {
        "stamps_ns": stamps,
        "map_from_base": true + [0.0, 0.02, 0.0],
        "odom_from_base": true,
        "covariance": np.tile(0.03**2 * np.eye(3), (SCANS, 1, 1)),
        "level_95": np.full((SCANS, 3), 2.5 * 0.03),
        "level_999": np.full((SCANS, 3), 5.0 * 0.03),
        "states": ["LOCALIZED"] * SCANS,
        "reasons": ["good"] * SCANS,
        "used_share": np.full(SCANS, 0.9),
        "updated": np.ones(SCANS, bool),
        "particles": np.full(SCANS, 100),
        "reliability": np.full(SCANS, 0.95),
        "places": np.ones(SCANS, int),
        "cpu_ms": np.full(SCANS, 20.0),
        "cases": np.tile(np.array([1, 1, 1, 3], np.uint8), (SCANS, 1)),
        "refusals": Counter({"bad": 1}),
        "reference": Trajectory(stamps, true),
        "wall_s": 1.0,
        "seed": 0,
    }
    return ReplayResult(**{**fields, **changes})


def states(**spans):
    """states(LOST=(40, 50)): LOCALIZED but for scans 40 to 49."""
    reported = ["LOCALIZED"] * SCANS
    for state, (first, end) in spans.items():
        reported[first:end] = [state] * (end - first)
    return reported


def off_by(metres, first, end):
    run = a_run()
    poses = run.map_from_base.copy()
    poses[first:end, 1] = metres
    return poses


def test_a_good_run_is_reported_as_one():
    story = run_story.of(a_run())
    assert (story.grade, story.headline) == ("good", "The robot knew where it was, and it was right")
    assert story.sentences == [
        "It drove 99 m in 1 min 39 s and used 100 scans (1 more were rejected).",
        "Half of its poses were within 2.0 cm and 0.0° of the ground truth, 95 % within 2.0 cm; the error never "
        "exceeded 2.0 cm.",
        "It never doubted its pose.",
    ]
    assert [(each.name, each.value) for each in story.figures] == [
        ("Position error", "2.0 cm"),
        ("Heading error", "0.00°"),
        ("Relative error", "0.0 cm"),
        ("Reported LOCALIZED", "100 %"),
        ("Beams explained", "90.0 %"),
        ("Update", "20 ms"),
    ]
    assert story.figures[4].note == "of those that came back; 25.0 % of all were mirrored or went through glass"
    assert story.figures[5].note == "CPU, median; a scan came every 1000 ms"


@pytest.mark.parametrize(
    "changes, grade, headline",
    [
        pytest.param(
            {"map_from_base": off_by(3.0, 40, 60)},
            "bad",
            "The pose was wrong in 20.0 % of the scans reported as LOCALIZED",
            id="sure and wrong",
        ),
        pytest.param(
            {"map_from_base": off_by(3.0, 40, 60), "states": states(LOST=(38, 62))},
            "fair",
            "The robot knew where it was most of the time",
            id="wrong, and it said so",
        ),
        pytest.param(
            {"states": states(UNCERTAIN=(20, 90))},
            "bad",
            "The robot did not know where it was for most of the run",
            id="unsure for long",
        ),
        pytest.param(
            {"states": ["GLOBAL_SEARCH"] * SCANS, "places": np.full(SCANS, 12)},
            "bad",
            "The robot never reported LOCALIZED",
            id="never found",
        ),
        pytest.param(
            {"reference": None},
            "good",
            "The robot reported LOCALIZED throughout, and its scans did not contradict it",
            id="nobody knows",
        ),
        pytest.param(
            {"reference": None, "states": states(LOST=(90, 100))},
            "bad",
            "The robot reported LOCALIZED for 90.0 % of the run",
            id="nobody knows, lost at the end",
        ),
        pytest.param(
            {"reference": None, "states": states(UNCERTAIN=(50, 70))},
            "fair",
            "The robot reported LOCALIZED for 80.0 % of the run",
            id="nobody knows, doubts",
        ),
    ],
)
def test_the_verdict_names_what_went_wrong(changes, grade, headline):
    story = run_story.of(a_run(**changes))
    assert (story.grade, story.headline) == (grade, headline)


def test_doubts_are_counted_with_what_was_true_of_them():
    story = run_story.of(a_run(map_from_base=off_by(3.0, 40, 60), states=states(LOST=(40, 60), UNCERTAIN=(70, 80))))
    assert story.sentences[-1] == (
        "It doubted its pose 2 times, 30.0 s in all; 66.7 % of these scans were at a wrong place."
    )
    assert story.sentences[1].endswith("for 20.0 % of the scans it was more than 0.5 m off, at most 3.00 m.")


def test_a_start_without_a_guess_is_reported_and_its_errors_count_from_when_it_was_found():
    places = np.ones(SCANS, int)
    places[:10] = [500, 300, 200, 90, 40, 9, 7, 5, 3, 2]
    poses = off_by(20.0, 0, 10)
    story = run_story.of(a_run(states=states(GLOBAL_SEARCH=(0, 10)), places=places, map_from_base=poses))
    assert story.sentences[1] == (
        "It started without an initial pose: up to 500 places were possible, one was left after 10.0 s "
        "and 10.0 m, the right one, 2.0 cm off."
    )
    assert story.sentences[2].startswith("Half of its poses were within 2.0 cm")
    assert story.figures[0].note == "median; since it was first LOCALIZED; 95 % below 2.0 cm"
    never = run_story.of(a_run(states=["GLOBAL_SEARCH"] * SCANS, places=np.full(SCANS, 12), map_from_base=poses))
    assert never.sentences[1] == "It started without an initial pose; up to 12 places were possible, and 12 at the end."


def test_episodes_follow_each_other_without_a_gap():
    reported = run_story.episodes(a_run(states=states(GLOBAL_SEARCH=(0, 10), LOST=(50, 60))))
    assert [(each.state, each.start_s, each.end_s) for each in reported] == [
        ("GLOBAL_SEARCH", 0.0, 10.0),
        ("LOCALIZED", 10.0, 50.0),
        ("LOST", 50.0, 60.0),
        ("LOCALIZED", 60.0, 99.0),
    ]
    assert [(each.first, each.last) for each in reported] == [(0, 9), (10, 49), (50, 59), (60, 99)]


def test_an_infinite_error_and_a_scan_without_beams_have_words():
    run = a_run(
        map_from_base=np.full((SCANS, 3), np.nan),
        cases=np.full((SCANS, 1), NO_BEAM, np.uint8),
        used_share=np.full(SCANS, np.nan),
    )
    story = run_story.of(run)
    assert story.grade == "bad"
    assert story.figures[0].value == "infinite"
    assert "Beams explained" not in [each.name for each in story.figures]


@pytest.mark.parametrize("seconds, text", [(4.24, "4.2 s"), (75.0, "1 min 15 s"), (3725.0, "1 h 2 min")])
def test_durations_are_read_aloud(seconds, text):
    assert run_story.duration(seconds) == text


@pytest.mark.parametrize(
    "share, text", [(0.0, "0 %"), (1.0, "100 %"), (0.00001, "0.1 %"), (0.99999, "99.9 %"), (0.5, "50.0 %")]
)
def test_nearly_all_is_not_all(share, text):
    assert run_story.percent(share) == text


@pytest.mark.parametrize(
    "changes, why",
    [
        ({}, "one scan alone"),
        ({"turn": np.radians(50.0)}, "turning 50°/s: a stamp 10 ms off is 0.5°"),
        ({"state": "UNCERTAIN"}, "UNCERTAIN: why"),
        ({"used_share": 0.3}, "the map explains 30.0 % of the beams"),
        ({"updated": False}, "between two updates, by odometry"),
    ],
)
def test_a_lone_spike_of_the_heading_is_explained(changes, why):
    run = a_run()
    poses, odometry = run.map_from_base.copy(), run.odom_from_base.copy()
    poses[40, 2] += 0.1
    odometry[41:, 2] += changes.get("turn", 0.0)
    states, reasons, share, updated = list(run.states), list(run.reasons), run.used_share.copy(), run.updated.copy()
    states[40], reasons[40] = changes.get("state", "LOCALIZED"), "why"
    share[40], updated[40] = changes.get("used_share", 0.9), changes.get("updated", True)
    run = replace(
        run,
        map_from_base=poses,
        odom_from_base=odometry,
        states=states,
        reasons=reasons,
        used_share=share,
        updated=updated,
    )
    (spike,) = run_story.yaw_spikes(run)
    assert (spike.row, spike.why) == (40, why)
    assert spike.yaw_rad == pytest.approx(0.1, abs=1e-6)


def test_a_heading_that_is_off_for_long_is_no_spike():
    poses = a_run().map_from_base.copy()
    poses[30:60, 2] += 0.1
    assert run_story.yaw_spikes(replace(a_run(), map_from_base=poses)) == []
