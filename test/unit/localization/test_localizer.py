"""A robot driven through rooms: tracked, with its beams told apart, and unmoved by what it cannot use."""

from __future__ import annotations

import gc
import weakref
from dataclasses import replace

import made_pane_drive
import numpy as np
import pytest
from buildings import BASE_FROM_LASER, GLASS_ROOM, L_ROOM, SECOND_NS, Building, loop_drive, odometry, off

from glass_nav import params
from glass_nav.geometry import angles, se2
from glass_nav.hypotheses import place_search
from glass_nav.localization.beam_classification.beam_classifier import BeamClassifier
from glass_nav.localization.localizer import Localizer
from glass_nav.localization.localizer_params import LaserLimits, LocalizerParams, Schedule
from glass_nav.sensing import bearings
from glass_nav.sensing.scan import Scan, ScanError
from glass_nav.world import landmark_map
from glass_nav.world.grid_map import GridMap
from glass_nav.world.landmark_map import UnknownLandmark

START_COVARIANCE = np.diag([0.05, 0.05, 0.03]) ** 2
MAPS = {building: building.grid_map() for building in (L_ROOM, GLASS_ROOM)}
ALL_ROUND = np.linspace(-np.pi, np.pi, 56, endpoint=False)


def parameters(**values):
    return params.load(LocalizerParams, {"min_particles": 200, "max_particles": 800, **values}, "test")


def started(building=L_ROOM, at=None, seed=0, grid_map=None, **values):
    localizer = Localizer(parameters(**values), grid_map or MAPS[building], np.random.default_rng(seed))
    localizer.set_pose(loop_drive(1)[0] if at is None else at, START_COVARIANCE)
    return localizer


class Drive:
    """The same robot for every filter: where it is, what odometry says, what it measures."""

    def __init__(
        self, building=L_ROOM, steps=30, seed=0, glass_share=0.0, centre=(2.6, 1.6), beams=180, way_share=0.05
    ):
        rng = np.random.default_rng(seed + 1000)
        self.true = loop_drive(steps, centre)
        self.odometry = odometry(self.true, rng, way_share)
        self.scans = [
            building.scan(pose, index * SECOND_NS, rng, beams=beams, glass_share=glass_share)
            for index, pose in enumerate(self.true)
        ]

    def through(self, localizer, first=0, last=None):
        return [localizer.update(scan, odom) for scan, odom in list(zip(self.scans, self.odometry))[first:last]]

    def errors(self, estimates):
        """(S, 2) of position [m] and heading [rad]."""
        first = [scan.stamp_ns for scan in self.scans].index(estimates[0].stamp_ns)
        return np.array([off(estimate.map_from_base, true) for estimate, true in zip(estimates, self.true[first:])])


@pytest.fixture(scope="module")
def drive():
    return Drive()


