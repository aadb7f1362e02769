"""Against the truth of a simulated drive."""

from __future__ import annotations

import made_buildings
import numpy as np
import pytest
from made_buildings import scan_at, t_corridor

from glass_nav.driving.edge_tracking.local_map import LocalMap, LocalMapParams
from glass_nav.driving.edge_tracking.local_pose import LocalPose
from glass_nav.geometry import angles, se2
from glass_nav.sensing.scan import Scan


def drive():
    """Poses (S, 3) of a slightly winding way along the T, and odometry's (S, 3), which errs more and more."""
    s = np.arange(0.0, 8.0, 0.1)
    true = np.column_stack([1.5 + s, 1.0 + 0.1 * np.sin(s), 0.1 * np.cos(s)])
    steps = se2.compose(se2.inverse(true[:-1]), true[1:])
    wrong = steps * [1.03, 1.0, 1.0] + [0.0, 0.0, 0.003]
    odometry = [true[0]]
    for step in wrong:
        odometry.append(se2.compose(odometry[-1], step))
    return true, np.array(odometry)


def driven(correct):
    """Poses (S, 3) that were believed in, and the walls of the map made with them."""
    building, rng, at = t_corridor(), np.random.default_rng(1), LocalPose()
    local = LocalMap(LocalMapParams(window_m=16.0))
    true, odometry = drive()
    believed = []
    for index, (pose, odom_from_base) in enumerate(zip(true, odometry)):
        scan = scan_at(building, pose, rng)
        believed.append(at.correct(scan, odom_from_base) if correct else odom_from_base)
        local.add(scan, believed[-1])
        if index % 3 == 2:
            at.know(local.walls())
    return np.array(believed), local.walls(), at, true, odometry


@pytest.mark.long_run
def test_walls_stay_thin_and_the_way_true_though_odometry_errs():
    believed, walls, at, true, odometry = driven(correct=True)
    off_m = np.hypot(*(believed - true)[:, :2].T)
    off_rad = np.abs(angles.wrap(believed[:, 2] - true[:, 2]))
    assert np.hypot(*(odometry[-1] - true[-1])[:2]) > 0.5  # without correction
    assert off_m.max() < 0.3 and off_rad.max() < 0.03
    np.testing.assert_allclose(at.now(odometry[-1]), believed[-1])
    blurred = driven(correct=False)[1]
    assert walls.occupied.sum() < 0.75 * blurred.occupied.sum()
    rows, columns = np.nonzero(walls.occupied)
    y = walls.centres(rows, columns)
    across = y[(y[:, 0] > 2.0) & (y[:, 0] < 10.0) & (y[:, 1] > 1.0)]  # the long wall, at y = 2
    assert np.percentile(np.abs(across[:, 1] - made_buildings.W), 90) < 0.15


def known(corners=((-3.0, -2.0), (3.0, 2.0))):
    """A pose that knows a room, the room, and what scans of it need."""
    (left, bottom), (right, top) = corners
    room = made_buildings.walled(np.array([[left, bottom], [right, bottom], [right, top], [left, top]]))
    rng, local, at = np.random.default_rng(0), LocalMap(LocalMapParams(window_m=8.0)), LocalPose()
    for _ in range(4):
        local.add(scan_at(room, (0.0, 0.0, 0.0), rng), np.zeros(3))
    at.know(local.walls())
    return at, room, rng


def test_scans_slide_to_where_they_were_seen_each_a_little():
    at, room, rng = known()
    truth, off_m = np.array([0.1, -0.07, 0.03]), [float(np.hypot(0.1, 0.07))]
    for _ in range(12):
        corrected = at.correct(scan_at(room, truth, rng), np.zeros(3))
        off_m.append(float(np.hypot(*(corrected - truth)[:2])))
    assert off_m[-1] < 0.04 and abs(corrected[2] - truth[2]) < 0.01
    assert max(later - earlier for earlier, later in zip(off_m, off_m[1:])) < 0.015
    np.testing.assert_allclose(at.local_from_odom, corrected)
    at.clear()
    np.testing.assert_allclose(at.correct(scan_at(room, truth, rng), truth), truth)  # it knows no walls any more
    np.testing.assert_array_equal(at.local_from_odom, np.zeros(3))


def test_without_walls_or_beams_odometry_is_believed():
    at, room, rng = known()
    odometry = np.array([0.1, 0.0, 0.0])
    few = Scan(0, np.array([1.0, 2.0, np.nan, np.inf]), np.linspace(-1, 1, 4), 0.1, 25.0, np.zeros(3))
    np.testing.assert_allclose(at.correct(few, odometry), odometry)
    strange = made_buildings.walled(np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]))
    np.testing.assert_allclose(at.correct(scan_at(strange, (0, 0, 0), rng), odometry), odometry)
    empty = LocalMap(LocalMapParams(window_m=8.0)).walls()
    at.know(empty)
    np.testing.assert_allclose(at.correct(scan_at(room, (0, 0, 0), rng), odometry), odometry)


@pytest.mark.parametrize("off_m", [0.05, 0.15, 0.25, 0.29])
def test_no_scan_moves_the_robot_to_another_place_at_once(off_m):
    at, room, rng = known(((-1.5, -1.2), (1.5, 1.2)))
    for bearing in np.linspace(0.0, 6.0, 9):
        at.local_from_odom = np.zeros(3)
        truth = np.array([off_m * np.cos(bearing), off_m * np.sin(bearing), 0.0])
        assert np.hypot(*at.correct(scan_at(room, truth, rng), np.zeros(3))[:2]) <= 0.15
