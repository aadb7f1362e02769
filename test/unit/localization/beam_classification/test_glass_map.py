"""Which walls are glass: beams by hand, and beams drawn as panes and walls send them."""

from __future__ import annotations

import numpy as np
import pytest
from made_expected_ranges import NEVER, expect

from glass_nav.localization.beam_classification import glass_map
from glass_nav.localization.beam_classification.glass_map import GlassEvidence, GlassMap
from glass_nav.localization.beam_classification.range_residuals import RangeResiduals
from glass_nav.world.grid_map import GridMap

ROWS, COLUMNS = 20, 30
HEAD_ON, SIDEWAYS = 0.0, np.radians(50.0)


def wall_map(occupied=(10, slice(None))) -> GridMap:
    occupancy = np.zeros((ROWS, COLUMNS), np.int8)
    occupancy[occupied] = 100
    return GridMap(occupancy, 0.05, np.array([3.0, -2.0, 0.3]))


def flat(row, column):
    return np.ravel_multi_index((row, column), (ROWS, COLUMNS))


CELL = flat(10, 15)


def learnt(scans, grid_map=None, evidence=None):
    """GlassMap after scans, each of beams (cell, incidence [rad], passed)."""
    found = GlassMap(grid_map or wall_map(), evidence or GlassEvidence())
    for beams in scans:
        cell, incidence, passed = zip(*beams)
        found.learn(np.array(cell), np.array(incidence, float), np.array(passed, bool))
    return found


def chances(found, cell=CELL):
    """To be seen through, and to be there if so."""
    return found.chances(np.array(cell))


def drawn(answers, count=60, seed=0, widest_deg=70.0):
    """Scans of one beam each at CELL, from all sides; answers(incidence): chance to end there."""
    rng = np.random.default_rng(seed)
    incidence = rng.uniform(0.0, np.radians(widest_deg), count)
    return [[(CELL, angle, rng.random() > answers(angle))] for angle in incidence]


# -- panes, walls, and what is gone


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("width_deg", [8.0, 20.0], ids=["sees little of glass", "sees much of glass"])
def test_a_pane_answers_head_on_lets_pass_from_the_side_and_becomes_glass(seed, width_deg):
    found = learnt(drawn(lambda angle: 0.95 if angle < np.radians(width_deg) else 0.05, seed=seed))
    through, there = chances(found)
    assert through > 0.95 and there > 0.8
    assert found.occupancy()[10, 15] > 75


@pytest.mark.parametrize("seed", range(5))
def test_a_wall_never_becomes_glass(seed):
    """Two beams of a hundred pass it, by errors of map and pose."""
    found = learnt(drawn(lambda angle: 0.98, count=150, seed=seed))
    assert chances(found)[0] < 0.05
    assert found.occupancy()[10, 15] < 5


@pytest.mark.parametrize("seed", range(5))
def test_a_thing_that_is_gone_is_seen_through_but_is_no_glass(seed):
    found = learnt(drawn(lambda angle: 0.0, count=150, seed=seed, widest_deg=40.0))
    through, there = chances(found)
    assert through > 0.95 and there < 0.2
    assert found.occupancy()[10, 15] < 20


def test_what_was_only_looked_at_from_the_side_has_not_proved_to_be_there():
    found = learnt([[(CELL, SIDEWAYS, True)]] * 40)
    assert chances(found)[0] > 0.9
    assert found.occupancy()[10, 15] <= 50


def test_one_beam_says_little_and_many_scans_say_much():
    before = chances(learnt([]))[0]
    one, ten = (chances(learnt([[(CELL, SIDEWAYS, True)]] * scans))[0] for scans in (1, 10))
    assert before < one < ten and one < 0.5


def test_a_pane_that_answers_head_on_stays_glass():
    """A robot that drives up to a glass door gets answers from it, and nothing else, at last."""
    found = learnt([[(CELL, SIDEWAYS, True)]] * 20 + [[(CELL, HEAD_ON, False)]] * 20)
    assert chances(found)[0] > 0.8 and chances(found)[1] > 0.9


NORMAL_RAD = 0.3 + 0.5 * np.pi  # of the wall of wall_map(), in the frame map


def driven_past(passed, columns, scans=3):
    """A robot drives past: a few scans meet each cell head on."""
    return [[(flat(10, column), HEAD_ON, passed)] for column in columns for _ in range(scans)]


