"""Where the scan fits near the prediction; and when a place that odometry did not lead to is believed."""

from __future__ import annotations

import numpy as np
import pytest
from buildings import CORRIDOR, L_ROOM, Building, loop_drive, off

from glass_nav.geometry import se2
from glass_nav.localization.particle_filter import scan_registration
from glass_nav.localization.particle_filter.scan_registration import ScanRegistration
from glass_nav.sensing.distance_field import DistanceField

SCALE_M = 0.06
TIGHT = np.diag([0.03, 0.03, 0.01]) ** 2
ODOM_FROM_MAP = np.array([5.0, -3.0, 1.0])
RING = np.column_stack(
    [
        np.cos(np.linspace(0.0, 2.0 * np.pi, 56, endpoint=False)),
        np.sin(np.linspace(0.0, 2.0 * np.pi, 56, endpoint=False)),
    ]
)  # 56 beams at 1.0 m all round


@pytest.fixture(scope="module")
def l_room():
    return DistanceField(L_ROOM.grid_map())


def odometry_at(pose):
    return se2.compose(ODOM_FROM_MAP, pose)


class Robot:
    """Believes what its anchor finds first, and knows odometry since."""

    def __init__(self, field, true, seed):
        self.rng = np.random.default_rng(seed)
        self.anchor = ScanRegistration(field)
        self.map_from_odom = se2.inverse(ODOM_FROM_MAP)
        for _ in range(6):  # what scans usually look like
            self.find(odometry_at(true), self.points(true))

    def points(self, true):
        return L_ROOM.scan(true, rng=self.rng).points_in_base().copy()

    def find(self, odom_from_base, points):
        found = self.anchor.find(
            se2.compose(self.map_from_odom, odom_from_base), TIGHT, odom_from_base, points, SCALE_M
        )
        self.map_from_odom = se2.compose(found.poses[0], se2.inverse(odom_from_base))
        return found


@pytest.mark.parametrize("seed", range(6))
def test_a_scan_is_found_where_it_was_taken(l_room, seed):
    rng = np.random.default_rng(seed)
    anchor = ScanRegistration(l_room)
    for true in loop_drive(8):
        prediction = true + rng.normal(0.0, [0.1, 0.1, 0.05])
        points = L_ROOM.scan(true, rng=rng).points_in_base()
        found = anchor.find(prediction, np.diag([0.1, 0.1, 0.05]) ** 2, odometry_at(true), points, SCALE_M)
        way_m, turn_rad = off(found.poses[0], true)
        assert way_m < 0.01 and turn_rad < np.radians(0.3)


@pytest.mark.parametrize("seed", range(4))
def test_an_uncertain_prediction_is_searched_around_widely(l_room, seed):
    """0.45 m and 20 degrees off, by a filter that says so."""
    rng = np.random.default_rng(seed)
    true = np.array([2.0, 1.6, 0.7])
    bearing = rng.uniform(-np.pi, np.pi)
    prediction = true + [0.45 * np.cos(bearing), 0.45 * np.sin(bearing), np.radians(20.0) * (-1) ** seed]
    found = ScanRegistration(l_room).find(
        prediction,
        np.diag([0.4, 0.4, 0.3]) ** 2,
        odometry_at(true),
        L_ROOM.scan(true, rng=rng).points_in_base(),
        SCALE_M,
    )
    way_m, turn_rad = off(found.poses[0], true)
    assert way_m < 0.01 and turn_rad < np.radians(0.3)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("spin_deg", [80.0, -80.0])
def test_a_spin_that_odometry_missed_is_believed_at_the_second_scan(l_room, seed, spin_deg):
    true = np.array([2.0, 1.6, 0.7])
    robot = Robot(l_room, true, seed)
    odometry = odometry_at(true)
    true = true + [0.0, 0.0, np.radians(spin_deg)]
    first = robot.find(odometry, robot.points(true))
    assert off(first.poses[0], true)[1] > np.radians(30.0)  # not yet
    second = robot.find(odometry, robot.points(true))
    way_m, turn_rad = off(second.poses[0], true)
    assert way_m < 0.05 and turn_rad < np.radians(1.0)


