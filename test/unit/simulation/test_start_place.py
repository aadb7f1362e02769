from __future__ import annotations

import numpy as np
import pytest

from glass_nav.simulation import building_file, shipped_buildings, start_place
from glass_nav.simulation.building import Building, Thing, Wall, box, distances

OFFICE = building_file.load(shipped_buildings.find("glass_office"))


@pytest.mark.long_run
def test_a_random_place_has_room_and_is_another_with_each_seed():
    surfaces = OFFICE.surfaces
    places = [start_place.start("random", OFFICE, seed) for seed in range(20)]
    for place in places:
        assert (
            distances(place[None, :2], surfaces.from_m[surfaces.present], surfaces.to_m[surfaces.present]).min()
            >= start_place.ROOM_M
        )
    assert len({tuple(place) for place in places}) == 20
    np.testing.assert_array_equal(start_place.start("random", OFFICE, 3), places[3])
    assert np.ptp([place[0] for place in places]) > 10.0


def test_it_is_in_the_part_of_the_building_where_its_own_start_is():
    walls = (
        Wall(np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 4.0], [0.0, 4.0], [0.0, 0.0]])),
        Wall(np.array([[4.0, 0.0], [4.0, 4.0]])),
    )
    two = Building(
        walls,
        start=np.array([1.0, 1.0, 0.0]),
        seen_m=np.array([[6.0, 2.0]]),
        things=(Thing(box(2.0, 2.0, 0.5, 0.5), mapped=False),),
    )
    for seed in range(20):
        x, y, _ = start_place.start("random", two, seed)
        assert x < 4.0 and max(abs(x - 2.0), abs(y - 2.0)) > 0.25  # nor in what the map does not know


def test_it_is_not_behind_a_gap_that_no_robot_gets_through():
    walls = (
        Wall(np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 4.0], [0.0, 4.0], [0.0, 0.0]])),
        Wall(np.array([[4.0, 0.0], [4.0, 3.3]])),
    )
    two = Building(walls, start=np.array([0.2, 1.0, 0.0]))  # at the wall, where it can stand though not turn well
    assert max(start_place.start("random", two, seed)[0] for seed in range(20)) < 4.0
    assert max(start_place.random_place(two, np.random.default_rng(seed), 0.0)[0] for seed in range(20)) > 4.0


def test_a_place_is_taken_as_it_is_given():
    np.testing.assert_array_equal(start_place.start("1.5 -2 0.5", OFFICE, 0), [1.5, -2.0, 0.5])
    np.testing.assert_array_equal(start_place.start("1.5, -2, 0.5", OFFICE, 0), [1.5, -2.0, 0.5])
    assert start_place.start(" ", OFFICE, 0) is None


@pytest.mark.parametrize("words", ["1 2", "here", "1 2 nan"])
def test_words_that_are_no_place_are_refused(words):
    with pytest.raises(ValueError, match=f"^start must be x y yaw in m and rad, or random, got '{words}'$"):
        start_place.start(words, OFFICE, 0)


def test_a_building_without_room_is_reported():
    narrow = Building(
        (Wall(np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 0.9], [0.0, 0.9], [0.0, 0.0]])),),
        start=np.array([1.0, 0.45, 0.0]),
        name="duct",
    )
    with pytest.raises(ValueError, match="^duct: no place with 0.45 m of room around it$"):
        start_place.start("random", narrow, 0)
