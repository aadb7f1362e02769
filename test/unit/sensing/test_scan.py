"""One turn of a lidar: what is a range by REP 117, where beams end, what describes no lidar."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.sensing.scan import Scan, ScanError, one_of_each_piece, scan_from_fields, spread_evenly

STAMP_NS = 12_345_000_000
HERE = np.zeros(3)


def scan(ranges_m, range_min_m=0.1, range_max_m=10.0, base_from_laser=HERE, **kwargs):
    return scan_from_fields(
        STAMP_NS, np.array(ranges_m, float), -0.5, 0.25, range_min_m, range_max_m, base_from_laser, **kwargs
    )


@pytest.mark.parametrize(
    "written, meant",
    [
        pytest.param(5.0, 5.0, id="a range stays"),
        pytest.param(0.1, 0.1, id="range_min is a range"),
        pytest.param(0.09, -np.inf, id="nearer is too near"),
        pytest.param(-1.0, -np.inf, id="negative is too near"),
        pytest.param(0.0, np.nan, id="0 is a failed measurement"),
        pytest.param(10.0, np.inf, id="range_max means nothing met"),
        pytest.param(11.0, np.inf, id="beyond it too"),
        pytest.param(np.inf, np.inf, id="inf stays"),
        pytest.param(-np.inf, -np.inf, id="-inf stays"),
        pytest.param(np.nan, np.nan, id="NaN stays"),
    ],
)
def test_ranges_mean_what_rep_117_says(written, meant):
    np.testing.assert_array_equal(scan([written, 3.0]).ranges_m, [meant, 3.0])


def test_a_lidar_that_measures_from_0_on_may_not_write_0():
    np.testing.assert_array_equal(scan([0.0, 0.001], range_min_m=0.0).ranges_m, [np.nan, 0.001])


def test_beams_turn_on_by_the_increment():
    np.testing.assert_allclose(scan(np.ones(4)).angles_rad, [-0.5, -0.25, 0.0, 0.25])


def test_upside_down_the_first_beam_is_on_the_other_side():
    np.testing.assert_allclose(scan(np.ones(4), upside_down=True).angles_rad, [0.5, 0.25, 0.0, -0.25])


def test_one_beam_needs_no_increment():
    one = scan_from_fields(STAMP_NS, np.array([2.0]), 0.1, 0.0, 0.1, 10.0, HERE)
    assert len(one) == 1
    np.testing.assert_allclose(one.points_in_base(), [[2.0 * np.cos(0.1), 2.0 * np.sin(0.1)]])


def test_the_drivers_array_is_not_touched():
    ranges_m = np.array([0.0, 20.0, 3.0])
    scan_from_fields(STAMP_NS, ranges_m, 0.0, 0.1, 0.1, 10.0, HERE)
    np.testing.assert_array_equal(ranges_m, [0.0, 20.0, 3.0])


@pytest.mark.parametrize("given", [None, [], [1.0]])
def test_intensities_that_do_not_match_the_beams_are_none(given):
    assert scan([1.0, 2.0], intensities=given).intensities is None
    np.testing.assert_array_equal(scan([1.0, 2.0], intensities=[7.0, 9.0]).intensities, [7.0, 9.0])


def test_only_finite_ranges_are_answers():
    np.testing.assert_array_equal(scan([1.0, np.inf, np.nan, 0.01, 9.9]).answered, [True, False, False, False, True])


def test_a_beam_ends_where_the_laser_sits_and_points():
    # A laser 0.3 m ahead of the robot that looks to its left: 2 m along the beam is 2 m to the left.
    there = Scan(0, np.array([2.0]), np.array([0.0]), 0.1, 10.0, np.array([0.3, 0.0, np.pi / 2]))
    np.testing.assert_allclose(there.points_in_base(), [[0.3, 2.0]], atol=1e-12)


def test_a_beam_without_an_answer_ends_nowhere():
    points = scan([1.0, np.inf, 0.01, np.nan]).points_in_base()
    np.testing.assert_array_equal(np.isnan(points).all(axis=1), [False, True, True, True])


@pytest.mark.parametrize(
    "limits, kept",
    [
        pytest.param((-1.0, -1.0), [0.2, 1.0, 3.0, 9.0, np.inf], id="the scan's own"),
        pytest.param((1.0, -1.0), [-np.inf, 1.0, 3.0, 9.0, np.inf], id="not nearer than 1 m"),
        pytest.param((-1.0, 3.0), [0.2, 1.0, np.inf, np.inf, np.inf], id="nearer than 3 m"),
        pytest.param((0.5, 5.0), [-np.inf, 1.0, 3.0, np.inf, np.inf], id="between"),
        pytest.param((0.05, 50.0), [0.2, 1.0, 3.0, 9.0, np.inf], id="the lidar's own limits are the stricter ones"),
    ],
)
def test_limits_leave_the_ranges_between_them(limits, kept):
    np.testing.assert_array_equal(scan([0.2, 1.0, 3.0, 9.0, 20.0]).limited(*limits).ranges_m, kept)


def test_nan_stays_nan_within_limits():
    assert np.isnan(scan([np.nan, 1.0]).limited(0.5, 5.0).ranges_m[0])


def test_a_limited_scan_says_so_and_leaves_the_other_as_it_is():
    whole = scan([0.2, 9.0])
    part = whole.limited(0.5, 5.0)
    assert (part.range_min_m, part.range_max_m) == (0.5, 5.0)
    assert (whole.range_min_m, whole.range_max_m) == (0.1, 10.0)
    np.testing.assert_array_equal(whole.ranges_m, [0.2, 9.0])


@pytest.mark.parametrize(
    "limits, text",
    [
        ((12.0, -1.0), "scan at 12.345 s: no range is left between 12 m and 10 m"),
        ((-1.0, 0.05), "scan at 12.345 s: no range is left between 0.1 m and 0.05 m"),
        ((-1.0, 0.0), "scan at 12.345 s: no range is left between 0.1 m and 0 m"),
    ],
)
def test_limits_that_leave_nothing_are_refused_in_one_line(limits, text):
    with pytest.raises(ScanError) as err:
        scan([1.0]).limited(*limits)
    assert str(err.value) == text


@pytest.mark.parametrize(
    "fields, text",
    [
        (dict(ranges_m=[]), "no ranges, a scan needs at least 1"),
        (dict(angle_increment_rad=0.0), "angle_increment must be finite and not 0 rad, got 0.0"),
        (dict(angle_increment_rad=np.nan), "angle_increment must be finite and not 0 rad, got nan"),
        (dict(angle_min_rad=np.inf), "angle_min must be finite, got inf"),
        (dict(range_max_m=0.0), "range_max must be finite and > 0 m, got 0.0"),
        (dict(range_max_m=np.inf), "range_max must be finite and > 0 m, got inf"),
        (dict(range_min_m=-0.1), "range_min must be in [0, range_max = 10.0) m, got -0.1"),
        (dict(range_min_m=10.0), "range_min must be in [0, range_max = 10.0) m, got 10.0"),
        (dict(base_from_laser=np.zeros(2)), "the laser's pose on the robot must be finite x, y, yaw, got [0. 0.]"),
        (
            dict(base_from_laser=np.array([0.0, np.nan, 0.0])),
            "the laser's pose on the robot must be finite x, y, yaw, got [ 0. nan  0.]",
        ),
    ],
)
def test_what_describes_no_lidar_is_refused_in_one_line(fields, text):
    good = dict(
        stamp_ns=STAMP_NS,
        ranges_m=[1.0, 2.0],
        angle_min_rad=0.0,
        angle_increment_rad=0.1,
        range_min_m=0.1,
        range_max_m=10.0,
        base_from_laser=HERE,
    )
    with pytest.raises(ScanError) as err:
        scan_from_fields(**{**good, **fields})
    assert str(err.value) == f"scan at 12.345 s: {text}"


def test_beams_are_chosen_evenly_over_those_that_are_understood():
    case = np.zeros(360, np.uint8)
    case[90:270] = 3
    chosen = spread_evenly(case, 60)
    assert len(chosen) == 60 and len(set(chosen)) == 60
    assert chosen[0] == 90 and chosen[-1] == 269
    assert set(np.diff(chosen)) == {3, 4}  # 179 beams in 59 strides


def test_few_beams_are_all_chosen():
    np.testing.assert_array_equal(spread_evenly(np.array([0, 1, 0, 4, 2]), 60), [1, 3, 4])
    assert len(spread_evenly(np.zeros(8), 60)) == 0


def test_a_thing_close_to_the_robot_is_chosen_as_often_as_one_of_its_size_far_away():
    """Beams 1 degree apart, to a wall 1.1 m ahead for the first half and 8.1 m for the other, in the middle of squares."""
    bearings = np.radians(np.arange(-45.0, 45.0))
    ranges_m = np.where(bearings < 0.0, 1.1, 8.1) / np.cos(bearings)
    scan = scan_from_fields(STAMP_NS, ranges_m, bearings[0], np.radians(1.0), 0.1, 20.0, HERE)
    near = one_of_each_piece(scan)
    near, far = near[near < 45], near[near >= 45]
    assert 4 <= len(near) <= 6  # 1 m of wall
    assert 30 <= len(far) <= 35  # 8 m


def test_a_beam_without_a_return_is_of_no_piece():
    scan = scan_from_fields(STAMP_NS, [1.0, np.inf, np.nan, 3.0], 0.0, 0.5, 0.1, 20.0, HERE)
    np.testing.assert_array_equal(one_of_each_piece(scan), [0, 3])
