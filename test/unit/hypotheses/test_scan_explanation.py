"""How much of simulated scans the map of the same building explains, from where they were made and from elsewhere."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from glass_nav.geometry import se2
from glass_nav.hypotheses.scan_explanation import ScanExplanation
from glass_nav.sensing.scan import Scan, scan_from_fields
from glass_nav.simulation import building_file, building_map, lidar, shipped_buildings
from glass_nav.simulation.building import Building, Wall
from glass_nav.simulation.lidar import LidarModel
from glass_nav.world.grid_map import UNKNOWN, GridMap

OFFICE = "glass_office"
LASER = np.array([0.12, 0.0, 0.0])
# In the frame of the building's drawing, moved by where it is placed: corridor, corridor, a room.
PLACES = se2.compose(np.array([3.137, 2.718, 0.0]), np.array([[4.0, 1.3, 0.2], [18.0, 1.3, 3.0], [26.0, 1.4, -0.4]]))


@functools.lru_cache(maxsize=None)
def office():
    building = building_file.load(shipped_buildings.find(OFFICE))
    return building, ScanExplanation(building_map.draw(building))


def scan_at(building, pose, seed, model=LidarModel(beams=271)):
    seen = lidar.scan(model, building, se2.compose(pose, LASER), 0.0, np.random.default_rng(seed))
    angles_rad = model.angles_rad
    return scan_from_fields(
        0,
        seen.ranges_m,
        float(angles_rad[0]),
        float(angles_rad[1] - angles_rad[0]),
        model.range_min_m,
        model.range_max_m,
        LASER,
    )


@pytest.mark.parametrize("place", range(len(PLACES)))
def test_the_truth_explains_a_scan_glass_and_all_and_other_places_do_not(place):
    building, explanation = office()
    truth = PLACES[place]
    scan = scan_at(building, truth, place)
    wrong = np.array([pose for pose in PLACES if pose is not truth and np.hypot(*(pose - truth)[:2]) > 1.0])
    turned = se2.compose(truth, np.array([0.0, 0.0, 0.5 * np.pi]))
    shares = explanation.shares(scan, np.stack([truth, *wrong, turned]))
    assert shares[0] >= 0.8
    assert (shares[1:] < 0.6).all(), shares


def test_a_pose_that_is_known_to_a_decimetre_slides_to_where_it_fits():
    building, explanation = office()
    scan = scan_at(building, PLACES[0], 5)
    near = se2.compose(PLACES[0], np.array([0.12, -0.1, np.radians(4.0)]))
    far = se2.compose(PLACES[0], np.array([2.5, 0.0, 0.0]))
    exact, beside, away = explanation.shares(scan, np.stack([PLACES[0], near, far]))
    assert beside >= exact - 0.05
    assert away < exact - 0.2


def test_a_film_on_the_glass_explains_all_that_a_wall_would():
    building, explanation = office()
    scan = scan_at(building.opaque(), PLACES[1], 7)
    assert explanation.shares(scan, PLACES[1:2])[0] >= 0.9


def test_a_scan_in_which_hardly_a_beam_came_back_says_nothing():
    _, explanation = office()
    angles_rad = np.linspace(-2.0, 2.0, 60)
    ranges_m = np.full(60, np.inf)
    nothing = Scan(0, ranges_m, angles_rad, 0.1, 25.0, LASER)
    assert np.isnan(explanation.shares(nothing, PLACES)).all()
    ranges_m[:9] = 1.0
    assert np.isnan(explanation.shares(nothing, PLACES)).all()
    ranges_m[9] = 1.0
    assert np.isfinite(explanation.shares(nothing, PLACES)).all()


def test_many_poses_are_judged_as_each_alone():
    building, explanation = office()
    scan = scan_at(building, PLACES[2], 1)
    rng = np.random.default_rng(0)
    poses = se2.compose(PLACES[2], rng.normal(0.0, [2.0, 0.3, 0.5], (70, 3)))
    shares = explanation.shares(scan, poses)
    assert shares.shape == (70,) and ((shares >= 0.0) & (shares <= 1.0)).all()
    for index in (0, 63, 64, 69):
        assert explanation.shares(scan, poses[index : index + 1])[0] == pytest.approx(shares[index], abs=1e-12)
    assert explanation.shares(scan, np.zeros((0, 3))).shape == (0,)


def test_where_the_map_knows_nothing_beams_are_no_evidence_but_through_a_wall_they_are():
    """A corridor of which the mapper saw one half; its end stands in what is unknown."""
    walls = (Wall(np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 3.0], [0.0, 3.0], [0.0, 0.0]]), 0.1),)
    corridor = Building(walls, start=np.array([2.0, 1.5, 0.0]))
    grid = building_map.draw(corridor)
    known = GridMap(
        np.where(np.arange(grid.occupancy.shape[1]) < 160, grid.occupancy, np.int8(UNKNOWN)),
        grid.resolution_m,
        grid.map_from_grid,
    )  # up to x = 7 m
    truth, turned = np.array([[5.0, 1.5, 0.1], [5.0, 1.5, 0.1 + 0.5 * np.pi]])
    ahead = scan_at(corridor, truth, 1)  # many of its beams end beyond 7 m
    shares = ScanExplanation(known).shares(ahead, np.stack([truth, turned]))
    assert shares[0] > 0.9 > 0.6 > shares[1], shares
    assert ScanExplanation(grid).shares(ahead, truth[None])[0] > 0.9
    nothing = GridMap(np.full_like(grid.occupancy, UNKNOWN), grid.resolution_m, grid.map_from_grid)
    assert np.isnan(ScanExplanation(nothing).shares(ahead, truth[None])).all()


@pytest.mark.long_run
def test_a_beam_that_ends_where_the_mapper_saw_nothing_and_no_wall_before_is_no_evidence():
    cells = np.zeros((60, 60), np.int8)
    cells[:, 40:] = UNKNOWN  # from x = 2 m on
    cells[:20, 44] = 100  # a wall at x = 2.2 m, as it is seen from below
    explanation = ScanExplanation(GridMap(cells, 0.05, np.zeros(3)))
    pose, ranges_m = np.array([[1.0, 0.9, 0.0]]), np.full(40, 1.0)
    ahead = scan_from_fields(0, ranges_m, -0.2, 0.01, 0.1, 10.0, np.zeros(3))  # at the edge of what was seen
    beams = explanation.beams(ahead, pose, 0.0, 0.0)
    assert beams is not None and not beams.explained.any() and not beams.known.any()
    short = scan_from_fields(0, 0.5 * ranges_m, -0.2, 0.01, 0.1, 10.0, np.zeros(3))  # in the midst of free cells
    beams = explanation.beams(short, pose, 0.0, 0.0)
    assert beams is not None and not beams.explained.any() and beams.known.all()


@pytest.mark.long_run
def test_where_nothing_is_known_the_truth_is_among_the_places_proposed_and_explains_most():
    building, explanation = office()
    for number, truth in enumerate(PLACES):
        scan = scan_at(building, truth, 20 + number)
        search = explanation.search(scan, np.zeros(3))
        while not search.advance():
            pass
        places = search.places(np.zeros(3))[:200]
        poses, shares = explanation.fitted(scan, places, 0.5, np.radians(15.0))
        best = poses[shares.argmax()] - truth
        assert np.hypot(*best[:2]) < 0.1 and abs(np.sin(best[2])) < 0.03
        np.testing.assert_array_equal(explanation.shares(scan, places), shares)


def test_a_pose_slides_no_further_than_is_allowed():
    building, explanation = office()
    scan = scan_at(building, PLACES[0], 5)
    near = se2.compose(PLACES[0], np.array([0.12, -0.1, np.radians(4.0)]))[None]
    slid, share = explanation.fitted(scan, near, 0.3, np.radians(10.0))
    assert np.hypot(*(slid[0] - PLACES[0])[:2]) < 0.03
    for most_m, most_rad in ((0.05, 1.0), (0.3, np.radians(1.0))):
        kept, less = explanation.fitted(scan, near, most_m, most_rad)
        np.testing.assert_array_equal(kept, near)
        assert less[0] < share[0]


def test_a_scan_in_which_hardly_a_beam_came_back_proposes_nothing_and_moves_nothing():
    _, explanation = office()
    nothing = Scan(0, np.full(60, np.inf), np.linspace(-2.0, 2.0, 60), 0.1, 25.0, LASER)
    assert explanation.search(nothing, np.zeros(3)) is None
    assert explanation.beams(nothing, PLACES, 0.5, 0.5) is None
    np.testing.assert_array_equal(explanation.fitted(nothing, PLACES, 0.5, 0.5)[0], PLACES)


def test_a_beam_that_ends_at_the_back_of_a_wall_is_no_evidence_and_one_that_ends_behind_a_wall_is():
    """Two rooms, and between them a yard that the mapper did not see: of each wall the map has the face in the room."""
    occupancy = np.full((80, 240), UNKNOWN, np.int8)  # 4 m by 12 m
    occupancy[:, :80] = occupancy[:, 160:] = 0
    occupancy[:, [80, 160]] = 100  # at x = 4 m and 8 m
    explanation = ScanExplanation(GridMap(occupancy, 0.05, np.zeros(3)))
    angles_rad = np.linspace(-0.1, 0.1, 20)
    for end_m, explained, known in ((8.0, True, True), (7.7, False, False), (4.4, False, True), (6.0, False, False)):
        scan = Scan(0, (end_m - 2.0) / np.cos(angles_rad), angles_rad, 0.1, 25.0, np.zeros(3))
        beams = explanation.beams(scan, np.array([[2.0, 2.0, 0.0]]), 0.0, 0.0)  # slides nowhere
        assert (beams.explained == explained).all() and (beams.known == known).all(), end_m


@pytest.mark.parametrize(
    "end_m, angle_rad, at",
    [
        pytest.param(8.0, 0.0, 2.0 / 6.0, id="through a cupboard to the wall behind it"),
        pytest.param(4.75, 0.0, np.nan, id="short of the back of the cupboard, which was drawn from behind"),
        pytest.param(8.0, 0.5, np.nan, id="past it to the wall"),
        pytest.param(6.0, 0.5, 1.0, id="ended in free space"),
        pytest.param(7.8, 0.5, np.nan, id="a near miss"),
    ],
)
def test_what_goes_through_a_thing_or_ends_far_from_all_is_contradicted_there(
    end_m: float, angle_rad: float, at: float
):
    cells = np.zeros((160, 161), np.int8)  # 8 m by 8 m
    cells[:, 160] = 100  # the wall at x = 8 m
    cells[70:90, 80:100] = UNKNOWN  # a cupboard, 1 m by 1 m; its outline is drawn
    cells[[70, 89], 80:100] = cells[70:90, 80] = cells[70:90, 99] = 100
    explanation = ScanExplanation(GridMap(cells, 0.05, np.zeros(3)))
    angles_rad = angle_rad + np.linspace(-0.05, 0.05, 20)
    scan = Scan(0, (end_m - 2.0) / np.cos(angles_rad), angles_rad, 0.1, 25.0, np.zeros(3))
    beams = explanation.beams(scan, np.array([[2.0, 4.0, 0.0]]), 0.0, 0.0)
    np.testing.assert_allclose(beams.contradicted_at[0], np.full(20, at), atol=0.02)
    assert beams.contradicted.tolist() == (~np.isnan(beams.contradicted_at)).tolist()


def test_behind_a_pane_there_is_a_yard_that_the_mapper_did_not_see():
    occupancy = np.full((80, 240), UNKNOWN, np.int8)  # 4 m by 12 m
    occupancy[:, :80] = occupancy[:, 160:] = 0
    occupancy[:, [80, 160]] = 100  # the pane at x = 4 m, a wall at 8 m
    explanation = ScanExplanation(GridMap(occupancy, 0.05, np.zeros(3)))
    angles_rad = np.linspace(-0.1, 0.1, 20)
    scan = Scan(0, 6.0 / np.cos(angles_rad), angles_rad, 0.1, 25.0, np.zeros(3))
    beams = explanation.beams(scan, np.array([[2.0, 2.0, 0.0]]), 0.0, 0.0)
    assert beams.explained.all() and not beams.contradicted.any()


def test_one_beam_alone_contradicts_nothing():
    cells = np.zeros((160, 161), np.int8)
    cells[:, 160] = 100
    explanation = ScanExplanation(GridMap(cells, 0.05, np.zeros(3)))
    angles_rad = np.linspace(-0.1, 0.1, 20)
    ranges_m = 6.0 / np.cos(angles_rad)
    ranges_m[[4, 10, 11]] = 3.0
    beams = explanation.beams(
        Scan(0, ranges_m, angles_rad, 0.1, 25.0, np.zeros(3)), np.array([[2.0, 4.0, 0.0]]), 0.0, 0.0
    )
    assert np.flatnonzero(beams.contradicted[0]).tolist() == [10, 11]