def same(one, other):
    """Two estimates agree to the last bit."""
    assert one.state == other.state and one.reason == other.reason and one.updated == other.updated
    for name in ("map_from_base", "covariance", "map_from_odom", "particles"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    np.testing.assert_array_equal(one.cases.case, other.cases.case)


# -- it tracks


@pytest.mark.long_run
@pytest.mark.parametrize("seed", range(3))
def test_a_robot_in_an_opaque_room_is_tracked_within_centimetres(seed):
    drive = Drive(seed=seed, steps=40)
    estimates = drive.through(started(seed=seed))
    way_m, turn_rad = drive.errors(estimates).T
    assert way_m.max() < 0.05 and way_m.mean() < 0.02
    assert turn_rad.max() < np.radians(1.5)
    assert estimates[-1].state == "LOCALIZED"
    assert all(estimate.updated for estimate in estimates)


@pytest.mark.long_run
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("glass_share", [0.3, 0.9])
def test_a_robot_beside_glass_is_tracked_within_centimetres(seed, glass_share):
    drive = Drive(GLASS_ROOM, seed=seed, glass_share=glass_share, centre=(3.6, 1.8))
    way_m, turn_rad = drive.errors(drive.through(started(GLASS_ROOM, drive.true[0], seed))).T
    assert way_m.max() < 0.05 and way_m.mean() < 0.02
    assert turn_rad.max() < np.radians(1.5)


@pytest.mark.long_run
@pytest.mark.parametrize("weight_mode", ["field", "ranges"])
@pytest.mark.parametrize("seed", range(2))
def test_either_way_to_weigh_particles_tracks_a_robot_beside_glass(seed, weight_mode):
    drive = Drive(GLASS_ROOM, seed=seed, glass_share=0.5, centre=(3.6, 1.8))
    way_m, turn_rad = drive.errors(drive.through(started(GLASS_ROOM, drive.true[0], seed, weight_mode=weight_mode))).T
    assert way_m.max() < 0.05 and turn_rad.max() < np.radians(1.5)


@pytest.mark.parametrize("vote_mode", ["soft", "paper"])
def test_beams_are_told_apart_as_they_were(vote_mode):
    """Half of the beams pass the pane. Those told wrong are few, and few are not told."""
    drive = Drive(GLASS_ROOM, seed=5, glass_share=0.5, centre=(3.6, 1.8), steps=20)
    told, truly = [], []
    for estimate, scan, pose in zip(
        drive.through(started(GLASS_ROOM, drive.true[0], vote_mode=vote_mode)), drive.scans, drive.true
    ):
        laser = se2.compose(pose, BASE_FROM_LASER)
        stopped, _ = GLASS_ROOM.measured(laser, scan.angles_rad)
        passed, case_passed = GLASS_ROOM.measured(laser, scan.angles_rad, np.ones(len(scan), bool))
        was_passed = (case_passed == 3) & (np.abs(scan.ranges_m - passed) < np.abs(scan.ranges_m - stopped))
        told.append(estimate.cases.case)
        truly.append(np.where(was_passed, 3, 1))
    told, truly = np.concatenate(told), np.concatenate(truly)
    assert np.count_nonzero(truly == 3) > 150
    assert np.mean(told[truly == 3] == 3) > (0.9 if vote_mode == "soft" else 0.75)  # paper: mirrors not gated
    assert np.mean(told[truly == 1] == 1) > 0.97


class GlassDrive(Drive):
    """Along the pane of GLASS_ROOM with a lidar that it answers head on and lets pass from the side, or never."""

    def __init__(self, seed=0, steps=40, head_on_answers=0.95, lobe_rad=np.radians(15.0), gone=False):
        super().__init__(GLASS_ROOM, steps, seed, centre=(3.6, 1.8))
        rng = np.random.default_rng(seed + 2000)
        self.passed, self.pane_m = [], []  # by beam of each scan: went through the pane; its range
        for index, (scan, pose) in enumerate(zip(self.scans, self.true)):
            laser = se2.compose(pose, BASE_FROM_LASER)
            incidence = np.abs(angles.wrap(scan.angles_rad + laser[2]))  # the pane is at x = 6, before the robot
            passes = rng.random(len(scan)) > np.where(incidence < lobe_rad, head_on_answers, 0.04)
            ranges_m, case = GLASS_ROOM.measured(laser, scan.angles_rad, passes)
            self.passed.append(case == 3)
            self.pane_m.append(GLASS_ROOM.measured(laser, scan.angles_rad)[0])
            self.scans[index] = replace(scan, ranges_m=ranges_m + rng.normal(0.0, 0.01, len(scan)))

    @staticmethod
    def pane_and_walls():
        """(H, W) bool: cells of the pane without its ends, and those of all walls a metre away from it."""
        grid_map = MAPS[GLASS_ROOM]
        rows, columns = np.indices(grid_map.occupancy.shape)
        x, y = grid_map.centres(rows.ravel(), columns.ravel()).T.reshape(2, *rows.shape)
        return (
            grid_map.occupied & (np.abs(x - 6.0) < 0.01) & (y > 0.3) & (y < 3.7),
            grid_map.occupied & (np.abs(x - 6.0) > 1.0),
        )


@pytest.mark.long_run
@pytest.mark.parametrize("seed", range(3))
def test_a_pane_becomes_glass_over_a_drive_and_a_wall_does_not(seed):
    drive = GlassDrive(seed)
    localizer = started(GLASS_ROOM, drive.true[0], seed)
    assert (localizer.glass_map.occupancy() == -1).all()  # nothing is known before
    drive.through(localizer)
    picture = localizer.glass_map.occupancy()
    pane, walls = GlassDrive.pane_and_walls()
    known_pane, known_walls = picture[pane & (picture >= 0)], picture[walls & (picture >= 0)]
    assert len(known_pane) > 30 and len(known_walls) > 100
    assert np.median(known_pane) > 60
    assert np.percentile(known_walls, 95) < 15
    assert (picture[~MAPS[GLASS_ROOM].occupied] == -1).all()


@pytest.mark.long_run
@pytest.mark.parametrize("seed", range(2))
def test_in_an_opaque_room_no_wall_becomes_glass(seed):
    drive = Drive(seed=seed, steps=40)
    localizer = started(seed=seed)
    drive.through(localizer)
    picture = localizer.glass_map.occupancy()
    assert np.count_nonzero(picture >= 0) > 100 and np.mean(picture[picture >= 0] > 30) < 0.01


@pytest.mark.long_run
@pytest.mark.parametrize("seed", range(3))
def test_a_lidar_that_sees_no_glass_at_all_is_localized(seed):
    """No beam ever comes back from the pane: the wall that the map has there is only in the way."""
    drive = GlassDrive(seed, lobe_rad=0.0, head_on_answers=0.0)
    estimates = drive.through(started(GLASS_ROOM, drive.true[0], seed))
    way_m, turn_rad = drive.errors(estimates).T
    assert way_m.max() < 0.05 and turn_rad.max() < np.radians(1.5)
    assert estimates[-1].state == "LOCALIZED"


@pytest.mark.long_run
def test_another_map_has_other_glass():
    drive = GlassDrive()
    localizer = started(GLASS_ROOM, drive.true[0])
    drive.through(localizer, last=20)
    assert (localizer.glass_map.occupancy() >= 0).any()
    localizer.set_map(MAPS[GLASS_ROOM])  # the same cells, but who knows?
    assert (localizer.glass_map.occupancy() == -1).all()
    drive.through(localizer, first=20)
    assert (localizer.glass_map.occupancy() >= 0).any()


def test_a_new_pose_on_the_same_map_keeps_its_glass():
    drive = GlassDrive()
    localizer = started(GLASS_ROOM, drive.true[0])
    drive.through(localizer, last=20)
    before = localizer.glass_map.occupancy()
    localizer.set_pose(drive.true[0], START_COVARIANCE)
    np.testing.assert_array_equal(localizer.glass_map.occupancy(), before)


@pytest.mark.long_run
def test_scans_that_fit_nowhere_teach_nothing():
    """A robot that was kidnapped would take all walls for glass."""
    drive = GlassDrive(steps=20)
    localizer = started(GLASS_ROOM, drive.true[0])
    drive.through(localizer, last=12)
    before = localizer.glass_map.occupancy()
    rng = np.random.default_rng(0)
    for index in range(12, 20):
        drive.scans[index] = replace(drive.scans[index], ranges_m=rng.uniform(4.0, 11.0, 180))
    drive.through(localizer, first=12)
    np.testing.assert_array_equal(localizer.glass_map.occupancy(), before)


# -- the scan in which glass is an obstacle


def test_beams_behind_the_pane_are_cut_at_it_and_others_are_left():
    """Nearly all beyond half a metre of its ends, where it meets walls and has no normal, and most there."""
    drive = GlassDrive(seed=3)
    cut, passed, at_ends, off_m = [], [], [], []
    for index, estimate in enumerate(drive.through(started(GLASS_ROOM, drive.true[0], 3))):
        scan, found = drive.scans[index], estimate.surface_scan
        assert found.ranges_m.shape == scan.ranges_m.shape
        assert np.all(found.ranges_m <= scan.ranges_m)
        np.testing.assert_array_equal(found.ranges_m[~found.cut], scan.ranges_m[~found.cut])
        laser = se2.compose(drive.true[index], BASE_FROM_LASER)
        y = laser[1] + drive.pane_m[index] * np.sin(scan.angles_rad + laser[2])
        at_ends.append((y < 0.5) | (y > 3.5))
        across = np.abs(np.cos(scan.angles_rad + laser[2]))
        right = found.cut & drive.passed[index]
        off_m.append((np.abs(found.ranges_m - drive.pane_m[index]) * across)[right])
        cut.append(found.cut)
        passed.append(drive.passed[index])
    cut, passed, at_ends = np.concatenate(cut), np.concatenate(passed), np.concatenate(at_ends)
    assert np.count_nonzero(passed & ~at_ends) > 300
    assert np.mean(cut[passed & ~at_ends]) > 0.97 and np.mean(cut[passed]) > 0.8 and np.mean(cut[~passed]) < 0.03
    assert np.percentile(np.concatenate(off_m), 95) < 0.06


@pytest.mark.long_run
def test_a_surface_scan_is_trusted_where_the_robot_is_localized_and_nowhere_else():
    drive = GlassDrive(steps=35)
    rng = np.random.default_rng(0)
    for index in range(15, 30):  # a hand before the lidar
        drive.scans[index] = replace(drive.scans[index], ranges_m=rng.uniform(0.1, 0.5, 180))
    estimates = drive.through(started(GLASS_ROOM, drive.true[0]))
    trusted = [estimate.surface_scan.trusted for estimate in estimates]
    assert trusted == [estimate.state == "LOCALIZED" for estimate in estimates]
    assert True in trusted and False in trusted
    for estimate, scan in zip(estimates, drive.scans):
        if not estimate.surface_scan.trusted:
            assert not estimate.surface_scan.cut.any()
            np.testing.assert_array_equal(estimate.surface_scan.ranges_m, scan.ranges_m)


def test_while_a_robot_is_searched_for_nothing_is_cut():
    drive = GlassDrive(steps=2)
    localizer = Localizer(parameters(max_particles=2000), MAPS[GLASS_ROOM], np.random.default_rng(0))
    localizer.scatter()
    first = drive.through(localizer, last=1)[0]
    assert first.state != "LOCALIZED" and not first.surface_scan.trusted and not first.surface_scan.cut.any()


def test_a_scan_between_updates_is_cut_too():
    drive = GlassDrive(steps=12)
    localizer = started(GLASS_ROOM, drive.true[0])
    last = drive.through(localizer)[-1]
    again = localizer.update(replace(drive.scans[-1], stamp_ns=drive.scans[-1].stamp_ns + 1), drive.odometry[-1])
    assert not again.updated and again.surface_scan.trusted
    assert np.mean(again.surface_scan.cut == last.surface_scan.cut) > 0.97 and again.surface_scan.cut.any()


@pytest.mark.long_run
@pytest.mark.parametrize("vote_mode", ["soft", "paper"])
def test_between_updates_beams_are_told_apart_as_in_one(vote_mode):
    """The same scans from where the robot stands, once with an update and once between updates."""
    drive = Drive(GLASS_ROOM, glass_share=0.5)
    localizer = started(GLASS_ROOM, at=drive.true[0], vote_mode=vote_mode)
    told = []
    for scan, odom in zip(drive.scans, drive.odometry):
        at_update, between = (
            localizer.update(replace(scan, stamp_ns=scan.stamp_ns + later_ns), odom) for later_ns in (0, 1000)
        )
        assert at_update.updated and not between.updated
        told.append((at_update.cases.case, between.cases.case))
    at_update, between = np.array(told).transpose(1, 0, 2)
    assert np.mean(at_update == between) > 0.99
    assert np.count_nonzero(between >= 3) > 50


def test_in_an_opaque_room_no_beam_is_said_to_pass(drive):
    cases = np.concatenate([estimate.cases.case for estimate in drive.through(started())])
    assert np.mean(cases == 1) > 0.99


@pytest.mark.parametrize("beams", [1, 2, 5, 40])
def test_few_beams_are_used_as_far_as_they_go(beams):
    """With 40 beams all is well; with fewer the estimate is at least as good as the odometry of the drive."""
    drive = Drive(beams=beams, way_share=0.02)
    way_m, _ = drive.errors(drive.through(started())).T
    assert way_m[-1] < (0.03 if beams == 40 else 0.35)
    assert len(drive.scans[0]) == beams


@pytest.mark.long_run
def test_it_tracks_with_fewer_resamplings_and_more_threads():
    drive = Drive(seed=7, steps=20)
    way_m, _ = drive.errors(drive.through(started(resample_interval=3, raycast_threads=2))).T
    assert way_m.max() < 0.05


def test_it_tracks_without_particles_from_the_scan():
    drive = Drive(seed=8)
    way_m, _ = drive.errors(drive.through(started(proposal_scan_share=0.0))).T
    assert way_m.max() < 0.15


@pytest.mark.parametrize("where", [np.array([10.0, -20.0, 0.0]), np.array([-3.0, 5.0, 2.0])])
def test_where_the_map_lies_and_how_it_is_turned_does_not_matter(drive, where):
    straight = MAPS[L_ROOM]
    moved = GridMap(straight.occupancy, straight.resolution_m, se2.compose(where, straight.map_from_grid))
    estimates = drive.through(started(grid_map=moved, at=se2.compose(where, drive.true[0])), last=12)
    for estimate, true in zip(estimates, drive.true):
        way_m, turn_rad = off(estimate.map_from_base, se2.compose(where, true))
        assert way_m < 0.05 and turn_rad < np.radians(1.5)


@pytest.mark.long_run
@pytest.mark.parametrize("seed", range(4))
def test_from_anywhere_scans_lead_to_the_right_place(seed):
    drive = Drive(seed=seed, steps=40)
    localizer = Localizer(parameters(), MAPS[L_ROOM], np.random.default_rng(seed))
    localizer.scatter()
    estimates = drive.through(localizer)
    states = [estimate.state for estimate in estimates]
    assert states[0] == "GLOBAL_SEARCH" and states[-1] == "LOCALIZED"
    way_m, _ = drive.errors(estimates).T
    assert all(way_m[index] < 0.1 for index, state in enumerate(states) if state == "LOCALIZED")


def test_while_places_look_alike_all_of_them_are_reported():
    """In a square room without a mark there are four."""
    room = Building([(0, 0), (6, 0), (6, 6), (0, 6)])
    localizer = Localizer(parameters(), room.grid_map(), np.random.default_rng(0))
    localizer.scatter()
    true = np.array([2.0, 2.5, 0.3])
    told = localizer.update(room.scan(true), np.zeros(3))
    assert told.state == "GLOBAL_SEARCH" and "places are possible, the best at x " in told.reason
    centre = np.array([3.0, 3.0])
    for quarter in range(4):
        turned = se2.compose(np.array([*centre, quarter * np.pi / 2]), np.array([*(true[:2] - centre), true[2]]))
        off_m, off_rad = np.array([off(particle, turned) for particle in told.particles]).T
        assert np.any((off_m < 0.15) & (off_rad < np.radians(3.0))), quarter
    assert told.covariance[0, 0] > 0.5  # of all of them, not of one
    assert told.confidence < 0.5


def test_in_an_area_only_what_lies_in_it_is_a_candidate():
    room = Building([(0, 0), (6, 0), (6, 6), (0, 6)])
    localizer = Localizer(parameters(), room.grid_map(), np.random.default_rng(0))
    localizer.scatter(np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 3.0]]))
    true = np.array([2.0, 2.5, 0.3])
    told = localizer.update(room.scan(true), np.zeros(3))
    assert np.all(told.particles[:, :2] < 3.7)  # an alignment may lead out by decimetres
    assert off(told.map_from_base, true)[0] < 0.1


