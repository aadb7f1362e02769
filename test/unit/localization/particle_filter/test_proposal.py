"""Particles from odometry and from the scan, weighed so that where they come from does not show."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from glass_nav.geometry import angles
from glass_nav.hypotheses.scan_alignment import Alignment
from glass_nav.localization.particle_filter import pose_estimate, proposal, resampling
from glass_nav.localization.particle_filter.pose_estimate import PoseEstimate
from glass_nav.localization.particle_filter.proposal import Proposal

MEAN = np.array([2.0, -1.0, 0.5])
DEVIATION = np.array([0.2, 0.1, 0.08])


def cloud(rng, mean=MEAN, count=4000):
    """Particles whose mean and covariance are exactly these, up to the draw."""
    poses = mean + DEVIATION * rng.standard_normal((count, 3))
    poses[:, 2] = angles.wrap(poses[:, 2])
    return poses, np.full(count, 1.0 / count)


def alignment(*poses, sharp=True):
    """A scan that fits at these poses, with walls on all sides or with none along x."""
    information = np.diag([400.0 if sharp else 0.0, 400.0, 900.0])
    return Alignment(np.array(poses, float), np.tile(information, (len(poses), 1, 1)), np.ones(len(poses)))


def whole(poses, weights):
    """All particles as one cluster."""
    return PoseEstimate(*pose_estimate.moments(poses, weights), 1.0, np.ones(len(poses), bool))


def draw(predicted, weights, *others):
    return proposal.draw(predicted, weights, whole(predicted, weights), *others)


def weighted(poses, log_ratio):
    return pose_estimate.moments(poses, resampling.normalised(log_ratio))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(
    "offsets",
    [
        pytest.param([(0.0, 0.0, 0.0)], id="where odometry leads"),
        pytest.param([(0.25, -0.1, 0.05)], id="beside it"),
        pytest.param([(3.0, 3.0, 2.0)], id="elsewhere"),
        pytest.param([(0.2, 0.0, 0.0), (-0.2, 0.1, -0.1), (0.0, 2.0, 0.0)], id="at three places"),
    ],
)
def test_weights_make_the_cloud_odometrys_again_wherever_the_scan_fits(seed, offsets):
    """Importance sampling: mean and covariance of the weighted draws are the target's, not the aligner's."""
    rng = np.random.default_rng(seed)
    predicted, weights = cloud(rng)
    mean, covariance = pose_estimate.moments(predicted, weights)
    aligned = alignment(*[MEAN + offset for offset in offsets])
    poses, log_ratio = draw(predicted, weights, aligned, 1.0, Proposal(odom_slip_probability=0.0), rng)
    assert poses.shape == (4000, 3) and log_ratio.shape == (4000,)
    found_mean, found_covariance = weighted(poses, log_ratio)
    np.testing.assert_allclose(found_mean, mean, atol=4.0 * 0.2 / np.sqrt(1000))
    floor = np.diag([0.01, 0.01, np.radians(0.2)]) ** 2  # odometry is never better than that
    np.testing.assert_allclose(found_covariance, covariance + floor, atol=0.15 * 0.2**2)


@pytest.mark.parametrize("seed", range(4))
def test_a_likelihood_gives_the_same_posterior_with_and_without_the_scans_draws(seed):
    """A scan that says x = 2.3 +- 0.05 m: the product of two normals, worked by hand."""
    rng = np.random.default_rng(seed)
    predicted, weights = cloud(rng)
    aligned = alignment(MEAN + np.array([0.3, 0.0, 0.0]))
    poses, log_ratio = draw(predicted, weights, aligned, 1.0, Proposal(odom_slip_probability=0.0), rng)
    mean, covariance = weighted(poses, log_ratio - 0.5 * ((poses[:, 0] - 2.3) / 0.05) ** 2)
    precision = 1.0 / (0.2**2 + 0.01**2) + 1.0 / 0.05**2
    assert mean[0] == pytest.approx((2.0 / (0.2**2 + 0.01**2) + 2.3 / 0.05**2) / precision, abs=0.006)
    assert np.sqrt(covariance[0, 0]) == pytest.approx(precision**-0.5, rel=0.1)


@pytest.mark.parametrize("seed", range(4))
def test_more_particles_land_where_the_scan_fits_than_odometry_alone_brings_there(seed):
    rng = np.random.default_rng(seed)
    predicted, weights = cloud(rng)
    there = MEAN + np.array([0.4, 0.2, 0.1])

    def near(poses):
        return np.count_nonzero(np.all(np.abs(poses - there) < [0.1, 0.1, 0.05], axis=1))

    poses, _ = draw(predicted, weights, alignment(there), 1.0, Proposal(proposal_scan_share=0.5), rng)
    assert near(poses) > 1000 > 20 * max(near(predicted), 1)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_the_scan_places_its_share_and_odometry_the_rest(share):
    rng = np.random.default_rng(0)
    predicted, weights = cloud(rng)
    far = MEAN + np.array([50.0, 0.0, 0.0])
    poses, _ = draw(predicted, weights, alignment(far), 1.0, Proposal(proposal_scan_share=share), rng)
    assert np.count_nonzero(poses[:, 0] > 25.0) == round(share * 4000)


def test_several_places_get_equal_shares():
    rng = np.random.default_rng(1)
    predicted, weights = cloud(rng)
    places = [MEAN + np.array([10.0 * step, 0.0, 0.0]) for step in (1, 2, 3, 4)]
    poses, _ = draw(predicted, weights, alignment(*places), 1.0, Proposal(proposal_scan_share=0.5), rng)
    counts = [np.count_nonzero(np.abs(poses[:, 0] - place[0]) < 5.0) for place in places]
    np.testing.assert_allclose(counts, 500, atol=4.0 * np.sqrt(2000 * 0.25 * 0.75))


@pytest.mark.parametrize(
    "share, aligned", [(0.0, alignment(MEAN)), (0.5, Alignment(np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros(0)))]
)
def test_without_a_scan_odometrys_particles_stay_as_they_are(share, aligned):
    rng = np.random.default_rng(2)
    predicted, _ = cloud(rng, count=200)
    weights = rng.dirichlet(np.ones(200))
    poses, log_ratio = draw(predicted, weights, aligned, 1.0, Proposal(proposal_scan_share=share), rng)
    np.testing.assert_array_equal(poses, predicted)
    np.testing.assert_allclose(resampling.normalised(log_ratio), weights)


def test_a_weightless_particle_does_not_matter():
    rng = np.random.default_rng(3)
    predicted, _ = cloud(rng, count=100)
    weights = np.full(100, 1.0 / 99)
    weights[0] = 0.0
    _, log_ratio = draw(predicted, weights, alignment(MEAN), 1.0, Proposal(proposal_scan_share=0.0), rng)
    assert resampling.normalised(log_ratio)[0] < 1e-200


def test_where_no_wall_constrains_the_scans_particles_spread_as_odometrys():
    rng = np.random.default_rng(4)
    predicted, weights = cloud(rng)
    far = MEAN + np.array([0.0, 50.0, 0.0])
    poses, _ = draw(predicted, weights, alignment(far, sharp=False), 1.0, Proposal(), rng)
    drawn = poses[poses[:, 1] > 25.0]
    # Along x odometry, slipping wheels included: sqrt(0.2^2 + 0.01^2 + 0.3^2); along y 400 beams of 1 m: 0.05 m.
    assert drawn[:, 0].std() == pytest.approx(0.3607, rel=0.06)
    assert drawn[:, 1].std() == pytest.approx(0.05, rel=0.08)


def test_many_beams_that_say_the_same_say_it_more_sharply():
    rng = np.random.default_rng(5)
    predicted, weights = cloud(rng)
    far = MEAN + np.array([0.0, 50.0, 0.0])
    poses, _ = draw(predicted, weights, alignment(far), 4.0, Proposal(), rng)
    assert poses[poses[:, 1] > 25.0][:, 1].std() == pytest.approx(0.025, rel=0.08)


@pytest.mark.parametrize("slip", [0.001, 0.1])
def test_a_wheel_that_slips_makes_far_places_possible(slip):
    """8 deviations off only slip brings the robot: the weight there is the slip's normal over a box."""
    rng = np.random.default_rng(6)
    predicted, weights = cloud(rng)
    mean, covariance = pose_estimate.moments(predicted, weights)
    there = MEAN + np.array([0.0, 0.8, 0.0])
    half_box = np.array([0.05, 0.05, 0.033])

    def weight_there(slip):
        poses, log_ratio = draw(
            predicted, weights, alignment(there), 1.0, Proposal(odom_slip_probability=slip), np.random.default_rng(7)
        )
        return resampling.normalised(log_ratio)[np.all(np.abs(poses - there) < half_box, axis=1)].sum()

    wide = np.sqrt(
        np.diag(covariance) + np.array([0.01, 0.01, np.radians(0.2)]) ** 2 + np.array([0.3, 0.3, np.radians(30.0)]) ** 2
    )
    in_box = stats.norm.cdf((there + half_box - mean) / wide) - stats.norm.cdf((there - half_box - mean) / wide)
    assert weight_there(slip) == pytest.approx(slip * np.prod(in_box), rel=0.25)
    assert weight_there(0.0) < 1e-4 * weight_there(slip)


