from __future__ import annotations

import numpy as np
import pytest

from glass_nav.hypotheses import scan_explanation
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
    assert not served.has_map
    assert served.is_free(POSES[:, :2]).all()
    assert served.search(SCAN, np.zeros(3)) is None and served.beams(SCAN, POSES, 0.5, 0.5) is None


def test_the_map_is_prepared_before_the_first_scan(monkeypatch: pytest.MonkeyPatch) -> None:
    served = ServedExplanation()
    served.take(room())
    monkeypatch.setattr(scan_explanation, "ScanMatcher", None)  # another one cannot be made
    assert served.search(SCAN, np.zeros(3)) is not None


def test_with_a_map_they_tell_what_they_tell_in_that_map():
    served, plain = ServedExplanation(), ScanExplanation(room())
    served.take(room())
    assert served.has_map
    assert served.is_free(np.array([[2.0, 2.0], [0.05, 2.0]])).tolist() == [True, False]
    np.testing.assert_array_equal(
        served.beams(SCAN, POSES, 0.5, 0.5).explained, plain.beams(SCAN, POSES, 0.5, 0.5).explained
    )
    searches = [each.search(SCAN, np.zeros(3)) for each in (served, plain)]
    for search in searches:
        while not search.advance():
            pass
    np.testing.assert_array_equal(*(search.places(np.zeros(3)) for search in searches))
