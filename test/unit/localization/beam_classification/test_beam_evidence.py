"""What the beams of a scan say about a pose, for and against."""

from __future__ import annotations

import numpy as np
import pytest
from made_expected_ranges import expect

from glass_nav.localization.beam_classification import beam_evidence
from glass_nav.localization.beam_classification.beam_evidence import BeamEvidence


@pytest.mark.parametrize(
    "case, measured_m, seen_through, known_end, counted",
    [
        pytest.param(1, 5.0, 0.1, True, (1.0, 0.0, 0.0), id="explained"),
        pytest.param(3, 9.0, 0.9, False, (1.0, 0.0, 0.0), id="explained, though the map knows nothing there"),
        pytest.param(0, 3.0, 0.1, True, (0.0, 1.0, 0.0), id="ended in front of the wall"),
        pytest.param(0, 3.0, 0.1, False, (0.0, 0.0, 0.0), id="ended in an unmapped room"),
        pytest.param(0, 9.0, 0.0, False, (0.0, 0.0, 1.0), id="went through a wall"),
        pytest.param(0, 9.0, 1.0, False, (0.0, 0.0, 0.0), id="went through a pane, outdoors"),
        pytest.param(0, 9.0, 0.25, False, (0.0, 0.0, 0.75), id="through what may be a pane"),
        pytest.param(0, 9.0, 1.0, True, (0.0, 0.0, 1.0), id="through a pane, but nothing is there"),
        pytest.param(0, np.inf, 0.0, False, (0.0, 0.0, 0.0), id="did not return"),
    ],
)
def test_each_beam_speaks_for_the_pose_against_it_or_not_at_all(case, measured_m, seen_through, known_end, counted):
    evidence = beam_evidence.of(
        np.array([measured_m]), np.array([case]), expect(5.0), np.array([seen_through]), np.array([known_end])
    )
    assert (evidence.explained, evidence.short, evidence.passed) == pytest.approx(counted)
    assert evidence.answered == np.isfinite(measured_m)


def test_the_inlier_ratio_is_of_the_beams_that_say_something():
    assert BeamEvidence(100.0, explained=30.0, short=5.0, passed=5.0).inlier_ratio == 0.75
    assert BeamEvidence(100.0, explained=30.0, short=5.0, passed=5.0).judged_share == 0.4
    nothing = BeamEvidence(100.0, 0.0, 0.0, 0.0)
    assert np.isnan(nothing.inlier_ratio) and nothing.judged_share == 0.0
    assert BeamEvidence(0.0, 0.0, 0.0, 0.0).judged_share == 0.0


def test_a_crowd_counts_at_most_as_much_as_what_is_seen_of_the_map():
    assert BeamEvidence(100.0, 10.0, 80.0, 10.0).without_crowd() == BeamEvidence(100.0, 10.0, 20.0, 10.0)
    assert BeamEvidence(100.0, 10.0, 90.0, 0.0).without_crowd().inlier_ratio == 0.5  # people around a right pose
    assert BeamEvidence(100.0, 1.0, 90.0, 9.0).without_crowd().inlier_ratio == 0.05  # and around a wrong one
    few = BeamEvidence(100.0, 60.0, 30.0, 10.0)
    assert few.without_crowd() == few