@pytest.mark.long_run
def test_a_pose_given_too_vaguely_to_track_is_looked_for_within_its_reach():
    drive = Drive(seed=1, steps=40)
    localizer = Localizer(parameters(), MAPS[L_ROOM], np.random.default_rng(1))
    localizer.set_pose(drive.true[0] + [0.8, -0.5, 0.5], np.diag([1.5, 1.5, 1.0]) ** 2)
    estimates = drive.through(localizer)
    assert estimates[0].state == "GLOBAL_SEARCH" and estimates[-1].state == "LOCALIZED"
    assert drive.errors(estimates)[-1, 0] < 0.05


def test_a_scan_without_answers_leaves_a_search_where_it_is():
    drive = Drive(steps=2)
    localizer = Localizer(parameters(), MAPS[L_ROOM], np.random.default_rng(0))
    localizer.scatter()
    blind = localizer.update(replace(drive.scans[0], ranges_m=np.full(len(drive.scans[0]), np.nan)), drive.odometry[0])
    assert blind.state == "GLOBAL_SEARCH" and blind.reason == "no usable scan yet"
    assert np.isfinite(blind.map_from_base).all() and blind.confidence < 0.5
    seen = localizer.update(drive.scans[1], drive.odometry[1])
    assert "possible" in seen.reason


@pytest.mark.long_run
def test_a_robot_that_was_carried_away_says_so_and_is_found_again():
    drive = Drive(seed=3, steps=90)
    localizer = started(at=drive.true[0], seed=3)
    drive.through(localizer, last=20)
    moved = se2.compose(drive.odometry[19], se2.inverse(drive.odometry[40]))  # what odometry did not notice
    estimates = [
        localizer.update(scan, se2.compose(moved, odom)) for scan, odom in zip(drive.scans[40:], drive.odometry[40:])
    ]
    way_m, _ = drive.errors(estimates).T
    left = next(index for index, estimate in enumerate(estimates) if estimate.state != "LOCALIZED")
    assert left < 8 and way_m[0] > 0.7
    assert "the scans fit" in estimates[left].reason
    assert estimates[left].confidence < 0.9
    assert estimates[-1].state == "LOCALIZED" and way_m[-1] < 0.05


@pytest.mark.long_run
def test_a_start_in_the_wrong_place_is_put_right():
    drive = Drive(seed=4, steps=40)
    estimates = drive.through(started(at=drive.true[0] + [1.0, 0.8, 2.0], seed=4))
    assert any(estimate.state in ("UNCERTAIN", "LOST") for estimate in estimates[:6])
    assert drive.errors(estimates)[-1, 0] < 0.05 and estimates[-1].state == "LOCALIZED"


@pytest.mark.long_run
@pytest.mark.parametrize("forced", [False, True], ids=["no update due", "an update with every scan"])
def test_a_robot_that_stands_for_five_minutes_stays_where_it_is(forced):
    """A scan a second; odometry trembles by half a millimetre."""
    rng = np.random.default_rng(5)
    true = loop_drive(1)[0]
    localizer = started(at=true, seed=5)
    told = []
    for second in range(300):
        if forced:
            localizer.request_update()
        told.append(localizer.update(L_ROOM.scan(true, second * SECOND_NS, rng), rng.normal(0.0, 0.0005, 3)))
    assert sum(estimate.updated for estimate in told) == (300 if forced else 1)
    drift_m, _ = np.array([off(estimate.map_from_base, told[10].map_from_base) for estimate in told[10:]]).T
    assert drift_m.max() < 0.01
    assert off(told[-1].map_from_base, true)[0] < 0.02


# -- what happens between and beside good scans


@pytest.mark.long_run
@pytest.mark.parametrize("seed", range(3))
def test_a_wheel_that_slips_is_made_up_for_by_the_scan(seed):
    drive = Drive(seed=seed)
    slip = np.array([0.3, -0.1, np.radians(12.0)])
    for index in range(15, 30):
        drive.odometry[index] = se2.compose(
            se2.compose(drive.odometry[14], slip), se2.compose(se2.inverse(drive.odometry[14]), drive.odometry[index])
        )
    way_m, turn_rad = drive.errors(drive.through(started(seed=seed))).T
    assert way_m[17:].max() < 0.05 and turn_rad[17:].max() < np.radians(1.5)