def test_the_cut_at_pi_does_not_show():
    """The same cloud, turned by half a turn less 0.5 rad so that it lies across the cut: the same weights."""
    half = np.array([0.0, 0.0, np.pi - 0.5])
    straight, turned = [], []
    for mean, found in ((MEAN, straight), (MEAN + half, turned)):
        rng = np.random.default_rng(8)
        predicted, weights = cloud(rng, mean)
        found += draw(predicted, weights, alignment(mean + [0.1, 0.0, 0.05]), 1.0, Proposal(), rng)
    np.testing.assert_allclose(turned[1], straight[1], atol=1e-6)
    np.testing.assert_allclose(angles.wrap(turned[0] - straight[0] - half), 0.0, atol=1e-9)
    assert turned[0][:, 2].min() < -3.0 and turned[0][:, 2].max() > 3.0


@pytest.mark.parametrize(
    "values, text",
    [
        (dict(proposal_scan_share=1.0), "~proposal_scan_share must be in [0, 1), got 1.0"),
        (dict(proposal_scan_share=-0.1), "~proposal_scan_share must be in [0, 1), got -0.1"),
        (dict(proposal_max_beams=1), "~proposal_max_beams must be >= 2, got 1"),
        (dict(proposal_min_cluster_share=1.1), "~proposal_min_cluster_share must be in [0, 1], got 1.1"),
        (dict(odom_slip_probability=1.0), "~odom_slip_probability must be in [0, 1), got 1.0"),
    ],
)
def test_wrong_values_are_refused_in_one_line(values, text):
    with pytest.raises(ValueError) as err:
        Proposal(**values)
    assert str(err.value) == text


