"""The comparison with MRPT's pf-localization asks it the right thing and judges its answer as it judges ours."""

from __future__ import annotations

import configparser
import sys
from pathlib import Path

import numpy as np
import pytest

from glass_nav.geometry import se2
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.recording.log_file import open_log
from glass_nav.recording.recording import LogOptions, Refusal
from glass_nav.sensing.scan import Scan
from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap

REPO = Path(__file__).resolve().parents[3]
sys.path.append(str(REPO / "test" / "benchmark"))

import pf_localization  # noqa: E402
from pf_localization import Step, found_after  # noqa: E402
from tracks import Moment, Track  # noqa: E402

OCCUPANCY = np.array([[0, 100, -1], [0, 0, 40]], np.int8)
BASE_FROM_LASER = np.array([0.2, -0.1, 0.3])


def a_map():
    return GridMap(OCCUPANCY, 0.05, np.array([-3.0, 7.0, 0.4]))


def a_scan(ranges_m, angles_rad, second=0.0, lidar=""):
    return Scan(int(second * 1e9), np.array(ranges_m), np.array(angles_rad), 0.1, 20.0, BASE_FROM_LASER, lidar=lidar)


def a_track(odom_x_m, lidars=("",)):
    """A robot that drives ahead, a scan of each lidar at each place."""
    poses = [np.array([x, 0.0, 0.0]) for x in odom_x_m]
    moments = [
        Moment(a_scan([1.0, 2.0], [0.0, 0.1], second, lidar), pose, pose)
        for second, pose in enumerate(poses)
        for lidar in lidars
    ]
    return Track("ahead", a_map(), moments)


def test_the_place_is_found_where_it_is_right_first_and_for_three_metres():
    way_m = np.arange(8.0)
    assert found_after(way_m, np.array([0, 1, 0, 1, 1, 1, 1, 0], bool)) == 3.0
    assert found_after(way_m, np.ones(8, bool)) == 0.0


def test_a_place_that_is_right_for_less_than_three_metres_is_found_only_if_the_track_ends_there():
    way_m = np.arange(8.0)
    assert found_after(way_m, np.array([0, 1, 1, 1, 0, 0, 0, 0], bool)) is None
    assert found_after(way_m, np.array([0, 0, 0, 0, 0, 0, 1, 1], bool)) == 6.0
    assert found_after(way_m, np.zeros(8, bool)) is None
    assert found_after(np.zeros(0), np.zeros(0, bool)) is None


def test_the_means_are_read_from_what_the_program_prints():
    log = (
        "[17:50:22.1453|INFO |App] Odometry estimation: (8.978,8.988,54.86deg)\n"
        "[17:50:22.1453|INFO |App] PDF estimation: (0.347,-10.295,-90.00deg), ESS (B.R.)= 0 tr(cov): 5.86461\n"
        "[17:50:22.1453|INFO |App] PDF estimation: (-nan,1e-3,nandeg), ESS (B.R.)= 0 tr(cov): nan\n"
    )
    np.testing.assert_allclose(pf_localization.means_in(log), [[0.347, -10.295, -np.pi / 2.0], [np.nan, 0.001, np.nan]])
    assert pf_localization.means_in("").shape == (0, 3)


def test_the_config_puts_particles_anywhere_on_the_map_and_opens_no_window(tmp_path):
    settings = pf_localization.settings_with({"LF_decimation": "5"})
    config = configparser.ConfigParser()
    config.read_string(pf_localization.config_text(tmp_path, a_map(), settings))
    experiment = config["LocalizationExperiment"]
    assert [
        float(experiment[f"init_PDF_{name}"]) for name in ("mode", "min_x", "max_x", "min_y", "max_y")
    ] == pytest.approx([0.0, 0.0, 0.15, 0.0, 0.1])
    assert experiment["map_file"] == str(tmp_path / "map.gridmap.gz")
    assert experiment["rawlog_file"] == str(tmp_path / "track.rawlog")
    assert (experiment["SHOW_PROGRESS_3D_REAL_TIME"], experiment["3DSceneFrequency"]) == ("0", "-1")
    assert config["PF_options"]["adaptiveSampleSize"] == "1"
    assert config["KLD_options"]["KLD_maxSampleSize"] == experiment["particles_count"]
    assert config["MetricMap_occupancyGrid_00_likelihoodOpts"]["LF_decimation"] == "5"
    assert pf_localization.SETTINGS["MetricMap_occupancyGrid_00_likelihoodOpts"]["LF_decimation"] == "20"


def test_a_setting_that_there_is_not_is_refused():
    with pytest.raises(ValueError, match="no setting 'LF_sigma' here, it has .*LF_stdHit"):
        pf_localization.changes_from(["LF_sigma=3"])


def test_a_scan_is_taken_after_each_bit_of_way_and_of_every_lidar():
    step_m = LocalizerParams().schedule.update_min_d
    track = a_track(np.array([0.0, 0.6, 1.1, 1.2, 2.2]) * step_m)
    assert [round(step.way_m / step_m, 6) for step in pf_localization.steps_of(track, 0)] == [0.0, 1.1, 2.2]
    assert [round(step.way_m / step_m, 6) for step in pf_localization.steps_of(track, 1)] == [0.0, 1.6]
    both = pf_localization.steps_of(a_track(np.array([0.0, 0.6, 1.1]) * step_m, ("front", "rear")), 0)
    assert [step.moment.scan.lidar for step in both] == ["front", "rear", "front", "rear"]


def test_a_scan_of_uneven_beams_is_refused():
    with pytest.raises(ValueError, match=r"scan at 2\.000 s: MRPT wants evenly spaced beams"):
        pf_localization.scan_numbers(a_scan([1.0, 1.0, 1.0], [0.0, 0.1, 0.3], 2.0), np.zeros(3))


def test_what_the_writer_writes_is_the_map_and_the_track(tmp_path):
    odom_from_base = np.array([[5.0, -2.0, 3.0], [5.5, -2.0, -3.0]])
    leftwards, rightwards = [-0.5, 0.25, 1.0], [3.0, 2.5, 2.0]
    scans = [a_scan([1.0, np.inf, 2.5], leftwards, 10.0), a_scan([4.0, 3.0, np.nan], rightwards, 11.0)]
    steps = [Step(0.0, Moment(scan, pose, pose)) for scan, pose in zip(scans, odom_from_base)]
    pf_localization.write(tmp_path, a_map(), steps, pf_localization.SETTINGS)
    grid_map = map_file.load(tmp_path / "map.gridmap.gz")
    for of_map in (lambda grid: grid.free, lambda grid: grid.occupied):
        np.testing.assert_array_equal(of_map(grid_map), of_map(a_map()))
    np.testing.assert_allclose(grid_map.map_from_grid, 0.0, atol=1e-6)
    assert grid_map.resolution_m == pytest.approx(0.05)
    entries = [entry for entry in open_log(tmp_path / "track.rawlog", LogOptions()) if not isinstance(entry, Refusal)]
    assert len(entries) == 2
    for entry, scan, pose in zip(entries, scans, odom_from_base):
        np.testing.assert_allclose(entry.odom_from_base, pose, atol=1e-6)
        assert entry.scan.stamp_ns == scan.stamp_ns
        np.testing.assert_array_equal(entry.scan.answered, scan.answered)
        np.testing.assert_allclose(entry.scan.points_in_base(), scan.points_in_base(), atol=1e-5)
    base_from_middle = se2.compose(BASE_FROM_LASER, [0.0, 0.0, 0.25])
    np.testing.assert_allclose(entries[0].scan.base_from_laser, base_from_middle, atol=1e-6)