@pytest.mark.long_run
@pytest.mark.parametrize("seed", range(3))
def test_one_absurd_scan_is_forgotten_with_the_next_ones(seed):
    """A ring of 56 beams at 1.0 m all round in the midst of a good drive."""
    drive = Drive(seed=seed)
    drive.scans[15] = replace(drive.scans[15], ranges_m=np.full(56, 1.0), angles_rad=ALL_ROUND)
    way_m, turn_rad = drive.errors(drive.through(started(seed=seed))).T
    assert way_m[:15].max() < 0.05
    assert way_m[18:].max() < 0.05 and turn_rad[18:].max() < np.radians(1.5)


@pytest.mark.parametrize("nothing", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("seed", range(2))
def test_without_answers_the_robot_goes_where_odometry_leads(nothing, seed):
    drive = Drive(seed=seed, way_share=0.01)
    for index in range(10, 20):
        drive.scans[index] = replace(drive.scans[index], ranges_m=np.full(180, nothing))
    localizer = started(seed=seed)
    estimates = drive.through(localizer)
    blind = estimates[10:20]
    for index in range(10, 20):
        expected = se2.compose(estimates[9].map_from_odom, drive.odometry[index])
        way_m, turn_rad = off(estimates[index].map_from_base, expected)
        assert way_m < 0.08 and turn_rad < np.radians(3.0)
    assert np.linalg.eigvalsh(blind[-1].covariance).min() >= 0.0
    assert np.trace(blind[-1].covariance) > np.trace(blind[0].covariance)  # it knows that it knows less
    assert all(np.isnan(estimate.inlier_ratio) and not estimate.cases.case.any() for estimate in blind)
    assert drive.errors(estimates)[21:, 0].max() < 0.05  # and what it sees again counts again


def test_a_robot_that_never_saw_anything_is_not_called_localized():
    drive = Drive(steps=3)
    drive.scans = [replace(scan, ranges_m=np.full(180, np.inf)) for scan in drive.scans]
    last = drive.through(started())[-1]
    assert last.state == "UNCERTAIN"
    assert last.reason.startswith("no scan has been used yet; ")


@pytest.mark.long_run
def test_a_robot_that_sees_what_cannot_be_is_called_lost():
    drive = Drive(seed=3, steps=35)
    rng = np.random.default_rng(0)
    for index in range(10, 35):
        drive.scans[index] = replace(drive.scans[index], ranges_m=rng.uniform(0.3, 11.0, 180))
    states = [estimate.state for estimate in drive.through(started())]
    assert states[9] == "LOCALIZED" and states[-1] == "LOST"


def test_who_stands_still_is_not_moved(drive):
    localizer = started()
    drive.through(localizer, last=5)
    rng = np.random.default_rng(1)
    still = [
        localizer.update(L_ROOM.scan(drive.true[4], (10 + index) * SECOND_NS, rng), drive.odometry[4])
        for index in range(50)
    ]
    assert not any(estimate.updated for estimate in still)
    poses = np.array([estimate.map_from_base for estimate in still])
    assert np.abs(poses - poses[0]).max() < 1e-12
    np.testing.assert_array_equal(still[0].particles, still[-1].particles)
    assert np.mean(still[-1].cases.case == 1) > 0.95  # the cases are those of the newest scan all the same


def test_below_the_least_way_and_turn_odometry_alone_carries_on(drive):
    localizer = started(update_min_d=0.2, update_min_a=0.2)
    before = drive.through(localizer, last=1)[0]
    step = np.array([0.15, 0.0, 0.15])
    after = localizer.update(scan_after(drive, step, 1), se2.compose(drive.odometry[0], step))
    assert before.updated and not after.updated
    np.testing.assert_allclose(after.map_from_base, se2.compose(before.map_from_base, step), atol=1e-12)
    turn = np.array([0.0, 0.0, 0.21])
    assert localizer.update(scan_after(drive, turn, 2), se2.compose(drive.odometry[0], turn)).updated


def scan_after(drive, step, index, lidar=""):
    """Of the robot that made that step from where the drive begins."""
    pose = se2.compose(drive.true[0], np.asarray(step))
    return replace(L_ROOM.scan(pose, index * SECOND_NS, np.random.default_rng(index)), lidar=lidar)


def test_the_beams_of_a_scan_between_updates_are_classified_once_somebody_asks(drive):
    classified = []

    class Watched(BeamClassifier):
        def classify(self, scan, *arguments, **options):
            classified.append(scan.stamp_ns)
            return super().classify(scan, *arguments, **options)

    localizer = Localizer(parameters(), MAPS[L_ROOM], np.random.default_rng(0), classifier=Watched)
    localizer.set_pose(drive.true[0], START_COVARIANCE)
    localizer.update(drive.scans[0], drive.odometry[0])
    estimate = localizer.update(scan_after(drive, np.zeros(3), 1), drive.odometry[0])
    assert not estimate.updated and classified == [drive.scans[0].stamp_ns]
    asked = estimate.cases, estimate.surface_scan, estimate.inlier_ratio
    assert classified[1:] == [estimate.stamp_ns] and len(asked[0].case) == len(asked[1].cut) and asked[2] > 0.9


def test_a_scan_that_no_longer_fits_is_an_update(drive):
    """Odometry reports nothing of a turn: by the distance driven there would be no update."""
    localizer = started()
    localizer.update(scan_after(drive, [0.0, 0.0, 0.0], 0), drive.odometry[0])
    assert not localizer.update(scan_after(drive, [0.0, 0.0, 0.0], 1), drive.odometry[0]).updated
    turn = np.array([0.0, 0.0, np.radians(6.0)])
    estimate = localizer.update(scan_after(drive, turn, 2), drive.odometry[0])
    assert estimate.updated
    assert off(estimate.map_from_base, se2.compose(drive.true[0], turn))[1] < np.radians(0.5)


def test_a_requested_update_uses_the_next_scan_of_a_robot_that_stands(drive):
    localizer = started()
    drive.through(localizer, last=1)
    localizer.request_update()
    scans = [replace(drive.scans[0], stamp_ns=stamp_ns) for stamp_ns in (1, 2)]
    assert [localizer.update(scan, drive.odometry[0]).updated for scan in scans] == [True, False]


def seen_by(scan, lidar, later_ns=0):
    return replace(scan, lidar=lidar, stamp_ns=scan.stamp_ns + later_ns)


def test_of_two_lidars_each_has_its_update_after_a_move(drive):
    localizer = started(update_min_d=0.2, update_min_a=0.2)
    still, moved = drive.odometry[0], se2.compose(drive.odometry[0], np.array([0.21, 0.0, 0.0]))
    updated = [
        localizer.update(scan_after(drive, se2.compose(se2.inverse(still), odom), index, lidar), odom).updated
        for index, (lidar, odom) in enumerate(
            [
                ("front", still),
                ("rear", still),
                ("front", still),
                ("rear", still),
                ("rear", moved),
                ("front", moved),
                ("rear", moved),
                ("front", moved),
            ]
        )
    ]
    assert updated == [True, True, False, False, True, True, False, False]


def test_two_lidars_need_not_agree_on_the_order_of_their_stamps(drive):
    localizer = started()
    localizer.update(seen_by(drive.scans[1], "front"), drive.odometry[1])
    localizer.update(seen_by(drive.scans[1], "rear", -20_000_000), drive.odometry[1])  # its scan came late
    refused(
        localizer,
        ScanError,
        "scan at 0.970 s: time runs backwards, the last scan was at 0.980 s",
        lambda localizer: localizer.update(seen_by(drive.scans[1], "rear", -30_000_000), drive.odometry[1]),
    )


@pytest.mark.long_run
@pytest.mark.parametrize("seed", range(2))
def test_two_half_blind_lidars_track_like_one_that_sees_all(seed):
    whole = Drive(seed=seed)
    localizer = started(at=whole.true[0])
    halves = {"front": slice(45, 135), "rear": np.r_[0:45, 135:180]}
    off_m = []
    for scan, odom, true in zip(whole.scans, whole.odometry, whole.true):
        for late, (lidar, beams) in enumerate(halves.items()):
            part = replace(scan, ranges_m=scan.ranges_m[beams], angles_rad=scan.angles_rad[beams])
            estimate = localizer.update(seen_by(part, lidar, late), odom)
            off_m.append(off(estimate.map_from_base, true)[0])
    assert max(off_m) < 0.05


def test_other_parameters_leave_what_the_filter_knows(drive):
    localizer, twin = started(min_particles=300), started(min_particles=300)
    for each in (localizer, twin):
        drive.through(each, last=10)
    localizer.reconfigure(parameters(min_particles=300))
    same(
        drive.through(localizer, 10, 11)[0], drive.through(twin, 10, 11)[0]
    )  # to the last bit, random numbers included
    localizer.reconfigure(
        parameters(
            min_particles=700,
            max_particles=700,
            localized_max_position_sigma_m=1e-6,
            glass_prior=0.6,
            raycast_threads=2,
        )
    )
    after = drive.through(localizer, 11, 12)[0]
    assert len(after.particles) == 700
    assert after.state == "UNCERTAIN"  # by the new limit
    assert off(after.map_from_base, drive.true[11])[0] < 0.05
    wall = np.array([0])
    assert localizer.glass_map.chances(wall)[0] != twin.glass_map.chances(wall)[0]
    np.testing.assert_array_equal(
        localizer.glass_map.occupancy() >= 0, drive_on(twin, drive, 11).glass_map.occupancy() >= 0
    )


def drive_on(localizer, drive, index):
    drive.through(localizer, index, index + 1)
    return localizer


def test_another_map_leaves_the_particles_where_they_are(drive):
    localizer = started(odom_alpha1=0.0, odom_alpha2=0.0, odom_alpha3=0.0, odom_alpha4=0.0)
    before = drive.through(localizer, last=3)[-1]
    localizer.set_map(MAPS[GLASS_ROOM])
    blind = replace(drive.scans[2], stamp_ns=drive.scans[2].stamp_ns + 1, ranges_m=np.full(180, np.nan))
    after = localizer.update(blind, drive.odometry[2])
    assert after.updated  # a new map makes an update due

    def places(estimate):
        return {tuple(pose) for pose in np.round(estimate.particles, 9)}

    assert places(after) <= places(before)


def test_in_another_map_the_robot_is_tracked_by_its_walls():
    drive = Drive(GLASS_ROOM, seed=2, centre=(3.0, 1.6), glass_share=0.3)
    localizer = started(L_ROOM, drive.true[0])
    localizer.set_map(MAPS[GLASS_ROOM])
    assert drive.errors(drive.through(localizer))[:, 0].max() < 0.05


def test_a_new_pose_starts_over(drive):
    localizer = started()
    drive.through(localizer, last=12)
    localizer.set_pose(drive.true[0], START_COVARIANCE)  # the robot was carried back; its stamps start over, too
    assert drive.errors(drive.through(localizer, last=12))[:, 0].max() < 0.05


@pytest.mark.parametrize("seed", range(3))
def test_particles_start_as_the_covariance_says(seed):
    turn = np.array([[np.cos(0.5), -np.sin(0.5), 0.0], [np.sin(0.5), np.cos(0.5), 0.0], [0.0, 0.0, 1.0]])
    covariance = turn @ np.diag([0.2, 0.05, 0.1]) ** 2 @ turn.T
    localizer = Localizer(parameters(max_particles=5000, min_particles=5000), MAPS[L_ROOM], np.random.default_rng(seed))
    pose = np.array([2.0, 1.5, np.pi])
    localizer.set_pose(pose, covariance)
    estimate = localizer.update(Scan(0, np.full(4, np.nan), np.arange(4.0), 0.1, 10.0, np.zeros(3)), np.zeros(3))
    off_pose = estimate.particles - pose
    off_pose[:, 2] = angles.wrap(off_pose[:, 2])
    np.testing.assert_allclose(np.cov(off_pose.T), covariance, atol=0.06 * 0.2**2)
    assert estimate.particles[:, 2].min() >= -np.pi and estimate.particles[:, 2].max() < np.pi


def test_a_start_may_be_exact(drive):
    localizer = started()
    localizer.set_pose(drive.true[0], np.zeros((3, 3)))
    assert drive.errors(drive.through(localizer))[:, 0].max() < 0.05


@pytest.mark.parametrize("seed", range(3))
def test_a_scatter_covers_the_free_cells_and_nothing_else(seed):
    occupancy = np.full((40, 60), 100, np.int8)
    occupancy[5:20, 10:30] = 0
    occupancy[30:35, 50:55] = 0
    grid_map = GridMap(occupancy, 0.1, np.array([3.0, -1.0, 0.4]))
    localizer = Localizer(parameters(max_particles=3000, min_particles=3000), grid_map, np.random.default_rng(seed))
    localizer.scatter()
    found = localizer.update(Scan(0, np.full(4, np.nan), np.arange(4.0), 0.1, 10.0, np.zeros(3)), np.zeros(3)).particles
    assert grid_map.is_free(found[:, :2]).all()
    rows, _ = grid_map.cells(found[:, :2])
    assert np.mean(rows >= 30) == pytest.approx(25.0 / 325.0, abs=0.03)  # by area
    assert np.histogram(found[:, 2], 8, (-np.pi, np.pi))[0].min() > 200  # any heading


CORNER = np.array([[0.2, 0.2], [2.0, 0.2], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.2, 2.0]])


