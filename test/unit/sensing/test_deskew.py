"""A scan measured on the move, seen from one place: against rays cut with walls, and by definition."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.geometry import se2
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.sensing import deskew
from glass_nav.sensing.scan import Scan, scan_from_fields

STAMP_NS = 1_000_000_000_000
BEAMS = 181
ANGLES_RAD = np.linspace(-1.5, 1.5, BEAMS)
SWEEP_NS = 50_000_000
STEP_S = SWEEP_NS * 1e-9 / (BEAMS - 1)
WALL_X_M = 3.0


def drive(velocity: np.ndarray) -> Trajectory:
    """odom_from_base of a robot that keeps its velocity, on an arc of small steps."""
    stamps_ns = STAMP_NS + np.arange(0, SWEEP_NS + 1, 1_000_000)
    poses = [np.array([0.2, -0.1, 0.4])]
    for _ in stamps_ns[1:]:
        poses.append(se2.compose(poses[-1], velocity * 1e-3))
    return Trajectory(stamps_ns, np.array(poses))


def measured(track: Trajectory, base_from_laser: np.ndarray, upside_down: bool = False) -> "tuple[Scan, np.ndarray]":
    """A scan of a wall along y at x = 3 m of odom, each beam from where the laser is then; and the ends (B, 2)."""
    angles_rad = -ANGLES_RAD if upside_down else ANGLES_RAD
    stamps_ns = STAMP_NS + np.rint(np.arange(BEAMS) * STEP_S * 1e9).astype(np.int64)
    lasers = se2.compose(track.at(stamps_ns), base_from_laser)
    direction = np.stack([np.cos(lasers[:, 2] + angles_rad), np.sin(lasers[:, 2] + angles_rad)], axis=-1)
    with np.errstate(divide="ignore"):
        ranges_m = (WALL_X_M - lasers[:, 0]) / direction[:, 0]
    ranges_m[(direction[:, 0] <= 0.0) | (ranges_m > 10.0)] = np.inf
    scan = scan_from_fields(
        STAMP_NS,
        ranges_m,
        ANGLES_RAD[0],
        ANGLES_RAD[1] - ANGLES_RAD[0],
        0.05,
        10.0,
        base_from_laser,
        upside_down,
        time_increment_s=STEP_S,
    )
    return scan, lasers[:, :2] + np.where(np.isfinite(ranges_m), ranges_m, np.nan)[:, None] * direction


@pytest.mark.parametrize("velocity", [(1.0, 0.0, 0.0), (0.0, 0.0, 2.0), (0.8, 0.3, -1.5)], ids=str)
@pytest.mark.parametrize("laser, upside_down", [((0.2, 0.1, 0.3), False), ((-0.1, 0.0, -2.0), True)])
def test_ends_of_beams_are_where_they_were_in_the_room(velocity, laser, upside_down):
    track = drive(np.array(velocity))
    scan, ends = measured(track, np.array(laser), upside_down)
    seen = deskew.deskewed(scan, track)
    points = se2.transform_points(track.at(np.int64(STAMP_NS)), seen.points_in_base())
    np.testing.assert_allclose(points, ends, atol=1e-6)
    raw = se2.transform_points(track.at(np.int64(STAMP_NS)), scan.points_in_base())
    assert np.nanmax(np.abs(raw - ends)) > 0.01  # there was something to make up for


def test_beams_without_an_answer_turn_with_the_lidar_and_stay_as_they_are():
    track = drive(np.array([0.0, 0.0, 2.0]))
    scan, _ = measured(track, np.zeros(3))
    seen = deskew.deskewed(scan, track)
    lost = ~scan.answered
    assert lost.any() and np.array_equal(seen.answered, scan.answered)
    np.testing.assert_array_equal(seen.ranges_m[lost], scan.ranges_m[lost])
    np.testing.assert_allclose(seen.angles_rad[lost], ANGLES_RAD[lost] + 2.0 * STEP_S * np.flatnonzero(lost), atol=1e-6)


def test_a_range_on_a_beam_is_told_from_where_the_beam_began():
    track = drive(np.array([1.0, 0.2, 1.0]))
    scan, _ = measured(track, np.array([0.2, 0.1, 0.3]))
    seen = deskew.deskewed(scan, track)
    np.testing.assert_allclose(seen.as_measured(seen.ranges_m), scan.ranges_m, atol=1e-9)
    assert np.array_equal(scan.as_measured(scan.ranges_m), scan.ranges_m)  # nothing to tell apart


def test_a_robot_that_stands_has_nothing_to_make_up_for():
    track = drive(np.zeros(3))
    scan, _ = measured(track, np.array([0.2, 0.1, 0.3]))
    seen = deskew.deskewed(scan, track)
    np.testing.assert_allclose(seen.ranges_m, scan.ranges_m, atol=1e-12)
    np.testing.assert_allclose(seen.angles_rad, scan.angles_rad, atol=1e-12)


@pytest.mark.parametrize(
    "beams, step_s, expected_ns",
    [(181, 0.0005, 90_000_000), (1, 0.1, 0), (181, 0.0, 0), (181, -0.001, 0), (181, np.nan, 0), (181, 1.0, 0)],
)
def test_a_sweep_takes_its_steps(beams, step_s, expected_ns):
    assert deskew.sweep_ns(beams, step_s) == expected_ns


@pytest.mark.parametrize(
    "step_s, scan_time_s, text",
    [
        (0.0, 0.1, None),
        (0.0005, 0.1, None),
        (0.0005, 0.0, None),
        (0.0005, 0.07, None),
        (-0.001, 0.1, "time_increment must be finite and >= 0 s, got -0.001"),
        (np.inf, 0.1, "time_increment must be finite and >= 0 s, got inf"),
        (0.5, 0.1, "time_increment 0.5 s times 181 beams is 90 s, allowed 0.15 s"),
        (0.01, 0.0, "time_increment 0.01 s times 181 beams is 1.8 s, allowed 1 s"),
    ],
)
def test_a_time_that_cannot_be_true_is_reported(step_s, scan_time_s, text):
    assert deskew.fault(181, step_s, scan_time_s) == text


@pytest.mark.parametrize("sweep_ns, knots", [(1, 2), (10_000_000, 2), (10_000_001, 3), (50_000_000, 6)])
def test_odometry_is_looked_up_from_the_first_beam_to_the_last(sweep_ns, knots):
    stamps_ns = deskew.knots_ns(STAMP_NS, sweep_ns)
    assert len(stamps_ns) == knots
    assert (stamps_ns[0], stamps_ns[-1]) == (STAMP_NS, STAMP_NS + sweep_ns)
    assert np.diff(stamps_ns).max() <= deskew.KNOT_S * 1e9
