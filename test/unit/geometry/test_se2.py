import numpy as np
import pytest

from glass_nav.geometry import angles, se2


def random_poses(rng, count=50):
    return np.column_stack([rng.uniform(-9.0, 9.0, (count, 2)), rng.uniform(-np.pi, np.pi, count)])


def as_matrix(pose):
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    return np.array([[cos, -sin, pose[0]], [sin, cos, pose[1]], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("seed", range(5))
def test_composition_is_the_product_of_matrices(seed):
    rng = np.random.default_rng(seed)
    for a, b in zip(random_poses(rng), random_poses(rng)):
        np.testing.assert_allclose(as_matrix(se2.compose(a, b)), as_matrix(a) @ as_matrix(b), atol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_a_pose_after_its_inverse_is_no_motion(seed):
    poses = random_poses(np.random.default_rng(seed))
    there_and_back = se2.compose(poses, se2.inverse(poses))
    np.testing.assert_allclose(there_and_back[:, :2], 0.0, atol=1e-12)
    np.testing.assert_allclose(angles.wrap(there_and_back[:, 2]), 0.0, atol=1e-12)


def test_a_quarter_turn_carries_x_to_y():
    np.testing.assert_allclose(
        se2.transform_points(np.array([1.0, 0.0, np.pi / 2]), np.array([[2.0, 0.0]])), [[1.0, 2.0]], atol=1e-12
    )


def test_one_pose_composes_with_many():
    many = random_poses(np.random.default_rng(0))
    one = np.array([1.0, 2.0, 0.3])
    np.testing.assert_allclose(se2.compose(one, many)[7], se2.compose(one, many[7]))
    np.testing.assert_allclose(se2.compose(many, one)[7], se2.compose(many[7], one))


@pytest.mark.parametrize("shapes", [((4, 1), (5,)), ((5,), (4, 1)), ((2, 1, 3), (4, 1)), ((4, 5), (4, 5)), ((), (0,))])
def test_leading_axes_broadcast_as_numpys_do(shapes):
    rng = np.random.default_rng(0)
    poses, points = rng.normal(0.0, 2.0, (*shapes[0], 3)), rng.normal(0.0, 2.0, (*shapes[1], 2))
    shape = np.broadcast(poses[..., 0], points[..., 0]).shape
    found = se2.transform_points(poses, points)
    assert found.shape == (*shape, 2)
    for index in np.ndindex(shape):
        pose, point = np.broadcast_to(poses, (*shape, 3))[index], np.broadcast_to(points, (*shape, 2))[index]
        np.testing.assert_allclose(found[index], (as_matrix(pose) @ [*point, 1.0])[:2], atol=1e-12)


def test_shapes_that_do_not_fit_are_refused():
    with pytest.raises(ValueError, match="broadcast"):
        se2.compose(np.zeros((2, 3)), np.zeros((4, 3)))
    with pytest.raises(ValueError, match="last axis must have 3"):
        se2.inverse(np.zeros(2))
