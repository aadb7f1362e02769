from __future__ import annotations

import numpy as np
import pytest

from glass_nav.recording import frames
from glass_nav.recording.frames import FrameError, FrameTree


def turned(yaw, x=0.0, y=0.0, z=0.0):
    return (x, y, z), (0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2))


def matrix(transform):
    """4 x 4, by the textbook: the second implementation."""
    (x, y, z), (qx, qy, qz, qw) = transform
    return np.array(
        [
            [1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy - qz * qw), 2 * (qx * qz + qy * qw), x],
            [2 * (qx * qy + qz * qw), 1 - 2 * (qx * qx + qz * qz), 2 * (qy * qz - qx * qw), y],
            [2 * (qx * qz - qy * qw), 2 * (qy * qz + qx * qw), 1 - 2 * (qx * qx + qy * qy), z],
            [0, 0, 0, 1],
        ]
    )


def random_transform(rng):
    quaternion = rng.standard_normal(4)
    return tuple(rng.uniform(-5, 5, 3)), tuple(quaternion / np.linalg.norm(quaternion))


@pytest.mark.parametrize("seed", range(20))
def test_composing_and_inverting_are_those_of_matrices(seed):
    rng = np.random.default_rng(seed)
    a, b = random_transform(rng), random_transform(rng)
    np.testing.assert_allclose(matrix(frames.compose(a, b)), matrix(a) @ matrix(b), atol=1e-12)
    np.testing.assert_allclose(matrix(frames.inverse(a)), np.linalg.inv(matrix(a)), atol=1e-12)
    x, y, yaw = frames.planar(a)
    np.testing.assert_allclose([x, y, yaw], [*a[0][:2], np.arctan2(matrix(a)[1, 0], matrix(a)[0, 0])], atol=1e-12)
    np.testing.assert_allclose(frames.upwardness(a), matrix(a)[2, 2], atol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_a_lookup_goes_up_and_down_the_tree(seed):
    rng = np.random.default_rng(seed)
    odom_base, base_mast, mast_laser, base_wheel = (random_transform(rng) for _ in range(4))
    tree = FrameTree()
    tree.add("odom", "base", 5, odom_base, static=False)
    tree.add("base", "/mast", 0, base_mast, static=True)
    tree.add("/mast", "laser", 0, mast_laser, static=True)
    tree.add("base", "wheel", 0, base_wheel, static=True)
    expected = np.linalg.inv(matrix(base_wheel)) @ matrix(base_mast) @ matrix(mast_laser)
    np.testing.assert_allclose(matrix(tree.lookup("wheel", "laser", 5)), expected, atol=1e-12)
    np.testing.assert_allclose(
        matrix(tree.lookup("odom", "laser", 5)), matrix(odom_base) @ matrix(base_mast) @ matrix(mast_laser), atol=1e-12
    )
    assert tree.lookup("laser", "laser", 5) == frames.IDENTITY
    assert tree.frames == ["base", "laser", "mast", "odom", "wheel"]
    assert tree.connected("wheel", "odom")
    assert not tree.connected("map", "odom")


def test_between_two_stamps_the_turn_is_even_and_takes_the_shorter_way():
    tree = FrameTree()
    tree.add("odom", "base", 0, turned(3.0), static=False)
    (_, (x, y, z, w)) = turned(-3.0, x=4.0)
    tree.add("odom", "base", 100, ((4.0, 0.0, 0.0), (-x, -y, -z, -w)), static=False)  # the same rotation
    x, y, yaw = frames.planar(tree.lookup("odom", "base", 25))
    assert (x, y) == (1.0, 0.0)
    assert yaw == pytest.approx(3.0 + 0.25 * (2 * np.pi - 6.0))


def test_transforms_may_come_late_and_twice():
    tree = FrameTree()
    for stamp in (0, 200, 100, 100, 300):
        tree.add("odom", "base", stamp, turned(0.0, x=stamp / 100.0), static=False)
    assert tree.lookup("odom", "base", 150)[0] == (1.5, 0.0, 0.0)
    tree.add("elsewhere", "base", 400, turned(0.0, x=9.0), static=False)  # a second parent is not believed
    assert tree.lookup("odom", "base", 300)[0] == (3.0, 0.0, 0.0)


def test_a_transform_that_never_changes_holds_for_all_time():
    tree = FrameTree()
    tree.add("base", "laser", 10**12, turned(1.0), static=False)
    tree.add("base", "laser", 2 * 10**12, turned(1.0), static=False)
    assert tree.lookup("base", "laser", 0) == turned(1.0)


def test_a_static_transform_can_be_replaced():
    tree = FrameTree()
    tree.add("base", "laser", 0, turned(1.0), static=True)
    tree.add("base", "laser", 5, turned(2.0), static=True)
    assert tree.lookup("base", "laser", 0) == turned(2.0)


def test_what_is_not_known_is_reported():
    tree = FrameTree()
    tree.add("odom", "base", 10**9, turned(0.0), static=False)
    tree.add("odom", "base", 2 * 10**9, turned(1.0), static=False)
    near, far = 2 * 10**9 + 10**8, 2 * 10**9 + 10**8 + 1
    assert tree.lookup("odom", "base", near) == turned(1.0)
    assert tree.lookup("odom", "base", 10**9 - 10**8) == turned(0.0)
    with pytest.raises(FrameError, match="^no transform odom <- base at that time$"):
        tree.lookup("odom", "base", far)
    with pytest.raises(FrameError, match="^no transform map <- base$"):
        tree.lookup("map", "base", near)


def test_a_ring_of_frames_does_not_hang():
    tree = FrameTree()
    tree.add("a", "b", 0, turned(0.0), static=True)
    tree.add("b", "a", 0, turned(0.0), static=True)
    assert tree.connected("a", "b")
    assert not tree.connected("a", "c")


@pytest.mark.parametrize("bad", [(0.0, 0.0, 0.0, 0.0), (float("nan"), 0.0, 0.0, 1.0), (float("inf"), 0.0, 0.0, 1.0)])
def test_a_quaternion_without_direction_is_none(bad):
    assert frames.normalised(bad) is None
    assert frames.normalised((0.0, 0.0, 0.0, 2.0)) == (0.0, 0.0, 0.0, 1.0)
