"""A lidar that takes its beams one after the other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from glass_nav.geometry import se2
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.sensing import deskew
from glass_nav.sensing.raycast import RayCaster
from glass_nav.simulation import building_file, building_map, lidar, shipped_buildings, turning
from glass_nav.simulation.simulation import START_NS, Simulation

TURN_NS = 40_000_000
QUIET = replace(lidar.preset("sensitive"), noise_m=0.0, dropout=0.0, dirty_share=0.0, beams=181)


@pytest.fixture(scope="module")
def office():
    return building_file.load(shipped_buildings.find("opaque_office"))


def still(pose: np.ndarray) -> Trajectory:
    return Trajectory(np.array([START_NS, START_NS + TURN_NS]), np.array([pose, pose]))


def test_who_stands_sees_what_a_lidar_of_one_moment_sees(office):
    turned = turning.scan(QUIET, office, still(office.start), TURN_NS, START_NS, np.random.default_rng(0))
    at_once = lidar.scan(QUIET, office, office.start, 0.0, np.random.default_rng(0))
    with np.errstate(invalid="ignore"):
        same = (np.abs(turned.ranges_m - at_once.ranges_m) < 1e-6) | (turned.ranges_m == at_once.ranges_m)
    assert np.mean(same) > 0.97  # people walk on meanwhile
    np.testing.assert_array_equal(turned.case[same], at_once.case[same])


def test_a_robot_that_turns_sees_each_beam_later_than_the_one_before(office):
    pose, rate_rad_s = office.start, 1.5
    track = Trajectory(
        np.array([START_NS, START_NS + TURN_NS]), np.array([pose, pose + [0.0, 0.0, rate_rad_s * TURN_NS * 1e-9]])
    )
    turned = turning.scan(QUIET, office, track, TURN_NS, START_NS, np.random.default_rng(0))
    for beam in (0, 45, 90, 135, 180):
        late = pose + np.array([0.0, 0.0, rate_rad_s * TURN_NS * 1e-9 * beam / 180])
        alone = lidar.scan(QUIET, office, late, 0.0, np.random.default_rng(0)).ranges_m[beam]
        assert turned.ranges_m[beam] == pytest.approx(alone, abs=0.05)  # a sector is of one moment


@pytest.mark.long_run
def test_a_frame_is_of_its_first_beam_and_odometry_deskews_it(office):
    simulation = Simulation(office, QUIET, seed=1, turn_time_s=0.08)
    frames = [simulation.look(), *(simulation.step(0.1, np.array([0.3, 0.0, 1.0])) for _ in range(15))]
    readings = {sample.stamp_ns: sample.odom_from_base for frame in frames for sample in frame.odometry}
    odometry = Trajectory(np.array(sorted(readings)), np.array([readings[stamp_ns] for stamp_ns in sorted(readings)]))
    caster, off_m = RayCaster(building_map.draw(office, 0.02)), []
    for frame in frames[1:]:
        assert frame.scan.time_increment_s == pytest.approx(0.08 / 180)
        assert frame.odometry[-1].stamp_ns - frame.stamp_ns == 80_000_000
        np.testing.assert_allclose(frame.odom_from_base, odometry.at(np.int64(frame.stamp_ns)), atol=1e-9)
        scans = deskew.deskewed(frame.scan, odometry), frame.scan
        map_from_laser = se2.compose(frame.map_from_base, frame.scan.base_from_laser)
        off_m.append(
            [
                np.nanmean(
                    np.minimum(
                        np.abs(
                            np.where(scan.answered, scan.ranges_m, np.nan)
                            - caster.cast(map_from_laser[None], scan.angles_rad, 25.0)[0]
                        ),
                        0.5,
                    )
                )
                for scan in scans
            ]
        )
    straight_m, raw_m = np.mean(off_m[5:], axis=0)
    assert straight_m < 0.5 * raw_m
    assert frames[0].scan.time_increment_s == 0.0  # there was no time for a turn before


@pytest.mark.parametrize("turn_time_s", [-0.1, 0.2, np.nan])
def test_a_turn_longer_than_its_period_is_refused(office, turn_time_s):
    with pytest.raises(ValueError, match="must take >= 0 s and no longer than the scan period of 0.1 s, got"):
        Simulation(office, QUIET, turn_time_s=turn_time_s)