def log_normal(poses, mean, covariance):
    off = poses - mean
    off[:, 2] = angles.wrap(off[:, 2])
    return stats.multivariate_normal(np.zeros(3), covariance).logpdf(off)


@pytest.mark.parametrize("seed", range(4))
def test_the_compiled_ratio_is_that_of_the_densities(seed):
    """Target over proposal, both mixtures, written out with scipy's normal distribution."""
    rng = np.random.default_rng(seed)
    predicted, weights = cloud(rng, count=400)
    aligned = alignment(MEAN + [0.1, 0.0, 0.02], MEAN + [-0.3, 0.2, 0.1])
    shares = Proposal(odom_slip_probability=0.01, proposal_scan_share=0.3)
    poses, log_ratio = draw(predicted, weights, aligned, 2.0, shares, rng)
    near = whole(predicted, weights).covariance + np.diag([0.01, 0.01, np.radians(0.2)]) ** 2
    slipped = near + np.diag([0.3, 0.3, np.radians(30.0)]) ** 2
    mean = whole(predicted, weights).map_from_base
    around = np.linalg.inv(2.0 * aligned.information + np.linalg.inv(slipped))
    by_odometry = log_normal(poses, mean, near)
    by_scan = np.logaddexp(*[log_normal(poses, pose, each) for pose, each in zip(aligned.poses, around)]) - np.log(2.0)
    expected = np.logaddexp(np.log(0.99) + by_odometry, np.log(0.01) + log_normal(poses, mean, slipped))
    expected -= np.logaddexp(np.log(0.7) + by_odometry, np.log(0.3) + by_scan)
    expected[:280] = np.minimum(expected[:280], -np.log(0.7))  # put there by odometry
    np.testing.assert_allclose(log_ratio, expected, rtol=1e-9, atol=1e-9)
