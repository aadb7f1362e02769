"""Bearings as they are taken, one after the other, by a robot that drives."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.geometry import se2
from glass_nav.sensing import bearings
from glass_nav.sensing.bearings import LandmarkBearing, LandmarkBearings, OdometryDrift

SENSOR = np.array([0.2, 0.0, np.pi / 2.0])


def two(first: str = "A", second: str = "B"):
    return [LandmarkBearing(10, first, 0.1, 0.01), LandmarkBearing(20, second, 0.2, 0.02)]


def test_bearings_of_a_standing_robot_are_all_from_where_its_sensor_is():
    taken = bearings.collected(two(), np.tile([5.0, 5.0, 1.0], (2, 1)), SENSOR)
    np.testing.assert_allclose(taken.base_from_sensor, [SENSOR, SENSOR], atol=1e-12)
    assert (taken.stamp_ns, taken.ids) == (20, ("A", "B"))
    assert taken.angles_rad.tolist() == [0.1, 0.2] and taken.sigma_rad.tolist() == [0.01, 0.02]
    assert taken.origin_sigma_m.tolist() == [0.0, 0.0]


def test_a_bearing_is_told_from_where_the_robot_was():
    # 1 m ahead and a quarter turn to the left between the two: the first place is now 1 m to the right, turned right
    odometry = np.array([[3.0, 1.0, 0.0], [4.0, 1.0, np.pi / 2.0]])
    taken = bearings.collected(two(), odometry, np.zeros(3), OdometryDrift(0.02, 0.01, 0.05))
    np.testing.assert_allclose(taken.base_from_sensor, [[0.0, 1.0, -np.pi / 2.0], [0.0, 0.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(taken.origin_sigma_m, [0.02, 0.0])
    np.testing.assert_allclose(taken.sigma_rad, [np.hypot(0.01, 0.01 + 0.05 * np.pi / 2.0), 0.02])


def test_going_there_and_back_is_no_less_unsure_than_the_whole_way():
    single = [LandmarkBearing(number, name, 0.0, 0.01) for number, name in enumerate("ABC")]
    taken = bearings.collected(
        single, np.array([[0.0, 0, 0], [2.0, 0, 0], [0.0, 0, 0]]), np.zeros(3), OdometryDrift(0.1, 0.0, 0.0)
    )
    np.testing.assert_allclose(taken.origin_sigma_m, [0.4, 0.2, 0.0])


def test_from_a_later_pose_the_sensor_places_move_the_other_way():
    taken = bearings.standing("AB", np.array([0.1, 0.2]), 0.01, stamp_ns=5, base_from_sensor=SENSOR)
    later = np.array([1.0, 0.0, np.pi])  # driven on
    moved = taken.seen_from(9, se2.inverse(later))
    assert moved.stamp_ns == 9
    np.testing.assert_allclose(se2.compose(later, moved.base_from_sensor), taken.base_from_sensor, atol=1e-12)


def test_a_subset_keeps_what_belongs_together():
    taken = bearings.collected(two(), np.array([[0.0, 0, 0], [1.0, 0, 0]]), SENSOR)
    for chosen in (np.array([False, True]), np.array([1])):
        part = taken.subset(chosen)
        assert part.ids == ("B",) and len(part) == 1
        assert (part.angles_rad[0], part.sigma_rad[0]) == (0.2, 0.02)


@pytest.mark.parametrize(
    "fields, text",
    [
        ({"landmark_id": ""}, "a bearing needs the id of its landmark, got ''"),
        ({"angle_rad": np.nan}, "bearing of 'A': angle must be finite, got nan rad"),
        ({"sigma_rad": 0.0}, "bearing of 'A': sigma must be > 0 rad, got 0.0"),
    ],
)
def test_a_bearing_that_means_nothing_is_refused(fields, text):
    with pytest.raises(ValueError) as caught:
        LandmarkBearing(**{"stamp_ns": 0, "landmark_id": "A", "angle_rad": 0.0, "sigma_rad": 0.1, **fields})
    assert str(caught.value) == text


@pytest.mark.parametrize(
    "fields, text",
    [
        ({"ids": ("A", "A")}, "bearings must be of different landmarks, got A more than once"),
        (
            {"angles_rad": np.zeros(3)},
            "expected 2 ids with angles (N,), sigma (N,), sensor poses (N, 3) and origin "
            "sigma (N,), got (3,), (2,), (2, 3), (2,)",
        ),
        ({"angles_rad": np.array([0.0, np.inf])}, "bearings and the poses they were taken from must be finite"),
        ({"sigma_rad": np.array([0.1, 0.0])}, "sigma of bearings must be > 0 rad, got [0.1, 0.0]"),
        ({"origin_sigma_m": np.array([0.1, -1.0])}, "origin sigma of bearings must be >= 0 m, got [0.1, -1.0]"),
    ],
)
def test_bearings_that_do_not_fit_together_are_refused(fields, text):
    good = {
        "stamp_ns": 0,
        "ids": ("A", "B"),
        "angles_rad": np.zeros(2),
        "sigma_rad": np.ones(2),
        "base_from_sensor": np.zeros((2, 3)),
        "origin_sigma_m": np.zeros(2),
    }
    with pytest.raises(ValueError) as caught:
        LandmarkBearings(**{**good, **fields})
    assert str(caught.value) == text


def test_a_drift_that_means_nothing_is_refused():
    with pytest.raises(ValueError, match=r"^~bearing_drift_per_m must be >= 0, got -1.0$"):
        OdometryDrift(bearing_drift_per_m=-1.0)
