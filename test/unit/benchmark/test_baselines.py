"""The localizers that ours is compared with do what their books say; else the comparison says nothing."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from glass_nav.geometry import angles, se2
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import GridMap

REPO = Path(__file__).resolve().parents[3]
sys.path.append(str(REPO / "test" / "benchmark"))

import baselines  # noqa: E402
from baselines import BeamModel, LikelihoodField, Settings  # noqa: E402

CELL_M = 0.05
BASE_FROM_LASER = np.array([0.1, -0.05, 0.3])
CORNERS_M = np.array([[0.0, 0.0], [6.0, 0.0], [6.0, 2.8], [4.6, 2.8], [4.6, 4.0], [0.0, 4.0]])


def wall_hits(map_from_laser, angles_rad):
    """Ranges (B,) to the lines between CORNERS_M."""
    ray = np.stack([np.cos(angles_rad + map_from_laser[2]), np.sin(angles_rad + map_from_laser[2])], -1)[:, None]
    line, to_line = np.roll(CORNERS_M, -1, axis=0) - CORNERS_M, CORNERS_M - map_from_laser[:2]
    with np.errstate(divide="ignore", invalid="ignore"):
        cross = ray[..., 0] * line[:, 1] - ray[..., 1] * line[:, 0]
        along_ray = (to_line[:, 0] * line[:, 1] - to_line[:, 1] * line[:, 0]) / cross
        along_line = (to_line[:, 0] * ray[..., 1] - to_line[:, 1] * ray[..., 0]) / cross
        met = (along_ray > 0.0) & (along_line >= -1e-9) & (along_line <= 1.0 + 1e-9)
    return np.where(met, along_ray, np.inf).min(axis=1)


def room_map(yaw=0.0):
    """The lines as one cell around each, on a grid that is turned in the map."""
    cells = np.rint(CORNERS_M / CELL_M).astype(int) + 10
    occupancy = np.zeros((101, 141), np.int8)
    for (x0, y0), (x1, y1) in zip(cells, np.roll(cells, -1, axis=0)):
        occupancy[min(y0, y1) : max(y0, y1) + 1, min(x0, x1) : max(x0, x1) + 1] = 100
    return GridMap(occupancy, CELL_M, se2.compose([0.0, 0.0, yaw], [-10.5 * CELL_M, -10.5 * CELL_M, 0.0]))


def scan_at(map_from_base, beams=90, noise_m=0.0, rng=None, stamp_ns=0):
    angles_rad = np.linspace(-np.pi, np.pi, beams, endpoint=False)
    ranges_m = wall_hits(se2.compose(map_from_base, BASE_FROM_LASER), angles_rad)
    if rng is not None:
        ranges_m = ranges_m + noise_m * rng.standard_normal(beams)
    return Scan(stamp_ns, ranges_m, angles_rad, 0.05, 12.0, BASE_FROM_LASER)


def distance_to_lines(points_m):
    line = np.roll(CORNERS_M, -1, axis=0) - CORNERS_M
    offset = points_m[:, None] - CORNERS_M
    share = np.clip((offset * line).sum(-1) / (line * line).sum(-1), 0.0, 1.0)
    return np.linalg.norm(offset - share[..., None] * line, axis=-1).min(axis=1)


@pytest.mark.parametrize("yaw", [0.0, 0.7])
def test_the_likelihood_field_is_the_distance_to_the_lines_of_the_walls(yaw):
    settings = Settings(sigma_hit_m=0.2, z_hit=0.9, z_rand=0.1, max_beams=None)
    pose, turned = np.array([2.3, 1.4, 0.4]), np.array([0.0, 0.0, yaw])
    poses = pose + np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.0, -0.2, 0.2]])
    scan = scan_at(pose)
    expected = [
        np.log(
            0.9 * np.exp(-0.5 * (distance_to_lines(se2.transform_points(each, scan.points_in_base())) / 0.2) ** 2)
            + 0.1 / 12.0
        ).sum()
        for each in poses
    ]
    found = LikelihoodField(room_map(yaw), settings).log_weights(se2.compose(turned, poses), scan)
    np.testing.assert_allclose(found, expected, rtol=0.02, atol=1.5)  # tabulated on quarters of cells; 90 beams
    assert found.argmax() == 0


def test_the_beam_model_is_the_mixture_of_the_book():
    settings = Settings(sigma_hit_m=0.1, z_hit=0.7, z_rand=0.2, max_beams=None, z_short=0.1, lambda_short=0.5)
    pose = np.array([2.3, 1.4, 0.4])
    scan = scan_at(pose, beams=30)
    scan.ranges_m[3:6] = [np.inf, np.nan, -np.inf]  # no answers: the same for all particles
    scan.ranges_m[8] = 0.4  # somebody stands there
    poses = np.array([pose, pose + [0.2, 0.1, 0.0]])
    expected = []
    for each in poses:
        true = wall_hits(se2.compose(each, BASE_FROM_LASER), scan.angles_rad)
        total = 0.0
        for z, there in zip(scan.ranges_m, true):
            if np.isfinite(z):
                p = 0.7 * np.exp(-0.5 * min((z - there) ** 2 / 0.01, 100.0)) / (0.1 * np.sqrt(2 * np.pi)) + 0.2 / 12.0
                if z < there:
                    p += 0.1 * 0.5 * np.exp(-0.5 * z) / (1.0 - np.exp(-0.5 * there))
                total += np.log(p)
        expected.append(total)
    found = BeamModel(room_map(), settings).log_weights(poses, scan)
    # Half a cell of grazing beams; "short" jumps where z meets the wall.
    np.testing.assert_allclose(found, expected, rtol=0.1, atol=4.0)
    assert found[0] > found[1] + 10.0


def test_many_beams_count_as_independent_ones():
    scan, pose = scan_at(np.array([2.3, 1.4, 0.4])), np.array([[2.4, 1.4, 0.4]])
    whole = Settings(0.1, 0.95, 0.05, max_beams=None)
    thinned = whole._replace(independent_beams=30.0)
    np.testing.assert_allclose(
        LikelihoodField(room_map(), thinned).log_weights(pose, scan),
        LikelihoodField(room_map(), whole).log_weights(pose, scan) / 3.0,
    )
    assert len(baselines.chosen_beams(scan, whole._replace(max_beams=7))) == 7


@pytest.mark.long_run
@pytest.mark.parametrize("name", baselines.LOCALIZERS)
def test_every_localizer_follows_a_robot_through_a_room_and_repeats_itself(name):
    rng = np.random.default_rng(3)
    at = 0.16 * np.arange(14)
    true = np.stack(
        [2.6 + 1.2 * np.cos(at), 1.6 + 0.7 * np.sin(at), np.arctan2(0.7 * np.cos(at), -1.2 * np.sin(at))], -1
    )
    scans = [scan_at(pose, 180, 0.01, rng, 10**9 * index) for index, pose in enumerate(true)]
    ways = []
    for _ in range(2):
        localizer = baselines.localizer(name, LocalizerParams(), room_map(), seed=4)
        localizer.set_pose(true[0] + [0.1, -0.1, 0.05], np.diag([0.1, 0.1, 0.05]) ** 2)
        localizer.true_case = np.ones(180, np.uint8)
        ways.append([localizer.update(scan, pose).map_from_base for scan, pose in zip(scans, true)])
    np.testing.assert_array_equal(ways[0], ways[1])
    off = ways[0] - true
    assert np.hypot(off[5:, 0], off[5:, 1]).max() < 0.06
    assert np.abs(angles.wrap(off[5:, 2])).max() < np.radians(2.0)


def test_plain_localization_moves_on_by_odometry_between_updates():
    pose = np.array([2.3, 1.4, 0.4])
    localizer = baselines.localizer("amcl_field60", LocalizerParams(), room_map(), seed=1)
    localizer.set_pose(pose, np.diag([0.05, 0.05, 0.02]) ** 2)
    first = localizer.update(scan_at(pose), np.zeros(3)).map_from_base
    step = np.array([0.05, 0.0, 0.02])  # below the thresholds
    np.testing.assert_allclose(localizer.update(scan_at(pose), step).map_from_base, se2.compose(first, step))
    localizer.request_update()
    assert np.any(localizer.update(scan_at(pose), step).map_from_base != se2.compose(first, step))