def gone(found, columns, axis_rad=NORMAL_RAD, opaque=False):
    columns = np.asarray(columns)
    cell, axes_rad = flat(np.full(len(columns), 10), columns), np.full(len(columns), axis_rad)
    return found.is_gone(cell, axes_rad, np.full(len(columns), opaque)).tolist()


def test_a_door_that_every_beam_passes_head_on_is_gone_and_the_panes_beside_it_stay():
    door, panes = range(10, 20), [*range(2, 8), *range(22, 28)]
    found = learnt(driven_past(True, door) + driven_past(False, panes))
    assert all(gone(found, range(11, 19))) and not any(gone(found, panes))


def test_what_was_passed_from_the_side_only_may_be_glass():
    found = learnt([[(flat(10, column), SIDEWAYS, True)] for column in range(5, 25) for _ in range(20)])
    assert not any(gone(found, range(30)))


def test_a_gap_that_a_beam_or_two_found_is_no_door():
    assert not any(gone(learnt(driven_past(True, [14, 15], scans=1)), range(30)))


def test_what_has_no_normal_and_what_is_no_cell_is_never_gone():
    found = learnt(driven_past(True, range(30)))
    assert not any(gone(found, [15], axis_rad=np.nan))
    assert found.is_gone(np.array([-1]), np.array([NORMAL_RAD]), np.array([False])).tolist() == [False]


def test_a_wall_along_the_border_of_the_map_is_asked_within_the_map():
    found = learnt([[(flat(0, column), HEAD_ON, True)] * 3 for column in range(30)] * 3, wall_map((0, slice(None))))
    assert found.is_gone(np.array([0, 15, 29]), np.full(3, NORMAL_RAD), np.zeros(3, bool)).tolist() == [True] * 3


@pytest.mark.parametrize("passes", [0, 1, 20])
@pytest.mark.parametrize("axis_rad", [NORMAL_RAD, np.nan])
def test_what_cannot_be_glass_is_gone_when_beams_pass_from_any_side(passes, axis_rad):
    found = learnt([[(flat(10, 15), SIDEWAYS, True)]] * passes)
    assert gone(found, [15], axis_rad, opaque=True) == [True]


def test_what_cannot_be_glass_by_its_shape_and_answers_head_on_like_glass_is_not_gone():
    found = learnt(driven_past(False, [15]) + [[(flat(10, 15), SIDEWAYS, True)]] * 20)
    assert gone(found, [15], opaque=True) == [False]


def test_what_has_no_normal_can_be_seen_through_too():
    """A railing: a third of the beams end at it, the others pass."""
    found = learnt([[(CELL, np.nan, index % 3 > 0)] for index in range(60)])
    assert chances(found)[0] > 0.9
    assert np.isfinite(chances(found)).all()


# -- one scan