def test_in_an_area_particles_are_scattered_nowhere_else():
    localizer = Localizer(parameters(max_particles=3000, min_particles=3000), MAPS[L_ROOM], np.random.default_rng(1))
    localizer.scatter(CORNER)
    estimate = localizer.update(Scan(0, np.full(4, np.nan), np.arange(4.0), 0.1, 10.0, np.zeros(3)), np.zeros(3))
    found = estimate.particles[:, :2]
    assert MAPS[L_ROOM].is_free(found).all()
    half_cell_m = 0.5 * MAPS[L_ROOM].resolution_m
    assert (found.min(axis=0) >= 0.2 - half_cell_m).all() and (found.max(axis=0) <= 2.0 + half_cell_m).all()
    assert not np.any((found > 1.0 + half_cell_m).all(axis=1))  # the corner that is cut out
    assert np.mean(found[:, 0] > 1.0) == pytest.approx(0.8 / (0.8 * 1.8 + 0.8), abs=0.05)  # by area


@pytest.mark.parametrize(
    "area, text",
    [
        pytest.param(CORNER + 50.0, "the area has no free cell to put particles on", id="outside"),
        pytest.param(
            CORNER[:2], "an area needs at least 3 corners of finite x, y, got [[0.2, 0.2], [2.0, 0.2]]", id="line"
        ),
        pytest.param(
            np.array([[0.0, 0.0], [1.0, 0.0], [1.0, np.nan]]),
            "an area needs at least 3 corners of finite x, y, got [[0.0, 0.0], [1.0, 0.0], [1.0, nan]]",
            id="NaN",
        ),
    ],
)
def test_an_area_that_is_none_changes_nothing(drive, area, text):
    localizer = started()
    drive.through(localizer, last=3)
    refused(localizer, ValueError, text, lambda localizer: localizer.scatter(area))
    assert drive.errors(drive.through(localizer, 3, 8))[:, 0].max() < 0.05


# -- what it says


def test_an_estimate_is_whole(drive):
    for estimate, scan, odom in zip(drive.through(started()), drive.scans, drive.odometry):
        assert estimate.stamp_ns == scan.stamp_ns
        np.testing.assert_allclose(se2.compose(estimate.map_from_odom, odom), estimate.map_from_base, atol=1e-12)
        np.testing.assert_allclose(estimate.covariance, estimate.covariance.T, atol=1e-15)
        assert np.linalg.eigvalsh(estimate.covariance).min() >= -1e-12
        assert 200 <= len(estimate.particles) <= 800 and np.isfinite(estimate.particles).all()
        assert estimate.cases.case.shape == (180,)
        assert estimate.inlier_ratio == pytest.approx(np.mean(estimate.cases.case > 0))
        told = estimate.cases.case > 0
        np.testing.assert_allclose(estimate.cases.residual_m[told], (scan.ranges_m - estimate.cases.expected_m)[told])
        assert np.median(np.abs(estimate.cases.residual_m[told])) < 0.03