@pytest.mark.parametrize("seed", range(5))
def test_a_spin_is_also_confirmed_by_a_scan_from_farther_on(l_room, seed):
    """Between the two scans the robot drives 0.2 m, which odometry does notice."""
    true = np.array([2.0, 1.6, 0.7])
    robot = Robot(l_room, true, seed)
    odometry = odometry_at(true)
    true = true + [0.0, 0.0, np.radians(80.0)]
    robot.find(odometry, robot.points(true))
    step = np.array([0.2, 0.0, 0.1])
    true, odometry = se2.compose(true, step), se2.compose(odometry, step)
    way_m, turn_rad = off(robot.find(odometry, robot.points(true)).poses[0], true)
    assert way_m < 0.05 and turn_rad < np.radians(1.0)


@pytest.mark.parametrize("seed", range(5))
def test_one_absurd_scan_leaves_no_trace_in_the_next(l_room, seed):
    true = np.array([2.0, 1.6, 0.7])
    robot = Robot(l_room, true, seed)
    robot.anchor.find(true, TIGHT, odometry_at(true), RING, SCALE_M)
    found = robot.find(odometry_at(true), robot.points(true))  # of a robot that kept to odometry
    way_m, turn_rad = off(found.poses[0], true)
    assert way_m < 0.02 and turn_rad < np.radians(0.5)


@pytest.mark.parametrize("seed", range(3))
def test_a_scan_that_fits_nowhere_twice_is_not_believed_either(l_room, seed):
    """Crowds do not fit another place as well as scans usually fit."""
    true = np.array([2.0, 1.6, 0.7])
    robot = Robot(l_room, true, seed)
    crowd = robot.rng.uniform(-2.0, 2.0, (90, 2))
    for _ in range(3):
        assert off(robot.anchor.find(true, TIGHT, odometry_at(true), crowd, SCALE_M).poses[0], true)[1] < np.radians(
            40.0
        )


def test_two_ways_to_fit_are_both_told():
    """A square room with the robot in the middle, turned by 45 degrees from the prediction either way."""
    square = Building([(0, 0), (4, 0), (4, 4), (0, 4)])
    true = np.array([2.0, 2.0, np.radians(45.0)])
    points = square.scan(true, rng=np.random.default_rng(0)).points_in_base()
    found = ScanRegistration(DistanceField(square.grid_map())).find(
        np.array([2.0, 2.0, 0.0]), np.diag([0.05, 0.05, 0.35]) ** 2, true, points, SCALE_M
    )
    assert len(found.poses) >= 2
    assert {int(turn) for turn in np.round(np.degrees(found.poses[:, 2]))} >= {45, -45}


def test_told_places_are_distinct_good_and_at_most_four():
    rng = np.random.default_rng(1)
    field = DistanceField(CORRIDOR.grid_map())
    true = np.array([30.0, 0.9, 0.0])
    scan = CORRIDOR.scan(true, rng=rng)
    points = scan.points_in_base()[scan.ranges_m < 8.0]  # the corridor fits anywhere along itself
    found = ScanRegistration(field).find(true, np.diag([0.3, 0.05, 0.03]) ** 2, true, points, SCALE_M)
    assert 2 <= len(found.poses) <= 4
    assert len(found.information) == len(found.fit) == len(found.poses)
    assert np.all(np.diff(found.fit) <= 0.0)
    assert found.fit[-1] > 0.9 * found.fit[0]
    for index, pose in enumerate(found.poses):
        for other in found.poses[:index]:
            way_m, turn_rad = off(pose, other)
            assert way_m >= 0.05 or turn_rad >= np.radians(1.5)


def test_the_same_scan_again_is_the_same_answer(l_room):
    true = np.array([2.0, 1.6, 0.7])
    points = L_ROOM.scan(true).points_in_base()
    first, second = (ScanRegistration(l_room).find(true, TIGHT, true, points, SCALE_M) for _ in range(2))
    np.testing.assert_allclose(first.poses, second.poses, atol=1e-9)
    np.testing.assert_allclose(first.fit, second.fit, atol=1e-9)


# -- when a wheel may have slipped


