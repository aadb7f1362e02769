from __future__ import annotations

import numpy as np

from glass_nav.hypotheses.scan_explanation import ScanExplanation
from glass_nav.sensing.scan import Scan
from glass_nav.topology.search.served_explanation import ServedExplanation
from glass_nav.world.grid_map import GridMap

SCAN = Scan(0, np.full(40, 1.0), np.linspace(-np.pi, np.pi, 40, endpoint=False), 0.1, 10.0, np.zeros(3))
POSES = np.array([[2.0, 2.0, 0.0], [1.2, 2.0, 0.0]])


def room() -> GridMap:
    cells = np.full((40, 40), 0, np.int8)
    cells[[0, -1]], cells[:, [0, -1]] = 100, 100
    return GridMap(cells, 0.1, np.zeros(3))


def test_without_a_map_scans_tell_nothing():
    served = ServedExplanation()
    assert not served.has_map and np.isnan(served.shares(SCAN, POSES)).all()
    poses, shares = served.fitted(SCAN, POSES, 0.5, 0.5)
    np.testing.assert_array_equal(poses, POSES)
    assert np.isnan(shares).all() and served.places(SCAN, 5).shape == (0, 3)


def test_with_a_map_they_tell_what_they_tell_in_that_map():
    served, plain = ServedExplanation(), ScanExplanation(room())
    served.take(room())
    assert served.has_map
    np.testing.assert_array_equal(served.shares(SCAN, POSES), plain.shares(SCAN, POSES))
    np.testing.assert_array_equal(served.fitted(SCAN, POSES, 0.5, 0.5)[0], plain.fitted(SCAN, POSES, 0.5, 0.5)[0])
    np.testing.assert_array_equal(served.places(SCAN, 5), plain.places(SCAN, 5))