@pytest.mark.long_run
def test_the_same_seed_gives_the_same_answer(drive):
    for one, other in zip(drive.through(started(seed=4)), drive.through(started(seed=4))):
        same(one, other)


def test_threads_do_not_change_the_answer(drive):
    for one, other in zip(
        drive.through(started(seed=4), last=10), drive.through(started(seed=4, raycast_threads=3), last=10)
    ):
        same(one, other)


def test_mrpts_ray_casts_give_nearly_the_same_answer(drive):
    ours, mrpts = drive.through(started()), drive.through(started(raycast_backend="mrpt"))
    assert np.abs(drive.errors(ours) - drive.errors(mrpts)).max() < 0.03
    same_case = [np.mean(one.cases.case == other.cases.case) for one, other in zip(ours, mrpts)]
    assert np.mean(same_case) > 0.98


def test_the_search_beside_tracking_ends_though_the_robot_stands(drive, monkeypatch):
    """Each scan advances it, though only the first one moves the particles; its verdict changes the confidence."""
    monkeypatch.setattr(place_search, "_SLICE", 20_000)
    localizer = started(at=drive.true[0] + [0.0, 0.0, 0.2])
    stands = [
        localizer.update(replace(drive.scans[0], stamp_ns=index * SECOND_NS), drive.odometry[0]) for index in range(60)
    ]
    assert not any(estimate.updated for estimate in stands[1:])
    assert 1.0 - stands[-1].confidence < 0.5 * (1.0 - stands[1].confidence)


@pytest.mark.long_run
def test_another_seed_gives_nearly_the_same_answer(drive):
    one, other = drive.through(started(seed=5)), drive.through(started(seed=6))
    assert not np.array_equal(one[-1].particles, other[-1].particles)
    ways = [off(left.map_from_base, right.map_from_base)[0] for left, right in zip(one, other)]
    assert max(ways) < 0.03


# -- what it does not use


@pytest.mark.parametrize(
    "limits, garbage",
    [
        (dict(laser_max_range=2.0), lambda z, rng: np.where(z >= 2.0, rng.uniform(2.0, 9.0, len(z)), z)),
        (dict(laser_min_range=1.5), lambda z, rng: np.where(z < 1.5, rng.uniform(0.1, 1.5, len(z)), z)),
        (
            dict(laser_min_range=1.0, laser_max_range=3.0),
            lambda z, rng: np.where((z < 1.0) | (z >= 3.0), rng.choice([0.5, 7.0, np.nan], len(z)), z),
        ),
    ],
)
def test_ranges_outside_the_limits_do_not_matter(drive, limits, garbage):
    rng = np.random.default_rng(0)
    clean, spoilt = started(**limits), started(**limits)
    used = []
    for scan, odom in list(zip(drive.scans, drive.odometry))[:15]:
        estimate = clean.update(scan, odom)
        same(estimate, spoilt.update(replace(scan, ranges_m=garbage(scan.ranges_m, rng)), odom))
        outside = (scan.ranges_m >= limits.get("laser_max_range", np.inf)) | (
            scan.ranges_m < limits.get("laser_min_range", 0.0)
        )
        assert not estimate.cases.case[outside].any()
        used.append(np.count_nonzero(estimate.cases.case))
    assert np.mean(used) > 20


@pytest.mark.parametrize("nothing", [np.nan, np.inf, -np.inf])
def test_single_beams_without_answer_are_uncertain_and_do_no_harm(drive, nothing):
    localizer = started()
    for index, (scan, odom, true) in enumerate(zip(drive.scans, drive.odometry, drive.true)):
        ranges_m = scan.ranges_m.copy()
        ranges_m[index % 3 :: 3] = nothing
        estimate = localizer.update(replace(scan, ranges_m=ranges_m), odom)
        assert not estimate.cases.case[index % 3 :: 3].any()
        assert off(estimate.map_from_base, true)[0] < 0.05


def refused(localizer, kind, text, call):
    with pytest.raises(kind) as err:
        call(localizer)
    assert type(err.value) is kind
    assert str(err.value) == text


BAD_INPUT = [
    pytest.param(
        ScanError,
        "scan at 1.000 s: time runs backwards, the last scan was at 3.000 s",
        lambda localizer, drive: localizer.update(drive.scans[1], drive.odometry[4]),
        id="time runs backwards",
    ),
    pytest.param(
        ScanError,
        "scan at 4.000 s: odometry must be finite x, y, yaw, got [ 0. nan  0.]",
        lambda localizer, drive: localizer.update(drive.scans[4], np.array([0.0, np.nan, 0.0])),
        id="odometry NaN",
    ),
    pytest.param(
        ScanError,
        "scan at 4.000 s: odometry must be finite x, y, yaw, got [0. 0.]",
        lambda localizer, drive: localizer.update(drive.scans[4], np.zeros(2)),
        id="odometry of two numbers",
    ),
    pytest.param(
        ValueError,
        "a pose needs finite x, y, yaw, got [ 0.  0. inf]",
        lambda localizer, drive: localizer.set_pose(np.array([0.0, 0.0, np.inf]), np.zeros((3, 3))),
        id="pose inf",
    ),
    pytest.param(
        ValueError,
        "a pose needs finite x, y, yaw, got [0. 0.]",
        lambda localizer, drive: localizer.set_pose(np.zeros(2), np.zeros((3, 3))),
        id="pose of two numbers",
    ),
    pytest.param(
        ValueError,
        "a pose needs a finite covariance (3, 3), got [[nan, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]",
        lambda localizer, drive: localizer.set_pose(np.zeros(3), np.diag([np.nan, 1.0, 1.0])),
        id="covariance NaN",
    ),
    pytest.param(
        ValueError,
        "a pose needs a finite covariance (3, 3), got [[1.0, 0.0], [0.0, 1.0]]",
        lambda localizer, drive: localizer.set_pose(np.zeros(3), np.eye(2)),
        id="covariance (2, 2)",
    ),
    pytest.param(
        ValueError,
        "the covariance of a pose must be symmetric, got [[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]",
        lambda localizer, drive: localizer.set_pose(
            np.zeros(3), np.eye(3) + 0.5 * np.eye(3)[[1, 1, 1]] * np.array([[1.0], [0.0], [0.0]])
        ),
        id="asymmetric covariance",
    ),
    pytest.param(
        ValueError,
        "the covariance of a pose must not be negative, got [[1.0, 0.0, 0.0], [0.0, -0.1, 0.0], [0.0, 0.0, 1.0]]",
        lambda localizer, drive: localizer.set_pose(np.zeros(3), np.diag([1.0, -0.1, 1.0])),
        id="negative covariance",
    ),
]


@pytest.mark.parametrize("kind, text, call", BAD_INPUT)
def test_what_cannot_be_used_is_refused_in_one_line_and_changes_nothing(drive, kind, text, call):
    """A filter that refused something goes on as one that was never asked."""
    asked, twin = started(seed=9), started(seed=9)
    drive.through(asked, last=4)
    drive.through(twin, last=4)
    refused(asked, kind, text, lambda localizer: call(localizer, drive))
    for one, other in zip(drive.through(asked, 4, 7), drive.through(twin, 4, 7)):
        same(one, other)


def test_limits_that_leave_nothing_of_a_scan_refuse_it_and_change_nothing(drive):
    asked, twin = (started(seed=9, laser_min_range=0.1) for _ in range(2))
    drive.through(asked, last=5)
    drive.through(twin, last=5)
    short = replace(drive.scans[5], range_max_m=0.08)
    refused(
        asked,
        ScanError,
        "scan at 5.000 s: no range is left between 0.1 m and 0.08 m",
        lambda localizer: localizer.update(short, drive.odometry[5]),
    )
    same(drive.through(asked, 5, 6)[0], drive.through(twin, 5, 6)[0])


