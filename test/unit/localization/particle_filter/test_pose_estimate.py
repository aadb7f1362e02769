import numpy as np
import pytest
from scipy.sparse import csgraph

from glass_nav.geometry import angles
from glass_nav.localization.particle_filter import pose_estimate, resampling


def cloud(rng, pose, deviation, count=2000):
    poses = np.asarray(pose) + rng.standard_normal((count, 3)) * deviation
    poses[:, 2] = angles.wrap(poses[:, 2])
    return poses


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("yaw", [0.0, 1.5, np.pi])
def test_one_cloud_has_its_own_mean_and_covariance(seed, yaw):
    deviation = np.array([0.1, 0.2, 0.05])
    poses = cloud(np.random.default_rng(seed), [3.0, -2.0, yaw], deviation)
    best = pose_estimate.of(poses, np.full(len(poses), 1.0 / len(poses)))
    np.testing.assert_allclose(best.map_from_base[:2], [3.0, -2.0], atol=0.02)
    assert abs(angles.wrap(best.map_from_base[2] - yaw)) < 0.01
    np.testing.assert_allclose(np.sqrt(np.diag(best.covariance)), deviation, rtol=0.1)
    assert best.share > 0.99


def test_another_place_is_neither_in_the_mean_nor_in_the_covariance():
    rng = np.random.default_rng(0)
    heavy, light = cloud(rng, [0, 0, 0], 0.05), cloud(rng, [10, 0, 0], 0.05)
    weights = np.repeat([0.7, 0.3], 2000) / 2000
    best = pose_estimate.of(np.concatenate([light, heavy]), weights[::-1])
    assert abs(best.map_from_base[0]) < 0.02 and best.covariance[0, 0] < 0.01
    assert best.share == pytest.approx(0.7) and best.members[2000:].all() and not best.members[:2000].any()


def test_the_same_place_with_the_other_heading_is_another_cluster():
    rng = np.random.default_rng(1)
    poses = np.concatenate([cloud(rng, [0, 0, 0], 0.02), cloud(rng, [0, 0, 2.0], 0.02)])
    assert pose_estimate.of(poses, np.full(4000, 1 / 4000)).share == pytest.approx(0.5)


def test_a_cluster_may_lie_across_the_cut_at_pi():
    poses = cloud(np.random.default_rng(2), [0.1, 0.1, np.pi], 0.1)
    best = pose_estimate.of(poses, np.full(2000, 1 / 2000))
    assert best.share == pytest.approx(1.0, abs=1e-9)
    assert best.covariance[2, 2] == pytest.approx(0.01, rel=0.15)


def test_a_single_particle_is_the_pose():
    best = pose_estimate.of(np.array([[1.0, 2.0, 3.0]]), np.array([1.0]))
    np.testing.assert_allclose(best.map_from_base, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(best.covariance, 0.0, atol=1e-15)


@pytest.mark.parametrize("seed", range(3))
def test_clusters_are_the_filled_bins_that_touch(seed):
    """Against a graph of all pairs of particles."""
    rng = np.random.default_rng(seed)
    poses = np.column_stack([rng.uniform(-4.0, 4.0, (250, 2)), rng.uniform(-np.pi, np.pi, 250)])
    bins = np.floor(poses / resampling.BIN)
    apart = np.abs(bins[:, None] - bins)
    apart[..., 2] = np.minimum(apart[..., 2], 36 - apart[..., 2])
    _, label = csgraph.connected_components(apart.max(axis=-1) <= 1)
    weights = rng.dirichlet(np.ones(len(poses)))
    best = pose_estimate.of(poses, weights)
    heaviest = np.argmax(np.bincount(label, weights))
    np.testing.assert_array_equal(best.members, label == heaviest)
    assert 1 < np.count_nonzero(best.members) < len(poses)