def test_many_beams_of_one_scan_at_a_cell_are_one_piece_of_evidence():
    one, many = (learnt([[(CELL, SIDEWAYS, True)] * beams] * 5) for beams in (1, 50))
    np.testing.assert_allclose(chances(many), chances(one), atol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_the_order_of_the_beams_of_a_scan_does_not_matter(seed):
    rng = np.random.default_rng(seed)
    scans = [
        [(flat(10, rng.integers(COLUMNS)), rng.uniform(0.0, 1.2), rng.random() < 0.5) for _ in range(40)]
        for _ in range(10)
    ]
    shuffled = [[scan[index] for index in rng.permutation(len(scan))] for scan in scans]
    every = np.arange(ROWS * COLUMNS)
    np.testing.assert_allclose(learnt(scans).chances(every), learnt(shuffled).chances(every), atol=1e-5)


def test_beams_that_contradict_each_other_in_one_scan_say_what_they_say_on_the_mean():
    alone, both = (
        chances(learnt([beams] * 10))[0]
        for beams in ([(CELL, SIDEWAYS, True)], [(CELL, SIDEWAYS, True), (CELL, SIDEWAYS, False)])
    )
    assert both < alone


def test_a_scan_without_a_crossing_changes_nothing():
    found = learnt([[(CELL, SIDEWAYS, True)]])
    before = found.chances(np.arange(ROWS * COLUMNS))
    found.learn(np.zeros(0, int), np.zeros(0), np.zeros(0, bool))
    np.testing.assert_array_equal(found.chances(np.arange(ROWS * COLUMNS)), before)


# -- neighbouring cells


def test_a_crossing_counts_for_the_cells_beside_it_the_less_the_farther():
    found = learnt([[(CELL, SIDEWAYS, True)]] * 4)
    through = found.chances(CELL + np.arange(5))[0]
    assert np.all(np.diff(through[:4]) < 0.0)
    assert through[3] == through[4] == chances(learnt([]))[0]
    np.testing.assert_allclose(found.chances(CELL - np.arange(5))[0], through)


@pytest.mark.parametrize(
    "row, column",
    [
        (0, 0),
        (0, COLUMNS - 1),
        (ROWS - 1, 0),
        (ROWS - 1, COLUMNS - 1),
        (7, 0),
        (7, COLUMNS - 1),
        (0, 7),
        (ROWS - 1, 7),
        (1, 1),
        (ROWS - 2, COLUMNS - 2),
    ],
)
def test_at_the_border_of_the_map_nothing_runs_over_to_the_other_side(row, column):
    everywhere = wall_map((slice(None), slice(None)))
    told = learnt([[(flat(row, column), SIDEWAYS, True)]], everywhere).occupancy() >= 0
    rows, columns = np.indices((ROWS, COLUMNS))
    np.testing.assert_array_equal(told, np.maximum(abs(rows - row), abs(columns - column)) <= 2)


def test_cells_that_are_no_wall_learn_nothing():
    found = learnt([[(CELL, SIDEWAYS, True)]])
    assert (found.occupancy()[np.arange(ROWS) != 10] == -1).all()
    assert chances(found, flat(11, 15))[0] == chances(learnt([]))[0]


# -- memory


def test_more_than_the_limit_of_the_memory_is_not_remembered():
    """So that a glass door may be opened, or a wardrobe put before a pane: it takes as long, however long it was so."""
    for beams in ([(CELL, SIDEWAYS, True)], [(CELL, SIDEWAYS, False)]):
        some, more = learnt([beams] * 300), learnt([beams] * 900)
        assert chances(some)[0] == chances(more)[0]
        assert np.all((chances(more) > 0.0) & (chances(more) < 1.0))
    turned = learnt([[(CELL, SIDEWAYS, True)]] * 500 + [[(CELL, SIDEWAYS, False)]] * 200)
    assert chances(turned)[0] < 0.1


def test_a_shorter_memory_is_less_sure_and_none_learns_nothing():
    passed = [[(CELL, SIDEWAYS, True)]] * 300
    through = [chances(learnt(passed, evidence=GlassEvidence(glass_memory=memory)))[0] for memory in (0.0, 1.0, 6.0)]
    assert np.all(np.diff(through) > 0.0)
    assert through[0] == pytest.approx(GlassEvidence().glass_prior)


def test_the_limit_is_of_what_beams_add():
    """Log odds of the prior and of the memory, added by hand."""
    evidence = GlassEvidence(glass_prior=0.2, glass_memory=3.0)
    odds = 0.2 / 0.8 * np.exp(3.0)
    assert chances(learnt([[(CELL, SIDEWAYS, True)]] * 300, evidence=evidence))[0] == pytest.approx(odds / (1 + odds))
    odds = 0.2 / 0.8 * np.exp(-3.0)
    assert chances(learnt([[(CELL, SIDEWAYS, False)]] * 300, evidence=evidence))[0] == pytest.approx(odds / (1 + odds))


# -- what is asked


def test_before_a_beam_crossed_it_each_cell_has_the_prior_and_so_has_no_cell():
    found = learnt(
        [[(0, SIDEWAYS, True)]] * 50, wall_map((slice(None), slice(None))), GlassEvidence(glass_prior=0.3)
    )  # cell 0 has learnt: -1 must not be taken for it, nor for the last
    asked = found.chances(np.array([[-1, flat(10, 3)], [flat(15, 20), -1]]))
    assert asked.shape == (2, 2, 2)
    np.testing.assert_allclose(asked[0], 0.3, atol=1e-6)
    assert np.ptp(asked[1]) == 0.0 and 0.5 <= asked[1, 0, 0] < 1.0  # what can be seen through is glass, as a rule
    assert found.chances(np.array(0))[0] > 0.5


def test_the_occupancy_is_a_picture_of_the_map():
    """Rows and columns are the map's; percent where a beam said something, -1 elsewhere."""
    occupied = np.zeros((ROWS, COLUMNS), bool)
    occupied[4, :] = occupied[:, 6] = True
    found = learnt([[(flat(4, 20), HEAD_ON, False), (flat(15, 6), SIDEWAYS, True)]] * 60, wall_map(occupied))
    picture = found.occupancy()
    assert picture.shape == (ROWS, COLUMNS) and picture.dtype == np.int8
    told = np.zeros((ROWS, COLUMNS), bool)
    told[4, 18:23] = told[13:18, 6] = True
    np.testing.assert_array_equal(picture >= 0, told)
    assert (picture[~told] == -1).all() and picture.max() <= 100
    assert picture[15, 6] > picture[4, 20]


def test_the_picture_is_the_askers_own():
    found = learnt([[(CELL, SIDEWAYS, True)]])
    before = found.occupancy()
    found.occupancy()[:] = 77
    np.testing.assert_array_equal(found.occupancy(), before)


# -- crossings of a scan

EXACT = RangeResiduals(depth_share=0.5, sigma_m=0.02)


def crossings(measured_m, offered, residuals=EXACT):
    cell, incidence, passed = glass_map.crossings(np.atleast_1d(np.asarray(measured_m, float)), offered, residuals)
    return list(zip(cell.tolist(), np.round(incidence, 6).tolist(), passed.tolist()))


@pytest.mark.parametrize(
    "measured_m, passed",
    [
        pytest.param(2.03, [False], id="ended at the wall"),
        pytest.param(4.5, [True], id="went on behind it"),
        pytest.param(2.2, [], id="neither: a thing at the wall, or an error"),
        pytest.param(1.0, [], id="stopped before"),
        pytest.param(np.inf, [], id="no answer"),
        pytest.param(np.nan, [], id="no measurement"),
        pytest.param(-np.inf, [], id="too near"),
    ],
)
def test_a_beam_says_that_it_ended_or_that_it_passed_or_nothing(measured_m, passed):
    told = crossings(measured_m, expect(first=[[2.0], [2.05], [1.95]], cell=7, incidence=0.4))
    assert told == [(7, 0.4, was) for was in passed]


@pytest.mark.parametrize(
    "offered",
    [
        pytest.param(dict(first=[[2.0], [2.0], [6.0]]), id="one sample sees past its edge"),
        pytest.param(dict(first=[[2.0], [2.0], [NEVER]]), id="one sample sees nothing"),
        pytest.param(dict(first=[[2.0]] * 3, cos=0.1), id="grazing: met or missed by chance"),
        pytest.param(dict(first=[[NEVER]] * 3, cell=-1), id="no wall"),
    ],
)
@pytest.mark.parametrize("measured_m", [2.025, 4.5])
def test_what_not_all_samples_agree_on_says_nothing(offered, measured_m):
    assert crossings(measured_m, expect(**offered)) == []


def test_what_ended_behind_the_wall_from_every_sample_has_passed_it():
    """An edge, but the beam went on behind both of its walls."""
    offered = expect(first=[[2.0], [2.0], [6.0]])
    assert [passed for _, _, passed in crossings(8.0, offered)] == [True]


def test_a_beam_ends_across_the_wall_as_deep_as_walls_are_drawn():
    """Half of 0.4 m behind the boundary, at 60 degrees twice that way."""
    offered = expect(first=2.0, thickness_m=0.4, cos=0.5, incidence=np.radians(60.0))
    assert [passed for _, _, passed in crossings(2.4, offered)] == [False]
    assert crossings(2.0, offered) == [] and crossings(2.8, offered) == []
    assert [passed for _, _, passed in crossings(4.0, offered)] == [True]


def test_a_map_that_fits_badly_takes_more_for_an_end():
    offered = expect(first=2.0)
    assert crossings(2.15, offered) == []
    assert len(crossings(2.15, offered, RangeResiduals(0.5, 0.1))) == 1


def test_each_beam_speaks_of_its_own_cell():
    offered = expect(first=[2.0, 2.0, 3.0, 3.0], cell=[5, 6, 7, -1], incidence=[0.1, 0.2, 0.3, 0.4])
    assert crossings([2.02, 5.0, 1.0, 5.0], offered) == [(5, 0.1, False), (6, 0.2, True)]


@pytest.mark.parametrize(
    "values, text",
    [
        (dict(glass_prior=0.0), "~glass_prior must be in (0, 1), got 0.0"),
        (dict(glass_wall_leak=1.0), "~glass_wall_leak must be in (0, 1), got 1.0"),
        (dict(glass_wall_leak=float("nan")), "~glass_wall_leak must be in (0, 1), got nan"),
        (dict(glass_memory=-1.0), "~glass_memory must be finite and >= 0, got -1.0"),
        (dict(glass_memory=float("inf")), "~glass_memory must be finite and >= 0, got inf"),
    ],
)
def test_wrong_values_are_refused_in_one_line(values, text):
    with pytest.raises(ValueError) as err:
        GlassEvidence(**values)
    assert str(err.value) == text


# -- panes that are drawn in, and what is kept for the next run


def with_pane(probability=0.95, column=slice(5, 12)):
    """The map with a pane in row 4, and its cells."""
    grid_map = wall_map()
    grid_map.occupancy[4, column] = 100
    return grid_map, (np.arange(4 * COLUMNS + column.start, 4 * COLUMNS + column.stop), probability)


def test_a_pane_that_is_drawn_in_is_glass_and_the_walls_stay_as_learnt():
    found = learnt([[(CELL, HEAD_ON, False)]] * 20)
    before = chances(found)
    grid_map, pane = with_pane()
    found.redraw(grid_map, [pane])
    np.testing.assert_allclose(chances(found, flat(4, 8))[0], 0.95, atol=1e-6)
    assert found.occupancy()[4, 8] >= 90
    np.testing.assert_array_equal(chances(found), before)
    found.learn(np.array([flat(4, 8)]), np.array([SIDEWAYS]), np.array([True]))
    assert chances(found, flat(4, 8))[0] > 0.95


def test_a_pane_that_is_taken_out_leaves_nothing():
    found = learnt([])
    grid_map, pane = with_pane()
    found.redraw(grid_map, [pane])
    found.redraw(wall_map(), [])
    assert found.occupancy()[4].max() == -1
    np.testing.assert_allclose(chances(found, flat(4, 8))[0], GlassEvidence().glass_prior)


def test_what_was_learnt_of_a_pane_outlives_another_pane():
    found = learnt([])
    grid_map, pane = with_pane()
    found.redraw(grid_map, [pane])
    for _ in range(20):
        found.learn(np.array([flat(4, 8)]), np.array([HEAD_ON]), np.array([True]))
    there = chances(found, flat(4, 8))
    other, longer = with_pane(column=slice(5, 20))
    found.redraw(other, [longer])
    np.testing.assert_array_equal(chances(found, flat(4, 8)), there)


def test_what_is_kept_is_what_was_learnt():
    found, fresh = learnt([[(CELL, SIDEWAYS, True)]] * 10), learnt([])
    fresh.restore(found.arrays())
    np.testing.assert_array_equal(fresh.occupancy(), found.occupancy())
    np.testing.assert_array_equal(chances(fresh), chances(found))


@pytest.mark.parametrize(
    "change, text",
    [
        ({"glass_cell": np.zeros((2, 2), np.int32)}, r"needs cells \(C,\) and log odds \(2, C\), got \(2, 2\)"),
        ({"glass_log_odds": np.full((2, 25), np.nan)}, "needs cells"),
        ({"glass_cell": np.full(25, 10**6, np.int32)}, "must be whole numbers within its map"),
        ({"glass_cell": np.full(25, 1.5)}, "must be whole numbers within its map"),
    ],
)
def test_what_is_no_glass_map_is_refused(change, text):
    found = learnt([[(CELL, SIDEWAYS, True)]])
    kept = {**found.arrays(), **change}
    if "glass_cell" in change and change["glass_cell"].ndim == 1:
        kept["glass_cell"] = change["glass_cell"][: kept["glass_log_odds"].shape[1]]
        kept["glass_log_odds"] = kept["glass_log_odds"][:, : len(kept["glass_cell"])]
    with pytest.raises(ValueError, match=text):
        learnt([]).restore(kept)
