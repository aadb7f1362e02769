"""The cells that a robot may be in at the start."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.localization import start_area
from glass_nav.world.grid_map import GridMap

# 4 x 6 m in cells of 0.5 m, turned by 90 degrees: columns run along y of the map
GRID = GridMap(np.zeros((8, 12), np.int8), 0.5, np.array([2.0, 1.0, 0.5 * np.pi]))


def centres():
    rows, columns = np.mgrid[:8, :12]
    return GRID.centres(rows, columns)


def test_cells_with_their_centres_in_the_polygon_are_within():
    inside = start_area.within(GRID, np.array([[0.0, 1.0], [2.0, 1.0], [2.0, 3.0], [0.0, 3.0]]))
    x, y = np.moveaxis(centres(), -1, 0)
    np.testing.assert_array_equal(inside, (x > 0.0) & (x < 2.0) & (y > 1.0) & (y < 3.0))
    assert inside.sum() == 16


@pytest.mark.parametrize("corners", [np.zeros((2, 2)), np.zeros((3, 3)), np.full((3, 2), np.nan)])
def test_what_is_no_polygon_is_refused(corners):
    with pytest.raises(ValueError, match="^an area needs at least 3 corners of finite x, y, got"):
        start_area.within(GRID, corners)


def test_cells_within_three_and_a_half_deviations_and_a_cell_are_around():
    point, sigma_m = np.array([0.5, 4.0]), np.array([0.1, 0.5])
    off = (centres() - point) / np.sqrt(sigma_m**2 + 0.5**2)
    np.testing.assert_array_equal(
        start_area.around(GRID, point, np.diag(sigma_m**2)), np.hypot(off[..., 0], off[..., 1]) <= 3.5
    )
