"""Which found panes count as surfaces, and when the classifier's map is drawn anew."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.localization.beam_classification import unmapped_panes
from glass_nav.localization.beam_classification.unmapped_panes import PaneUse, UnmappedPanes
from glass_nav.panes.pane_finder import PaneFinderParams
from glass_nav.world.grid_map import GridMap
from glass_nav.world.pane import Pane

MAP = GridMap(np.zeros((80, 100), np.int8), 0.05, np.zeros(3))


def pane(x_m=1.0, probability=0.95, length_m=1.0, y_m=2.0):
    return Pane(np.array([x_m, y_m]), np.array([x_m + length_m, y_m]), probability)


class Finder:
    """Reports the panes it is told to, at each scan."""

    due = True

    def __init__(self, grid_map, params, known=()):
        self.found = list(known)

    def observe(self, scan, map_from_base, covariance):
        return True

    def panes(self):
        return self.found


@pytest.fixture
def panes(monkeypatch):
    monkeypatch.setattr(unmapped_panes, "PaneFinder", Finder)
    return UnmappedPanes(MAP, PaneUse(), PaneFinderParams())


def observe(panes, *found):
    """Whether what is drawn changed once these panes are found."""
    panes._finder.found = list(found)
    return panes.observe(None, np.zeros(3), np.zeros((3, 3)))


def test_a_pane_counts_from_its_probability_on(panes):
    assert not observe(panes, pane(probability=0.89))
    assert panes.drawn == () and len(panes.candidates) == 1
    assert observe(panes, pane(probability=0.91))
    assert [each.probability for each in panes.drawn] == [0.91]
    occupied = panes.grid_map().occupied
    assert occupied.sum() in (20, 21) and occupied[40].any()
    assert not MAP.occupied.any()


def test_a_pane_that_hardly_changed_stays_as_it_is_drawn(panes):
    first = pane()
    assert observe(panes, first)
    assert not observe(panes, pane(x_m=1.05, probability=0.97))
    assert panes.drawn == (first,)
    assert observe(panes, pane(length_m=1.5))
    assert panes.drawn[0].length_m == 1.5


def test_a_drawn_pane_stays_until_it_is_much_less_probable(panes):
    observe(panes, pane())
    assert not observe(panes, pane(probability=0.7))
    assert observe(panes, pane(probability=0.6))
    assert panes.drawn == ()


def test_a_pane_outside_the_map_is_not_drawn(panes):
    assert not observe(panes, pane(x_m=4.5))


def test_panes_of_an_earlier_run_are_drawn_at_once(monkeypatch):
    monkeypatch.setattr(unmapped_panes, "PaneFinder", Finder)
    panes = UnmappedPanes(MAP, PaneUse(), PaneFinderParams(), [pane(), pane(y_m=3.0, probability=0.5)])
    assert len(panes.drawn) == 1 and len(panes.candidates) == 2


def test_the_search_can_be_switched_off(panes):
    panes.reconfigure(PaneUse(find_panes=False))
    assert not observe(panes, pane())
