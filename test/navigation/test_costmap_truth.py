"""The judge of costmaps, on a room whose costmap is known."""

from __future__ import annotations

import numpy as np
import pytest
from costmap_truth import CostmapTruth, occupied_cells
from made_costmap import MadeCostmap

from glass_nav.simulation.building import Building, Door, Pane, Person, Thing, Wall, box

ROBOT = np.array([2.0, 1.5, 0.0])
BEAMS = np.linspace(-np.pi, np.pi, 721)[:-1]


def room(**more) -> Building:
    """4 x 3 m, its right side a pane."""
    wall = Wall(np.array([[4.0, 0.0], [0.0, 0.0], [0.0, 3.0], [4.0, 3.0]]), 0.1)
    more.setdefault("panes", (Pane(np.array([[4.0, 0.05], [4.0, 2.95]])),))
    return Building((wall,), start=ROBOT, **more)


def score(building, occupied_m, time_s=0.0):
    truth = CostmapTruth(building, np.pi)
    truth.look(ROBOT)
    return truth.score(np.reshape(occupied_m, (-1, 2)).astype(float), ROBOT, time_s)


def along_the_pane(up_to_m):
    y = np.arange(0.05, up_to_m, 0.05)
    return np.stack([np.full_like(y, 4.0), y], axis=1)


def test_glass_counts_once_it_was_in_view_and_is_marked_where_a_cell_is_near():
    whole, half, none = (score(room(), along_the_pane(end_m)) for end_m in (3.0, 1.5, 0.06))
    assert whole.far > 20 and whole.far_marked == whole.far and whole.near == 0
    assert 0.4 < half.far_marked / half.far < 0.6 and none.far_marked <= 3
    truth = CostmapTruth(room(), half_view_rad=1.0)
    truth.look(ROBOT + [0.0, 0.0, np.pi])  # looks away
    assert truth.score(along_the_pane(3.0), ROBOT, 0.0).far == 0


def test_glass_behind_something_was_not_in_view():
    screen = Thing(box(3.0, 1.5, 0.1, 2.9))
    assert score(room(things=(screen,)), along_the_pane(3.0)).far == 0


@pytest.mark.parametrize(
    "more, cell_m, phantom, outdated",
    [
        pytest.param({}, (1.0, 1.5), True, False, id="nothing is there"),
        pytest.param({}, (0.1, 1.5), False, False, id="a wall"),
        pytest.param({}, (4.6, 1.5), False, False, id="behind the pane, where the robot cannot go"),
        pytest.param({"things": (Thing(box(1.0, 1.5, 0.3, 0.3)),)}, (1.1, 1.5), False, False, id="furniture"),
        pytest.param(
            {"things": (Thing(box(1.0, 1.5, 0.3, 0.3), present=False),)}, (1.1, 1.5), True, True, id="it is gone"
        ),
        pytest.param(
            {"doors": (Door(np.array([[1.0, 0.1], [1.0, 2.9]]), "closed", "open"),)},
            (1.0, 1.5),
            True,
            True,
            id="a door is open by now",
        ),
        pytest.param(
            {"people": (Person(np.array([[1.0, 1.5], [3.0, 1.5]])),)}, (1.1, 1.5), False, False, id="a person"
        ),
    ],
)
def test_a_cell_where_nothing_is_is_a_phantom(more, cell_m, phantom, outdated):
    found = score(room(**more), cell_m)
    assert found.phantoms.tolist() == ([list(cell_m)] if phantom else [])
    assert found.outdated.tolist() == ([outdated] if phantom else [])


def test_a_person_who_walked_on_explains_nothing_any_more():
    person = Person(np.array([[0.5, 1.5], [30.5, 1.5]]), speed_m_s=1.0)
    assert len(score(room(people=(person,)), (0.9, 1.5), time_s=14.5).phantoms) == 1


@pytest.mark.parametrize("slipped_m, drifted", [(0.3, True), (1.0, False)])
def test_what_was_at_a_wall_when_it_was_marked_has_drifted(slipped_m, drifted):
    truth = CostmapTruth(room(), np.pi)
    found = truth.score(np.array([[0.3, 1.5]]), ROBOT, 0.0, np.array([[0.0, 0.0, 0.0], [-slipped_m, 0.0, 0.0]]))
    assert found.phantoms.tolist() == [[0.3, 1.5]] and found.drifted.tolist() == [drifted]


def test_cells_of_a_turned_costmap_are_where_they_are_in_the_map():
    cells = np.zeros((4, 6), np.int8)
    cells[1, 3] = 100
    cells[2, 2] = 99  # inscribed: no obstacle
    found = occupied_cells(cells, 0.5, np.array([1.0, 2.0, np.pi / 2.0]))
    np.testing.assert_allclose(found, [[1.0 - 0.75, 2.0 + 1.75]])


def test_a_costmap_marks_where_beams_end_and_clears_where_they_pass():
    costmap = MadeCostmap(np.zeros(2), np.array([4.0, 3.0]))
    costmap.update(ROBOT, BEAMS, np.full(len(BEAMS), 1.0))
    ring_m = np.hypot(*(costmap.occupied_m(ROBOT) - ROBOT[:2]).T)
    assert len(ring_m) > 100 and np.all(np.abs(ring_m - 1.0) < 0.08)
    costmap.update(ROBOT, BEAMS, np.full(len(BEAMS), np.inf))
    assert not len(costmap.occupied_m(ROBOT))


def test_what_one_scan_marks_the_other_does_not_clear():
    costmap = MadeCostmap(np.zeros(2), np.array([4.0, 3.0]))
    costmap.update(ROBOT, BEAMS, np.full(len(BEAMS), 2.0), np.full(len(BEAMS), 1.0))
    ring_m = np.hypot(*(costmap.occupied_m(ROBOT) - ROBOT[:2]).T)
    assert ring_m.min() < 1.05 and ring_m.max() > 1.95
