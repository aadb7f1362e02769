"""Relative and aligned errors: by hand, and against evo on three logs."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.evaluation.metrics import pose_errors, relative_errors
from glass_nav.geometry import angles, se2
from glass_nav.geometry.trajectory import Trajectory

PERIOD_NS = 100_000_000


def stamps(count):
    return 10**18 + PERIOD_NS * np.arange(count)


def log(seed, count=300, speed_m_s=0.8):
    """A drive with stops and turns, and an estimate that drifts, jumps and is turned."""
    rng = np.random.default_rng(seed)
    drives = rng.random(count) > 0.15
    yaw = np.cumsum(0.3 * rng.normal(size=count) * drives)
    steps = 0.1 * speed_m_s * drives[:, None] * np.stack([np.cos(yaw), np.sin(yaw)], axis=1)
    true = np.column_stack([np.cumsum(steps, axis=0), angles.wrap(yaw)])
    wrong = true + rng.normal(0.0, [0.03, 0.03, 0.01], (count, 3))
    wrong[count // 2 :] += [0.4, -0.2, 0.05]
    return true, se2.compose(np.array([0.3, -0.1, 0.02]), wrong)


def test_a_drift_of_two_percent_is_two_centimetres_over_a_metre():
    x = np.linspace(0.0, 10.0, 201)
    true, estimates = (np.column_stack([x * gain, 0 * x, 0 * x]) for gain in (1.0, 1.02))
    figures = relative_errors.summary(stamps(201), estimates, Trajectory(stamps(201), true))
    assert figures["relative_1m_rmse_m"] == pytest.approx(0.02 * 20 / 20.0, abs=1.1e-3)  # 1 m of the estimated path
    assert figures["relative_1s_rmse_m"] == pytest.approx(0.02 * 0.5)  # 0.5 m/s
    assert figures["relative_1m_yaw_rmse_deg"] == pytest.approx(0.0, abs=1e-9)


def test_a_constant_offset_is_no_relative_error_and_goes_with_the_alignment():
    true, _ = log(1)
    estimates = se2.compose(np.array([2.0, 1.0, 0.7]), true)
    figures = relative_errors.summary(stamps(300), estimates, Trajectory(stamps(300), true))
    assert max(figures.values()) < 1e-9
    assert (
        pose_errors.summary(pose_errors.of(stamps(300), estimates, Trajectory(stamps(300), true)))["position_rmse_m"]
        > 1
    )


@pytest.mark.parametrize("reference", [None, Trajectory(np.zeros(0, np.int64), np.zeros((0, 3)))])
def test_without_a_reference_there_are_no_figures(reference):
    assert set(relative_errors.summary(stamps(5), np.zeros((5, 3)), reference).values()) == {None}


def test_a_robot_that_stands_has_no_error_over_a_distance():
    figures = relative_errors.summary(stamps(50), np.zeros((50, 3)), Trajectory(stamps(50), np.zeros((50, 3))))
    assert figures["relative_1m_rmse_m"] is None and figures["relative_1s_rmse_m"] == 0.0


def test_a_pose_that_is_not_finite_is_left_out():
    true, estimates = log(2)
    estimates[7] = np.nan
    figures = relative_errors.summary(stamps(300), estimates, Trajectory(stamps(300), true))
    assert all(np.isfinite(value) for value in figures.values())


@pytest.mark.parametrize("seed", range(20))
def test_pairs_are_the_nearest_ones_by_trying_all(seed):
    _, estimates = log(seed, count=80)
    path = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(estimates[:, :2], axis=0), axis=1))])
    wanted = []
    for i in range(len(path) - 1):
        off = np.abs(path[i + 1 :] - path[i] - 1.0)
        if off.min() <= 0.1:
            wanted.append((i, i + 1 + int(off.argmin())))
    assert list(zip(*map(np.ndarray.tolist, relative_errors.pairs_by_distance(estimates, 1.0)))) == wanted


# -- evo


def evo_trajectory(stamps_ns, poses):
    trajectory = pytest.importorskip(
        "evo.core.trajectory", reason="evo is not installed here: pip install --no-deps evo"
    )
    return trajectory.PoseTrajectory3D(
        positions_xyz=np.column_stack([poses[:, :2], np.zeros(len(poses))]),
        orientations_quat_wxyz=np.column_stack(
            [np.cos(poses[:, 2] / 2), np.zeros((len(poses), 2)), np.sin(poses[:, 2] / 2)]
        ),
        timestamps=stamps_ns * 1e-9,
    )


@pytest.mark.parametrize("seed", [11, 12, 13])
@pytest.mark.parametrize("is_aligned", [False, True], ids=["as it is", "aligned"])
def test_absolute_and_relative_errors_are_evos(seed, is_aligned):
    true, estimates = log(seed, speed_m_s=0.4 + 0.2 * (seed - 10))
    ours = {
        **pose_errors.summary(pose_errors.of(stamps(300), estimates, Trajectory(stamps(300), true))),
        **relative_errors.summary(stamps(300), estimates, Trajectory(stamps(300), true)),
    }
    pair = evo_trajectory(stamps(300), true), evo_trajectory(stamps(300), estimates)
    from evo.core.metrics import APE, RPE, PoseRelation, StatisticsType, Unit

    if is_aligned:
        pair[1].align(pair[0])

    def evos(metric):
        metric.process_data(pair)
        return metric.get_statistic(StatisticsType.rmse)

    place, turn = PoseRelation.translation_part, PoseRelation.rotation_angle_deg
    assert ours["aligned_rmse_m" if is_aligned else "position_rmse_m"] == pytest.approx(evos(APE(place)), abs=1e-6)
    for name, delta, unit in (("1m", 1.0, Unit.meters), ("1s", 10, Unit.frames)):
        for what, relation in (("rmse_m", place), ("yaw_rmse_deg", turn)):
            theirs = evos(RPE(relation, delta, unit, rel_delta_tol=0.1, all_pairs=True))
            assert ours[f"relative_{name}_{what}"] == pytest.approx(theirs, abs=1e-6)
