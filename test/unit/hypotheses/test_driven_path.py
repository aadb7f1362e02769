from __future__ import annotations

import numpy as np

from glass_nav.hypotheses.driven_path import DrivenPath


def driven(length_m: float) -> DrivenPath:
    """Straight on along x, a scan every 2 cm."""
    path = DrivenPath()
    for x in np.arange(0.0, length_m + 1e-9, 0.02):
        path.add(np.array([x, 0.0, 0.0]), float(x))
    return path


def in_front_of_a_wall(points_m: np.ndarray) -> np.ndarray:
    """A wall of 0.1 m lies across x = 1.2 m."""
    return np.abs(points_m[..., 0] - 1.2) > 0.051


def test_only_pieces_of_a_path_that_walls_block_are_counted() -> None:
    path, here = driven(3.1), np.array([3.1, 0.0, 0.0])
    beside = [here, here + [5.0, 0.0, 0.0], [0.0, 0.0, 0.5 * np.pi]]  # the last came from the south, along x = 0
    assert path.complete == 6
    assert path.blocked(in_front_of_a_wall, np.array(beside), here, 0, 6).tolist() == [1.0, 0.0, 0.0]
    assert path.blocked(in_front_of_a_wall, np.array(beside), here, 3, 6).tolist() == [0.0, 0.0, 0.0]
    assert path.blocked(in_front_of_a_wall, here[None], here, 5, 2).tolist() == [0.0]
    assert path.blocked(lambda points_m: np.zeros(points_m.shape[:-1], bool), here[None], here, 1, 5).tolist() == [4.0]


def test_who_has_not_driven_has_met_no_wall() -> None:
    path, here = DrivenPath(), np.zeros(3)
    assert path.complete == 0 and path.blocked(in_front_of_a_wall, here[None], here, 0, 0).tolist() == [0.0]
    path.add(here, 0.0)
    assert path.complete == 0 and path.blocked(in_front_of_a_wall, np.zeros((0, 3)), here, 0, 1).tolist() == []


def test_a_thing_that_the_robot_drives_through_again_counts_once() -> None:
    path = driven(3.1)
    for x in np.arange(3.1, -0.1, -0.02):  # and back
        path.add(np.array([x, 0.05, np.pi]), float(6.2 - x))
    here = np.array([0.0, 0.05, np.pi])
    for x in np.arange(0.0, 3.1, 0.02):  # and beside it, where it was not
        path.add(np.array([x, -1.0, 0.0]), float(7.2 + x))
    assert path.blocked(in_front_of_a_wall, here[None], here, 0, 14).tolist() == [1.0]
    assert path.blocked(in_front_of_a_wall, here[None], here, 0, path.complete).tolist() == [2.0]
