"""The one door for a scan: where its lidar sits, its odometry, deskewed; or in words why not."""

from __future__ import annotations

import numpy as np
import pytest
from made_transforms import STAMP_NS, MadeTransforms, raw_scan

from glass_nav.sensing.mounting import Mounting, level_mounting
from glass_nav.sensing.scan import ScanError
from glass_nav.sensing.scan_placement import NoTransform, ScanPlacement

STEP_S = 0.01  # of a sweep of 40 ms
SWEEP = dict(time_increment_s=STEP_S, scan_time_s=0.05)
LATER_NS = STAMP_NS + 2_000_000_000


def test_a_placed_scan_has_its_odometry_its_mounting_and_what_the_driver_wrote():
    raw = raw_scan(LATER_NS)
    placed = ScanPlacement(MadeTransforms()).place(raw)
    assert placed.raw is raw
    assert (placed.scan.stamp_ns, placed.scan.lidar, placed.mounting.height_m) == (LATER_NS, "laser", 0.4)
    np.testing.assert_allclose(placed.odom_from_base, [2.0, 0.0, 0.0])
    np.testing.assert_allclose(placed.scan.base_from_laser, [0.2, 0.0, 0.0])
    np.testing.assert_allclose(placed.scan.angles_rad, np.linspace(-0.5, 0.5, 5))


def test_a_lidar_upside_down_has_its_beams_the_other_way_round():
    transforms = MadeTransforms(laser=Mounting(np.zeros(3), upside_down=True))
    assert ScanPlacement(transforms).place(raw_scan()).scan.angles_rad[0] == pytest.approx(0.5)


def test_the_ends_of_a_deskewed_scan_stay_where_they_are_in_the_room():
    """By hand: 1 m/s ahead, so beam i starts i cm farther ahead than the first one."""
    scan = ScanPlacement(MadeTransforms()).place(raw_scan(**SWEEP)).scan
    bearing = np.linspace(-0.5, 0.5, 5)
    ahead = 0.2 + np.arange(5) * STEP_S
    ends = np.stack([ahead + 2.0 * np.cos(bearing), 2.0 * np.sin(bearing)], axis=-1)
    np.testing.assert_allclose(scan.points_in_base(), ends, atol=1e-9)
    np.testing.assert_allclose(scan.as_measured(scan.ranges_m), 2.0, atol=1e-9)


@pytest.mark.parametrize(
    "fields, deskews",
    [
        pytest.param({}, True, id="the driver tells no time between beams"),
        pytest.param(SWEEP, False, id="not wanted"),
        pytest.param(dict(time_increment_s=0.5), True, id="a time that cannot be true"),
        pytest.param(dict(time_increment_s=np.nan), True, id="a time that is none"),
        pytest.param(dict(SWEEP, ranges_m=np.ones(1)), True, id="one beam"),
    ],
)
def test_a_scan_that_is_not_deskewed_is_as_of_one_moment(fields, deskews):
    transforms = MadeTransforms()
    placed = ScanPlacement(transforms, deskews).place(raw_scan(**fields))
    assert placed.scan.origins_m is None
    assert transforms.asked_ns == [STAMP_NS]


def test_a_time_between_beams_that_cannot_be_true_is_said_where_scans_are_deskewed():
    raw = raw_scan(time_increment_s=0.5)
    assert raw.sweep_ns == 0
    assert ScanPlacement(MadeTransforms()).timing_fault(raw) == (
        "time_increment 0.5 s times 5 beams is 2 s, allowed 1 s"
    )
    assert ScanPlacement(MadeTransforms(), deskews=False).timing_fault(raw) is None
    assert ScanPlacement(MadeTransforms()).timing_fault(raw_scan(**SWEEP)) is None


@pytest.mark.parametrize(
    "known_until_ns, fields, deskews, missing",
    [
        pytest.param(STAMP_NS, {}, True, None, id="all there"),
        pytest.param(STAMP_NS - 1, {}, True, "no transform odom <- base", id="no odometry at its stamp"),
        pytest.param(STAMP_NS, dict(lidar="other"), True, "no transform base <- other", id="no such lidar"),
        pytest.param(STAMP_NS + 39_999_999, SWEEP, True, "no transform odom <- base", id="none at its last beam"),
        pytest.param(STAMP_NS + 40_000_000, SWEEP, True, None, id="odometry over the whole sweep"),
        pytest.param(STAMP_NS, SWEEP, False, None, id="needed at the stamp alone"),
    ],
)
def test_a_scan_waits_for_the_transforms_that_it_needs(known_until_ns, fields, deskews, missing):
    transforms = MadeTransforms()
    transforms.known_until_ns = known_until_ns
    placement = ScanPlacement(transforms, deskews)
    assert placement.missing(raw_scan(**fields)) == missing
    if missing is None:
        placement.place(raw_scan(**fields))
    else:
        with pytest.raises(NoTransform) as err:
            placement.place(raw_scan(**fields))
        assert err.value.reason == missing


class TiltedTransforms(MadeTransforms):
    def mounting(self, lidar: str, stamp_ns: int) -> Mounting:
        return level_mounting(np.zeros(3), 0.0, 0.0)


@pytest.mark.parametrize(
    "transforms, fields, reason",
    [
        (TiltedTransforms(), {}, "the laser is tilted by 90 degrees"),
        (MadeTransforms(), dict(range_max_m=-1.0), "range_max must be finite and > 0 m, got -1.0"),
        (MadeTransforms(), dict(ranges_m=np.zeros(0)), "no ranges"),
    ],
)
def test_a_scan_that_no_transform_can_help_does_not_wait_and_is_rejected(transforms, fields, reason):
    placement = ScanPlacement(transforms)
    assert placement.missing(raw_scan(**fields)) is None
    for use in (placement.place, placement.scan):
        with pytest.raises(ScanError) as err:
            use(raw_scan(**fields))
        assert err.value.reason.startswith(reason)
        assert not isinstance(err.value, NoTransform)


def test_a_scan_alone_needs_odometry_only_to_be_deskewed():
    transforms = MadeTransforms()
    transforms.known_until_ns = 0
    placement = ScanPlacement(transforms)
    np.testing.assert_allclose(placement.scan(raw_scan()).base_from_laser, [0.2, 0.0, 0.0])
    with pytest.raises(NoTransform, match="no transform odom <- base"):
        placement.scan(raw_scan(**SWEEP))
    transforms.known_until_ns = LATER_NS
    alone, placed = placement.scan(raw_scan(**SWEEP)), placement.place(raw_scan(**SWEEP)).scan
    np.testing.assert_array_equal(alone.ranges_m, placed.ranges_m)
