"""The covariance of a tracked pose over a drive: what scans and odometry leave of it."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav import _integrity
from glass_nav.geometry import se2
from glass_nav.localization.integrity import pose_covariance
from glass_nav.localization.integrity.fit_information import FitInformation
from glass_nav.localization.integrity.pose_covariance import PoseCovariance
from glass_nav.localization.particle_filter.motion import OdometryNoise

NOISE = OdometryNoise()
STEP = np.array([0.1, 0.0, 0.0])


def fit(*deviations):
    return FitInformation(np.diag(np.square(deviations)), np.zeros(3), 1.0)


def driven(covariance, steps, found, odometry_error=np.zeros(3)):
    """After so many steps along x, each with that fit."""
    pose = np.zeros(3)
    covariance.update(None, pose, found, NOISE)
    for _ in range(steps):
        pose = se2.compose(pose, STEP + odometry_error)
        covariance.update(STEP, pose, found, NOISE)
    return np.sqrt(np.diag(covariance.carried(None, NOISE)))


def test_scans_of_the_same_walls_do_not_make_the_pose_better_and_better():
    found = driven(PoseCovariance(np.eye(3)), 200, fit(0.02, 0.02, 0.005))
    np.testing.assert_allclose(found, [0.02, 0.02, 0.005], rtol=0.3)


def test_along_a_corridor_odometry_holds_and_its_error_grows():
    start = np.diag(np.square([0.05, 0.05, 0.01]))
    near, far = (driven(PoseCovariance(start), steps, fit(2.0, 0.02, 0.005)) for steps in (20, 200))
    assert 0.05 < near[0] < far[0] < 2.0
    assert far[1] < 0.03


def test_a_scan_that_says_nothing_leaves_the_pose_to_odometry():
    pose = PoseCovariance(np.diag(np.square([0.05, 0.05, 0.01])))
    assert np.all(driven(pose, 50, None) > [0.05, 0.05, 0.01])


def test_between_updates_the_pose_gets_less_certain():
    pose = PoseCovariance(np.zeros((3, 3)))
    driven(pose, 5, fit(0.01, 0.01, 0.002))
    before = np.trace(pose.carried(None, NOISE))
    steps = [np.trace(pose.carried(np.array([x, 0.0, 0.0]), NOISE)) for x in (0.02, 0.05, 0.09)]
    assert before < steps[0] < steps[1] < steps[2]


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_odometry_that_was_often_wrong_is_trusted_less(axis):
    """In the direction in which it was wrong."""
    error = np.zeros(3)
    error[axis] = (0.04, 0.04, 0.05)[axis]
    wrong, right = PoseCovariance(np.eye(3)), PoseCovariance(np.eye(3))
    driven(wrong, 60, fit(0.01, 0.01, 0.002), error)
    driven(right, 60, fit(0.01, 0.01, 0.002))
    more, less = (each.carried(STEP, NOISE) - each.carried(None, NOISE) for each in (wrong, right))
    assert wrong.carried(STEP, NOISE)[axis, axis] > right.carried(STEP, NOISE)[axis, axis]
    assert np.trace(more) > np.trace(less)


def test_other_evidence_narrows_the_pose():
    pose = PoseCovariance(np.eye(3))
    pose.narrow(np.diag([100.0, 0.01, 100.0]))
    np.testing.assert_allclose(np.diag(pose.carried(None, NOISE))[[0, 2]], 1.0, rtol=1e-6)
    assert pose.carried(None, NOISE)[1, 1] == pytest.approx(0.01)


def random_covariance(rng):
    root = rng.normal(size=(3, 3))
    return root @ root.T + 0.01 * np.eye(3)


@pytest.mark.parametrize("seed", range(10))
def test_the_better_of_two_is_never_better_than_both_together(seed):
    """And never worse than the first, whose directions it keeps where the second is hardly worse."""
    rng = np.random.default_rng(seed)
    first, second = random_covariance(rng), random_covariance(rng)
    better = pose_covariance.better_of(first, second)
    both = np.linalg.inv(np.linalg.inv(first) + np.linalg.inv(second))
    assert np.linalg.eigvalsh(better - both).min() > -1e-9


@pytest.mark.parametrize("seed", range(10))
def test_the_spread_of_the_particles_counts_in_directions_in_which_it_is_far_larger(seed):
    rng = np.random.default_rng(seed)
    first, second = random_covariance(rng), random_covariance(rng)
    wider = pose_covariance.widened_by(first, second)
    assert np.linalg.eigvalsh(wider - first).min() > -1e-9
    np.testing.assert_allclose(pose_covariance.widened_by(first, 2.0 * first), first, rtol=1e-6)
    np.testing.assert_allclose(pose_covariance.widened_by(first, 400.0 * first), 400.0 * first, rtol=1e-6)


def test_of_two_the_one_with_the_smaller_variance_holds():
    for ratio, least, most in ((0.25, 0.25, 0.26), (1.0, 1.0, 1.0), (1.5, 1.0, 1.1), (4.0, 1.0, 1.02)):
        better = pose_covariance.better_of(np.eye(3), ratio * np.eye(3))
        assert least - 1e-9 <= better[0, 0] <= most + 1e-9
    np.testing.assert_allclose(pose_covariance.better_of(np.eye(3), 100.0 * np.eye(3)), np.eye(3), atol=1e-6)


def share(ratio):
    return 1.0 / (1.0 + ratio**4)


def mixed(first, second, ratio):
    """A second opinion in numpy: the first covariance, with a variance for each principal axis of the other one."""
    root = np.linalg.cholesky(first + 1e-12 * np.eye(3))
    values, axes = np.linalg.eigh(np.linalg.solve(root, np.linalg.solve(root, second).T))
    turned = root @ axes
    return (turned * ratio(values)) @ turned.T


@pytest.mark.parametrize("seed", range(20))
def test_the_compiled_covariances_agree_with_numpy(seed):
    rng = np.random.default_rng(seed)
    roots = rng.normal(0.0, 1.0, (2, 3, 3)) * 10.0 ** rng.uniform(-3.0, 1.0, (2, 1, 3))
    first, second = roots @ roots.transpose(0, 2, 1)
    better = mixed(first, second, lambda v: (1.0 - share(v) + share(v) * np.sqrt(v)) ** 2)
    wider = mixed(first, second, lambda v: np.maximum(v * -np.expm1(-((v / 4.0) ** 2)), 1.0))
    scale = np.sqrt(np.outer(np.diag(first), np.diag(first)))
    np.testing.assert_allclose(pose_covariance.better_of(first, second) / scale, better / scale, atol=1e-6)
    np.testing.assert_allclose(pose_covariance.widened_by(first, second), wider, rtol=1e-6, atol=1e-6 * wider.max())
    root = np.linalg.cholesky(first + 1e-12 * np.eye(3))
    of_second = mixed(first, second, share) @ np.linalg.inv(root @ root.T)
    np.testing.assert_allclose(_integrity.share_of_second(first, second), of_second, rtol=1e-4, atol=1e-4)


def test_a_covariance_that_is_not_definite_is_refused():
    with pytest.raises(ValueError, match="not positive definite"):
        pose_covariance.better_of(-np.eye(3), np.eye(3))


def corrected(worth, then=None, steps=10):
    """Deviation along x of what is not proven after a correction of 0.2 m by a scan of such worth, and some scans more."""
    pose = PoseCovariance(np.zeros((3, 3)))
    pose.update(None, np.zeros(3), fit(0.02, 0.02, 0.005), NOISE)
    at = STEP + [0.2, 0.0, 0.0]
    pose.update(STEP, at, fit(0.02, 0.02, 0.005), NOISE, worth)
    for _ in range(steps if then is not None else 0):
        at = se2.compose(at, STEP)
        pose.update(STEP, at, fit(0.02, 0.02, 0.005), NOISE, then)
    return pose, np.sqrt(pose.unproven[0, 0])


def test_a_correction_by_a_scan_that_hardly_fits_stays_in_doubt():
    assert corrected(1.0)[1] == 0.0
    assert 0.15 < corrected(0.3)[1] < corrected(0.0)[1] == pytest.approx(0.2)


def test_scans_that_fit_better_prove_a_correction():
    assert corrected(0.0, then=0.0)[1] == pytest.approx(0.2)
    assert 0.0 < corrected(0.0, then=0.9)[1] < corrected(0.0, then=0.3)[1] < 0.2
    assert corrected(0.0, then=1.0)[1] == 0.0


def test_other_evidence_proves_a_correction():
    pose, _ = corrected(0.0)
    pose.narrow(np.diag(np.square([0.05, 0.05, 0.05])))
    assert not pose.unproven.any()


def test_odometry_is_judged_only_by_scans_that_fit():
    def scale(worth):
        pose, _ = corrected(worth)
        return pose.carried(np.array([1.0, 0.0, 0.0]), NOISE)[0, 0]

    assert scale(0.0) < scale(0.3) < scale(1.0)


def kept(found, worth=0.3, slipped=False, off=0.3):
    """Errors along and across of a pose that odometry knew and a scan of such worth led 0.3 m off, along and across."""
    pose = PoseCovariance(np.diag(np.square([0.02, 0.02, 0.005])))
    pose.update(None, np.zeros(3), fit(0.02, 0.02, 0.005), NOISE)
    after = pose.update(STEP, STEP + [off, off, 0.0], found, NOISE, worth, slipped)
    return (after - STEP)[:2], pose


def test_odometry_keeps_the_pose_where_a_scan_is_ambiguous():
    error, pose = kept(fit(0.5, 0.02, 0.005))
    assert abs(error[0]) < 0.01 and error[1] == pytest.approx(0.3, abs=0.01)
    assert np.sqrt(pose.carried(None, NOISE)[0, 0]) < 0.1
    assert pose.noise_scale[0] == pytest.approx(1.0, abs=0.05)  # odometry was not judged by it


@pytest.mark.parametrize(
    ("found", "worth", "slipped"),
    [
        pytest.param(fit(0.03, 0.02, 0.005), 0.3, False, id="a scan that is clear"),
        pytest.param(fit(0.5, 0.02, 0.005), 1.0, False, id="a scan that fits as a whole"),
        pytest.param(fit(0.5, 0.02, 0.005), 0.3, True, id="wheels that slipped"),
    ],
)
def test_else_the_scan_moves_it(found, worth, slipped):
    np.testing.assert_allclose(kept(found, worth, slipped)[0], 0.3, atol=1e-3)


def test_a_heading_stays_wrapped():
    pose = PoseCovariance(np.eye(3) * 1e-4)
    pose.update(None, np.array([0.0, 0.0, np.pi - 0.01]), fit(0.02, 0.02, 0.005), NOISE)
    turned = pose.update(np.array([0.0, 0.0, 0.02]), np.array([0.0, 0.0, -np.pi + 0.3]), fit(0.5, 0.5, 0.5), NOISE, 0.3)
    assert turned[2] == pytest.approx(-np.pi + 0.01, abs=0.02)