def test_two_scans_may_bear_the_same_stamp(drive):
    localizer = started()
    drive.through(localizer, last=3)
    assert localizer.update(drive.scans[2], drive.odometry[2]).stamp_ns == drive.scans[2].stamp_ns


def test_before_a_start_there_is_nothing_to_update(drive):
    localizer = Localizer(parameters(), MAPS[L_ROOM], np.random.default_rng(0))
    refused(
        localizer,
        RuntimeError,
        "update() needs set_pose() or scatter() first",
        lambda localizer: localizer.update(drive.scans[0], drive.odometry[0]),
    )
    localizer.set_pose(drive.true[0], START_COVARIANCE)
    assert drive.errors(drive.through(localizer))[:, 0].max() < 0.05


@pytest.mark.parametrize("cell", [100, -1, 50])
def test_on_a_map_without_free_cells_nothing_can_be_scattered(drive, cell):
    localizer = started()
    drive.through(localizer, last=3)
    localizer.set_map(GridMap(np.full((20, 20), cell, np.int8), 0.1, np.zeros(3)))
    refused(
        localizer, ValueError, "the map has no free cell to put particles on", lambda localizer: localizer.scatter()
    )
    localizer.set_map(MAPS[L_ROOM])
    assert drive.errors(drive.through(localizer, 3, 8))[:, 0].max() < 0.05  # it still knows where it was


@pytest.mark.parametrize("cell", [100, -1])
@pytest.mark.parametrize("start", ["placed", "placed vaguely", "searched for"])
def test_a_robot_on_a_map_without_room_goes_on_by_odometry(drive, cell, start):
    localizer = started()
    if start == "searched for":
        localizer.scatter()
    localizer.set_map(GridMap(np.full((200, 200), cell, np.int8), 0.05, np.array([-2.0, -2.0, 0.0])))
    if start == "placed vaguely":
        localizer.set_pose(drive.true[0], np.diag([4.0, 4.0, 1.0]))
    estimates = drive.through(localizer, last=20)
    assert all(np.all(np.isfinite(estimate.map_from_base)) for estimate in estimates)
    assert not any(estimate.state == "LOCALIZED" for estimate in estimates[5:])


def test_a_filter_that_is_given_up_leaves_the_memory_at_once(drive):
    localizer = started()
    drive.through(localizer, last=3)
    localizer.scatter()
    drive.through(localizer, last=3)
    gone = weakref.ref(localizer)
    gc.disable()  # a cycle of references would wait for it, with all that hangs on it
    try:
        del localizer
        assert gone() is None
    finally:
        gc.enable()


@pytest.mark.long_run
def test_a_search_goes_on_in_another_map():
    drive = Drive(GLASS_ROOM, seed=2, centre=(3.0, 1.6), glass_share=0.3)
    localizer = started(L_ROOM, drive.true[0])
    localizer.scatter()
    localizer.set_map(MAPS[GLASS_ROOM])
    assert drive.errors(drive.through(localizer))[-5:, 0].max() < 0.1


def test_on_a_map_without_walls_odometry_alone_leads():
    drive = Drive(way_share=0.0)
    empty = GridMap(np.zeros((100, 140), np.int8), 0.05, np.zeros(3))
    estimates = drive.through(started(grid_map=empty), last=10)
    assert drive.errors(estimates)[:, 0].max() < 0.3
    assert not any(estimate.cases.case.any() for estimate in estimates)


@pytest.mark.parametrize(
    "kind, values, text",
    [
        (Schedule, dict(update_min_d=-0.1), "~update_min_d must be >= 0, got -0.1"),
        (Schedule, dict(update_min_a=float("nan")), "~update_min_a must be >= 0, got nan"),
        (Schedule, dict(resample_interval=0), "~resample_interval must be >= 1, got 0"),
        (Schedule, dict(raycast_threads=0), "~raycast_threads must be >= 1, got 0"),
        (Schedule, dict(raycast_backend="gpu"), "~raycast_backend must be one of exact, mrpt, got 'gpu'"),
        (LaserLimits, dict(laser_min_range=float("nan")), "~laser_min_range must be finite, got nan"),
        (LaserLimits, dict(laser_max_range=float("inf")), "~laser_max_range must be finite, got inf"),
        (
            LaserLimits,
            dict(laser_max_range=0.0),
            "~laser_max_range must be above 0 and ~laser_min_range, or < 0 for the scan's own, got 0.0",
        ),
        (
            LaserLimits,
            dict(laser_min_range=3.0, laser_max_range=2.0),
            "~laser_max_range must be above 0 and ~laser_min_range, or < 0 for the scan's own, got 2.0",
        ),
    ],
)
def test_wrong_values_are_refused_in_one_line(kind, values, text):
    with pytest.raises(ValueError) as err:
        kind(**values)
    assert str(err.value) == text


@pytest.mark.long_run
@pytest.mark.parametrize("seed", range(3))
def test_one_absurd_scan_moves_nobody(seed):
    """A ring of 56 beams at 1.0 m all round in the midst of a good drive: the robot goes where odometry leads."""
    drive = Drive(seed=seed)
    drive.scans[15] = replace(drive.scans[15], ranges_m=np.full(56, 1.0), angles_rad=ALL_ROUND)
    way_m, turn_rad = drive.errors(drive.through(started(seed=seed))).T
    assert way_m.max() < 0.1 and turn_rad.max() < np.radians(5.0)


@pytest.mark.long_run
@pytest.mark.parametrize("seed", range(4))
def test_a_robot_that_knows_nothing_finds_itself(seed):
    drive = Drive(seed=seed, steps=20)
    localizer = Localizer(parameters(min_particles=2000, max_particles=5000), MAPS[L_ROOM], np.random.default_rng(seed))
    localizer.scatter()
    estimates = drive.through(localizer)
    assert estimates[-1].state == "LOCALIZED"
    way_m, turn_rad = drive.errors(estimates)[-1]
    assert way_m < 0.05 and turn_rad < np.radians(1.5)


@pytest.mark.long_run
@pytest.mark.parametrize("seed", range(2))
def test_a_covered_lidar_is_called_lost(seed):
    drive = Drive(seed=seed, steps=35)
    rng = np.random.default_rng(seed)
    for index in range(10, 35):
        drive.scans[index] = replace(drive.scans[index], ranges_m=rng.uniform(0.1, 0.5, 180))
    assert drive.through(started())[-1].state == "LOST"


@pytest.mark.long_run
def test_the_same_seed_gives_the_same_answer_to_the_last_bit(drive):
    """Not so where a cosine is taken of a strided column: numpy's result depends on where it lies in memory."""
    first = drive.through(started(seed=4))
    for _ in range(10):
        for one, other in zip(first, drive.through(started(seed=4))):
            np.testing.assert_array_equal(one.particles, other.particles)
            np.testing.assert_array_equal(one.map_from_base, other.map_from_base)


# -- bearings to landmarks, where there are some

TAGS = landmark_map.seen_from_all_sides("abcd", np.array([[0.0, 3.0], [6.0, 0.5], [3.0, 4.0], [1.0, 0.0]]), 15.0)


def tags_seen(pose, sigma_rad=0.005, base_from_sensor=(0.2, 0.0, 0.5)):
    sensor = se2.compose(pose, np.array(base_from_sensor))
    way = TAGS.positions_m - sensor[:2]
    return bearings.standing(
        TAGS.ids,
        angles.wrap(np.arctan2(way[:, 1], way[:, 0]) - sensor[2]),
        sigma_rad,
        base_from_sensor=np.array(base_from_sensor),
    )


def blind(scan):
    """The same scan of a lidar without an answer."""
    return replace(scan, ranges_m=np.full(len(scan.ranges_m), np.inf))


