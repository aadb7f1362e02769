"""When a fix is made, and when it becomes the initial pose of the localization."""

from __future__ import annotations

import numpy as np
import pytest
from made_bearings import FIELD, directions

from glass_nav.geometry import angles, se2
from glass_nav.localization.bearings.landmark_fixes import FixParams, LandmarkFixes
from glass_nav.localization.bearings.triangulation import TriangulationError, TriangulationLimits
from glass_nav.sensing.bearings import LandmarkBearing, OdometryDrift
from glass_nav.world import landmark_map

SECOND = 1_000_000_000
TRUE = np.array([1.0, 3.0, -2.0])


def fixes(**given):
    return LandmarkFixes(FIELD, FixParams(**given), TriangulationLimits(), OdometryDrift())


def bearings(ids, second=1, map_from_base=TRUE):
    """Of a robot whose odometry is the map, the sensor at its middle."""
    exact = dict(zip(FIELD.ids, directions(FIELD, map_from_base)))
    return [(LandmarkBearing(second * SECOND, name, exact[name], 0.01), map_from_base) for name in ids]


def lost(made, ids="ABCD", second=1):
    made.localization_state = "LOST"
    made.take(bearings(ids, second), np.zeros(3))
    return made


@pytest.mark.parametrize("method", ["least_squares", "document"])
def test_bearings_of_several_messages_make_one_fix_at_the_stamp_of_the_last(method):
    made = fixes(method=method)
    with pytest.raises(TriangulationError, match="three landmarks are needed, 2 seen: A, B"):
        made.take(bearings("AB", 1), np.zeros(3))
    assert made.why_none == "three landmarks are needed, 2 seen: A, B"
    later = se2.compose(TRUE, np.array([0.3, 0.0, 0.2]))
    placed = made.take(bearings("CD", 4, later), np.zeros(3))
    assert placed.fix.stamp_ns == 4 * SECOND and placed.bearings.ids == ("A", "B", "C", "D")
    np.testing.assert_allclose(placed.fix.map_from_base[:2], later[:2], atol=1e-6)
    assert abs(angles.wrap(placed.fix.map_from_base[2] - later[2])) < 1e-6
    np.testing.assert_array_equal(placed.odom_from_base, later)


def test_no_known_landmark_is_no_fix():
    made = fixes()
    assert made.take([], np.zeros(3)) is None
    with pytest.raises(ValueError, match="there is no position: no known landmark was seen"):
        made.requested(1.0)


def test_old_bearings_are_forgotten():
    made = fixes(window_s=10.0)
    made.take(bearings("ABC", 1), np.zeros(3))
    with pytest.raises(TriangulationError, match="1 seen: D"):
        made.take(bearings("D", 12), np.zeros(3))


def test_on_request_the_last_fix_is_given_while_it_is_young():
    made = lost(fixes(max_age_s=120.0), second=1)
    assert made.requested(100.0).fix.stamp_ns == SECOND
    with pytest.raises(ValueError) as caught:
        made.requested(141.0)
    assert str(caught.value).startswith("the last position is 140 s old, allowed 120 s; since then: ")


@pytest.mark.parametrize("state, due", [("LOST", True), ("LOCALIZED", False), ("", False)])
def test_a_fix_goes_out_unasked_in_the_states_of_a_rescue(state, due):
    made = lost(fixes(), second=20)
    made.localization_state = state
    assert (made.due_for_rescue() is not None) == due


def test_without_a_fix_nothing_goes_out():
    made = fixes()
    made.localization_state = "LOST"
    assert made.due_for_rescue() is None


def test_each_fix_rescues_once_and_the_localization_has_time_to_settle():
    made = lost(fixes(rescue_period_s=10.0), second=20)
    assert made.due_for_rescue() is not None
    assert made.due_for_rescue() is None  # the same fix
    lost(made, second=25)
    assert made.due_for_rescue() is None  # too early
    lost(made, second=30)
    assert made.due_for_rescue() is not None


def test_what_was_sent_on_request_rescues_no_more():
    made = lost(fixes(), second=20)
    made.initial_pose(made.requested(20.0), 20 * SECOND, TRUE)
    assert made.due_for_rescue() is None


def test_the_initial_pose_is_carried_along_and_widened():
    made = lost(fixes(min_position_sigma_m=0.5, min_heading_sigma_rad=0.1))
    placed = made.requested(1.0)
    later = se2.compose(TRUE, np.array([2.0, 0.0, 0.0]))
    sent = made.initial_pose(placed, 9 * SECOND, later)
    assert sent.stamp_ns == 9 * SECOND
    np.testing.assert_allclose(sent.map_from_base[:2], later[:2], atol=1e-6)
    assert np.all(np.diag(sent.covariance) >= np.diag(placed.fix.covariance) + [0.25, 0.25, 0.01])


def test_after_a_jump_of_time_all_is_forgotten():
    made = lost(fixes())
    made.restart("no bearings came since time jumped back")
    assert made.localization_state == "" and made.due_for_rescue() is None
    with pytest.raises(ValueError, match="there is no position: no bearings came since time jumped back"):
        made.requested(1.0)


def test_two_landmarks_are_too_few():
    few = landmark_map.seen_from_all_sides("AB", np.array([[0.0, 0.0], [1.0, 0.0]]), 15.0)
    with pytest.raises(ValueError, match="three landmarks are needed for a position, it has 2"):
        LandmarkFixes(few, FixParams(), TriangulationLimits(), OdometryDrift())