@pytest.mark.parametrize("seed", range(5))
def test_a_scan_contradicts_odometry_only_if_it_fits_beside_the_place_that_odometry_leads_to(l_room, seed):
    true = np.array([2.0, 1.6, 0.7])
    robot = Robot(l_room, true, seed)
    assert not robot.anchor.contradicts_odometry
    slipped = true + [0.25 * np.cos(seed), 0.25 * np.sin(seed), 0.1]
    robot.find(odometry_at(true), robot.points(slipped))
    assert robot.anchor.contradicts_odometry
    robot.anchor.find(true, TIGHT, odometry_at(true), RING, SCALE_M)  # fits nowhere
    assert not robot.anchor.contradicts_odometry


@pytest.mark.parametrize("seed", range(5))
def test_a_scan_that_fits_all_along_a_corridor_contradicts_no_odometry(seed):
    rng = np.random.default_rng(seed)
    anchor = ScanRegistration(DistanceField(CORRIDOR.grid_map()))
    for x_m in np.arange(25.0, 32.0, 0.3):
        true = np.array([x_m, 0.9, 0.0])
        prediction = true + [rng.normal(0.0, 0.3), 0.0, 0.0]
        points = CORRIDOR.scan(true, rng=rng).points_in_base().copy()
        anchor.find(prediction, TIGHT, prediction, points[np.isfinite(points).all(axis=1)], SCALE_M)
        assert not anchor.contradicts_odometry


def test_a_spin_that_is_believed_at_the_second_scan_contradicts_odometry(l_room):
    true = np.array([2.0, 1.6, 0.7])
    robot = Robot(l_room, true, 0)
    spun = true + [0.0, 0.0, np.radians(80.0)]
    robot.find(odometry_at(true), robot.points(spun))
    assert not robot.anchor.contradicts_odometry
    robot.find(odometry_at(true), robot.points(spun))
    assert robot.anchor.contradicts_odometry


# -- when a scan is no evidence


@pytest.mark.parametrize("seed", range(5))
def test_a_scan_of_things_that_the_map_lacks_leaves_the_pose_to_odometry(l_room, seed):
    """It would fit a little better at some wall nearby, and more so scan by scan."""
    true = np.array([2.0, 1.6, 0.7])
    robot = Robot(l_room, true, seed)
    predicted = se2.compose(robot.map_from_odom, odometry_at(true))
    for _ in range(30):
        found = robot.find(odometry_at(true), robot.rng.uniform(-8.0, 8.0, (90, 2)))
        assert not robot.anchor.is_evidence
        np.testing.assert_allclose(found.poses, predicted[None], atol=1e-9)
        assert not found.information.any()
    way_m, _ = off(robot.find(odometry_at(true), robot.points(true)).poses[0], true)
    assert robot.anchor.is_evidence and way_m < 0.01


def test_scans_that_fit_ever_worse_do_not_make_a_bad_fit_convincing(l_room):
    true = np.array([2.0, 1.6, 0.7])
    robot = Robot(l_room, true, 0)
    for share in np.linspace(0.9, 0.3, 40):
        points = robot.points(true)
        elsewhere = robot.rng.random(len(points)) > share
        points[elsewhere] = robot.rng.uniform(-8.0, 8.0, (elsewhere.sum(), 2))
        way_m, turn_rad = off(robot.find(odometry_at(true), points).poses[0], true)
        assert way_m < 0.05 and turn_rad < np.radians(2.0)


@pytest.mark.parametrize(
    ("fit", "near", "believed"),
    [
        pytest.param(0.95, 0.4, True, id="a robot that slipped"),
        pytest.param(0.75, 0.3, True, id="a robot that slipped among some people"),
        pytest.param(0.54, 0.3, False, id="most of the scan is not in the map, here as there"),
        pytest.param(0.95, 0.92, False, id="it fits where odometry leads"),
    ],
)
def test_a_place_elsewhere_has_to_explain_half_of_what_does_not_fit(fit, near, believed):
    assert (fit >= scan_registration.least_fit_elsewhere(near)) == believed


def test_a_scan_is_worth_the_more_the_more_of_it_fits():
    worth = [scan_registration.worth(fit) for fit in (0.3, 0.5, 0.7, 0.8, 0.9, 1.0)]
    assert worth[:2] == [0.0, 0.0]
    assert worth[4:] == [1.0, 1.0]
    assert 0.0 < worth[2] < worth[3] < 1.0