@pytest.mark.parametrize("seed", range(3))
def test_bearings_place_a_robot_that_sees_nothing_else(drive, seed):
    localizer = Localizer(parameters(max_particles=3000), MAPS[L_ROOM], np.random.default_rng(seed))
    localizer.set_pose(drive.true[0] + [0.4, -0.4, 0.2], np.diag([0.5, 0.5, 0.3]) ** 2)
    spread = np.sqrt(np.trace(localizer.update(blind(drive.scans[0]), drive.odometry[0]).covariance[:2, :2]))
    for scan, odom, true in list(zip(drive.scans, drive.odometry, drive.true))[1:5]:
        localizer.add_bearings(tags_seen(true), TAGS, odom)
        estimate = localizer.update(blind(scan), odom)
    way_m, turn_rad = off(estimate.map_from_base, true)
    assert way_m < 0.12 and turn_rad < 0.06
    assert np.sqrt(np.trace(estimate.covariance[:2, :2])) < 0.4 * spread


def test_bearings_are_carried_along_by_odometry_to_the_next_scan():
    exact = Drive(way_share=0.0)
    true, odom, step = exact.true[0], exact.odometry[0], np.array([0.8, 0.1, 0.5])
    later, moved = se2.compose(true, step), se2.compose(odom, step)
    localizer = Localizer(parameters(max_particles=3000), MAPS[L_ROOM], np.random.default_rng(0))
    localizer.set_pose(later + [0.3, -0.3, 0.1], np.diag([0.4, 0.4, 0.2]) ** 2)
    localizer.add_bearings(tags_seen(true), TAGS, odom)  # taken before the step
    estimate = localizer.update(blind(exact.scans[0]), moved)
    assert off(estimate.map_from_base, later)[0] < 0.2  # 0.42 before, and 0.8 if the step were left out


def test_bearings_make_a_standing_robot_update_once(drive):
    localizer = started()
    assert localizer.update(drive.scans[0], drive.odometry[0]).updated
    again = replace(drive.scans[0], stamp_ns=drive.scans[0].stamp_ns + 1)
    assert not localizer.update(again, drive.odometry[0]).updated
    localizer.add_bearings(tags_seen(drive.true[0]), TAGS, drive.odometry[0])
    assert localizer.update(again, drive.odometry[0]).updated
    assert not localizer.update(again, drive.odometry[0]).updated


def test_a_new_start_forgets_the_bearings_before_it(drive):
    localizer, fresh = started(seed=4), started(seed=4)
    localizer.add_bearings(tags_seen(drive.true[0] + [1.0, 0.0, 0.0]), TAGS, drive.odometry[0])
    for each in (localizer, fresh):
        each.set_pose(drive.true[0], START_COVARIANCE)
    same(localizer.update(drive.scans[0], drive.odometry[0]), fresh.update(drive.scans[0], drive.odometry[0]))


def test_bearings_agree_with_a_drive_and_one_wrong_does_no_harm(drive):
    localizer = started()
    for number, (scan, odom, true) in enumerate(zip(drive.scans, drive.odometry, drive.true)):
        if number % 5 == 4:
            taken = tags_seen(true)
            taken.angles_rad[1] += 1.0
            localizer.add_bearings(taken, TAGS, odom)
        assert off(localizer.update(scan, odom).map_from_base, true)[0] < 0.06


def test_bearings_end_a_search_among_places_that_look_alike():
    square = Building([(0, 0), (6, 0), (6, 6), (0, 6)])
    true, rng = np.array([2.0, 1.5, 0.4]), np.random.default_rng(0)
    localizer = Localizer(parameters(), square.grid_map(), np.random.default_rng(0))
    localizer.scatter()
    states = []
    for second in range(4):
        if second == 2:
            localizer.add_bearings(tags_seen(true), TAGS, np.zeros(3))
        estimate = localizer.update(square.scan(true, second * SECOND_NS, rng), np.zeros(3))
        states.append(estimate.state)
    assert states[:2] == ["GLOBAL_SEARCH"] * 2 and "GLOBAL_SEARCH" not in states[2:]
    assert off(estimate.map_from_base, true)[0] < 0.1


def test_bearings_that_cannot_be_used_are_refused_and_change_nothing(drive):
    localizer, other = started(seed=2), started(seed=2)
    with pytest.raises(UnknownLandmark, match="^landmark 'z' is not on the map"):
        localizer.add_bearings(bearings.standing(["z"], np.zeros(1), 0.1), TAGS, np.zeros(3))
    with pytest.raises(ValueError, match="^odometry of bearings must be finite x, y, yaw, got "):
        localizer.add_bearings(tags_seen(drive.true[0]), TAGS, np.array([0.0, np.nan, 0.0]))
    same(localizer.update(drive.scans[0], drive.odometry[0]), other.update(drive.scans[0], drive.odometry[0]))


# -- it keeps to odometry where scans say nothing


def test_where_the_map_lacks_what_is_around_the_robot_odometry_carries_the_pose():
    """A hall with a door to a place that is not drawn: beams end far from any wall, ever other ones."""
    drive = Drive(steps=14)
    localizer = started(update_min_d=0.05)
    drive.through(localizer)
    rng = np.random.default_rng(3)
    true, odom, last = drive.true[-1], drive.odometry[-1], drive.scans[-1]
    step = np.array([0.15, 0.0, 0.02])
    for number in range(1, 60):
        true, odom = se2.compose(true, step), se2.compose(odom, step)
        ranges_m = rng.uniform(3.0, 11.0, len(last))
        estimate = localizer.update(replace(last, stamp_ns=last.stamp_ns + number * SECOND_NS, ranges_m=ranges_m), odom)
        away_m, away_rad = off(estimate.map_from_base, true)
        assert away_m < 0.05 + 0.02 * 0.15 * number and away_rad < np.radians(3.0)
    assert estimate.state != "LOCALIZED"


def test_a_pose_that_scans_led_astray_goes_back_to_dead_reckoning_when_they_say_nothing():
    drive = Drive(steps=14)
    localizer = started(update_min_d=0.05)
    drive.through(localizer, last=12)
    localizer._filter.move_to(drive.true[11] + [0.6, 0.4, 0.8])
    outside = replace(drive.scans[12], ranges_m=np.full(len(drive.scans[12]), 9.0))
    estimate = localizer.update(outside, drive.odometry[12])
    away_m, away_rad = off(estimate.map_from_base, drive.true[12])
    assert away_m < 0.05 and away_rad < np.radians(2.0)


# -- glass that the map lacks


@pytest.fixture(scope="module")
def past_a_pane():
    """A localizer after a drive past a pane that its map lacks, with all scans and poses."""
    scans = list(made_pane_drive.scans(made_pane_drive.pane((2.0, 2.0), (8.0, 2.0))))
    localizer = started(grid_map=made_pane_drive.hall(), at=scans[0][1])
    for scan, pose in scans:
        localizer.update(scan, pose)
    return localizer, scans


@pytest.mark.long_run
def test_a_pane_that_the_map_lacks_is_found_and_is_glass(past_a_pane):
    localizer, _ = past_a_pane
    (pane,) = localizer.unmapped_panes
    np.testing.assert_allclose(np.array([pane.start_m, pane.end_m])[:, 1], 2.0, atol=0.1)
    assert pane.length_m > 3.0
    assert localizer.found_panes[0].probability >= 0.9
    grid_map = made_pane_drive.hall()
    row, column = grid_map.cells(np.array([4.0, 2.0]))
    assert localizer.glass_map.occupancy()[row - 1 : row + 2, column].max() > 80
    assert not grid_map.occupied[row - 1 : row + 2, column].any()


def test_what_a_run_found_the_next_one_knows_at_once_and_beams_end_at_it(past_a_pane):
    before, scans = past_a_pane
    scan, pose = scans[40]
    cut = []
    for remembers in (True, False):
        localizer = started(grid_map=made_pane_drive.hall(), at=pose)
        if remembers:
            localizer.remember(before.found_panes, before.glass_map.arrays())
            assert len(localizer.unmapped_panes) == 1
        cut.append(np.count_nonzero(localizer.update(scan, pose).surface_scan.cut))
    assert cut[0] > 100 and cut[1] == 0
    with pytest.raises(ValueError, match="a glass map needs cells"):
        localizer.remember((), {"glass_cell": np.zeros((2, 2))})
