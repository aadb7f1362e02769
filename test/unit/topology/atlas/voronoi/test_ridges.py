from __future__ import annotations

import numpy as np
import pytest

from glass_nav.topology.atlas.voronoi import ridges
from glass_nav.topology.atlas.voronoi.bounds import Bounds


def walls(points: np.ndarray, shape: "tuple[int, int]") -> Bounds:
    return Bounds(points, np.zeros(len(points)), np.zeros((0, 2)), np.ones((shape[0] + 2, shape[1] + 2), bool))


def corridor(width: float) -> Bounds:
    """40 cells long, open at its ends."""
    x = np.arange(40) + 0.5
    low = np.column_stack([x, np.full(40, 0.5)])
    return walls(np.concatenate([low, low + [0.0, width]]), (int(width) + 1, 40))


def test_a_corridor_has_one_ridge_along_its_middle() -> None:
    raw = ridges.of(corridor(10.0), clearance=3.0)
    inner = np.abs(raw.points[:, 0] - 20.0) < 10.0
    np.testing.assert_allclose(raw.points[inner, 1], 5.5)
    assert (raw.r > 3.0).all()
    cells = corridor(10.0).points[raw.generator]  # (V, 3, 2)
    away = np.linalg.norm(cells - raw.points[:, None], axis=2)
    np.testing.assert_allclose(away, np.repeat(raw.r[:, None], 3, axis=1))


def test_a_corridor_that_is_too_narrow_has_none() -> None:
    assert not len(ridges.of(corridor(5.0), clearance=3.0).links)


@pytest.mark.parametrize("count", range(4))
def test_so_few_cells_bound_nothing(count: int) -> None:
    raw = ridges.of(walls(np.eye(3, 2)[:count], (4, 4)), clearance=1.0)
    assert raw.points.shape == (0, 2) and raw.links.shape == (0, 2)
