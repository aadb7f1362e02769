from __future__ import annotations

import numpy as np

from glass_nav.hypotheses import new_walls
from glass_nav.hypotheses.new_walls import NewWalls

AHEAD = np.array([[3.0, 0.0], [3.0, 1.0], [3.05, 1.0], [3.0, 2.0]])  # the second and third beam end on one piece
START = np.zeros(3)


def test_beams_that_end_on_one_piece_of_wall_share_it() -> None:
    np.testing.assert_allclose(new_walls.pieces(AHEAD), [1.0, 0.5, 0.5, 1.0])
    assert new_walls.pieces(np.zeros((0, 2))).shape == (0,)


def test_a_piece_of_wall_is_new_once_from_wherever_it_is_seen() -> None:
    walls = NewWalls()
    np.testing.assert_allclose(walls.of(AHEAD, START, 0.0), [1.0, 0.5, 0.5, 1.0])
    np.testing.assert_allclose(walls.of(AHEAD, START, 0.0), [1.0, 0.5, 0.5, 1.0])  # asking is not seeing
    walls.add(AHEAD, START, 0.0)
    nearer = AHEAD - [1.0, 0.0]
    np.testing.assert_allclose(walls.of(nearer, np.array([1.0, 0.0, 0.0]), 1.0), 0.0)
    turned = AHEAD[:, ::-1] * [1.0, -1.0]
    np.testing.assert_allclose(walls.of(turned, np.array([0.0, 0.0, 0.5 * np.pi]), 1.0), 0.0)
    np.testing.assert_allclose(walls.of(AHEAD, np.array([0.0, 3.0, 0.0]), 3.0), [1.0, 0.5, 0.5, 1.0])


def test_after_a_long_drive_a_wall_near_one_that_was_seen_may_be_the_same() -> None:
    walls = NewWalls()
    walls.add(AHEAD, START, 0.0)
    beside = np.array([1.0, 0.0, 0.0])  # by odometry 1 m further on
    assert walls.of(AHEAD, beside, 1.0).sum() == 3.0
    assert walls.of(AHEAD, beside, 50.0).sum() == 0.0
