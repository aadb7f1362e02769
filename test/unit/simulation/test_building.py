from __future__ import annotations

import numpy as np
import pytest

from glass_nav.simulation import building
from glass_nav.simulation.building import OPAQUE, PANE, Building, Door, Mirror, Pane, Person, Thing, Wall, box

LINE = np.array([[0.0, 0.0], [2.0, 0.0]])
SQUARE = np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0], [0.0, 0.0]])


@pytest.mark.parametrize(
    "make, text",
    [
        (lambda: Wall(LINE[:1]), "wall has 1 point, a wall needs at least 2"),
        (lambda: Wall(np.zeros((2, 3))), r"wall must have points of \[x, y\], got shape \(2, 3\)"),
        (lambda: Wall(LINE, thickness_m=0.0), "wall thickness must be > 0 m, got 0.0"),
        (lambda: Wall(LINE, reflectance=1.2), "wall reflectance must be > 0 and <= 1, got 1.2"),
        (lambda: Wall(LINE, thickness_m=np.nan), "wall thickness must be > 0 m, got nan"),
        (lambda: Pane(SQUARE), "pane has 5 points, a pane needs 2"),
        (
            lambda: Pane(LINE[[0, 0]]),
            r"pane has no length at \[0.0, 0.0\]: two points one after the other are the same",
        ),
        (lambda: Pane(LINE * np.nan), r"pane has the point \[nan, nan\], coordinates must be finite"),
        (lambda: Pane(LINE, glazing="triple"), "pane glazing must be single or double, got 'triple'"),
        (lambda: Pane(LINE, gap_m=0.1), r"pane gap must be > 0 and < 0.1 m \(else they are two panes\), got 0.1"),
        (lambda: Pane(LINE, coating=-1.0), "pane coating must be > 0, got -1.0"),
        (lambda: Pane(LINE, dirt=0.5), "pane dirt must be 0 to 0.1, got 0.5"),
        (lambda: Mirror(LINE, reflectance=0.0), "mirror reflectance must be > 0 and <= 1, got 0.0"),
        (lambda: Door(LINE, now="ajar"), "door now must be open or closed, got 'ajar'"),
        (lambda: Door(LINE, mapped="shut"), "door mapped must be open or closed, got 'shut'"),
        (lambda: Thing(LINE), "thing has 2 points, a thing needs at least 3"),
        (lambda: Thing(np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]])), "thing has no area"),
        (lambda: Person(LINE, speed_m_s=0.0), "person speed must be > 0 m/s, got 0.0"),
        (lambda: Person(LINE, radius_m=-1.0), "person radius must be > 0 m, got -1.0"),
    ],
)
def test_a_part_that_cannot_be_is_refused_in_one_line(make, text):
    with pytest.raises(ValueError, match=f"^{text}$"):
        make()


def test_a_wall_reaches_half_its_thickness_beyond_its_ends_and_to_both_sides():
    surfaces = Building((Wall(LINE, 0.2),)).surfaces
    assert surfaces.from_m.min(axis=0) == pytest.approx([-0.1, -0.1])
    assert surfaces.from_m.max(axis=0) == pytest.approx([2.1, 0.1])
    assert len(surfaces.kind) == 4 and (surfaces.kind == OPAQUE).all()
    assert surfaces.mapped.all() and surfaces.present.all()


def test_an_open_door_is_nothing_and_the_map_may_know_another_state():
    def flags(mapped, now):
        surfaces = Building((), doors=(Door(LINE, mapped, now),)).surfaces
        return surfaces.mapped[0], surfaces.present[0]

    assert flags("closed", "closed") == (True, True)
    assert flags("open", "closed") == (False, True)
    assert flags("closed", "open") == (True, False)
    assert flags("open", "open") == (False, False)


def test_a_double_glazing_is_two_sheets_of_one_number():
    surfaces = Building((), panes=(Pane(LINE), Pane(LINE + 1.0, glazing="double", gap_m=0.04))).surfaces
    assert surfaces.glazing.tolist() == [0, 1, 1]
    assert surfaces.sheets.tolist() == [1, 2, 2]
    assert (surfaces.kind == PANE).all()
    np.testing.assert_allclose(surfaces.from_m[1:, 1], [0.98, 1.02])


def test_a_mirror_has_a_number_of_its_own():
    surfaces = Building((), panes=(Pane(LINE),), mirrors=(Mirror(LINE + 2.0), Mirror(LINE + 3.0))).surfaces
    assert surfaces.glazing.tolist() == [0, 1, 2]


def test_a_box_lies_along_its_yaw():
    corners = box(1.0, 2.0, 4.0, 1.0, np.pi / 2.0)
    assert corners.min(axis=0) == pytest.approx([0.5, 0.0])
    assert corners.max(axis=0) == pytest.approx([1.5, 4.0])


def test_segments_cross_or_do_not():
    from_m, to_m = np.array([[0.0, -1.0], [3.0, -1.0]]), np.array([[0.0, 1.0], [3.0, 1.0]])
    line = np.array([[-1.0, 0.0], [-1.0, 2.0]]), np.array([[1.0, 0.0], [1.0, 2.0]])
    assert building.crosses(from_m, to_m, *line).tolist() == [[True, False], [False, False]]


def test_distances_are_to_the_nearest_point_of_a_segment():
    points = np.array([[1.0, 3.0], [-3.0, 4.0], [2.5, 0.0]])
    np.testing.assert_allclose(building.distances(points, LINE[:1], LINE[1:]), [[3.0], [5.0], [0.5]])


def furnished():
    things = [Thing(box(x, y, 0.5, 0.5), movable=True) for x in (1.5, 4.0, 6.5) for y in (6.0, 7.0)]
    fixed = (Thing(box(7.0, 2.0, 1.0, 0.5)), Thing(box(5.0, 4.0, 0.4, 0.4), mapped=False, movable=True))
    return Building(
        (Wall(SQUARE, 0.2),),
        panes=(Pane(np.array([[0.1, 5.0], [7.9, 5.0]])),),
        things=(*things, *fixed),
        paths={"low": np.array([[1.0, 1.0], [7.0, 1.0]]), "high": np.array([[1.0, 5.3], [1.2, 5.3]])},
    )


@pytest.mark.parametrize("seed", range(10))
def test_moved_furniture_is_gone_from_its_place_and_stands_elsewhere_in_its_room(seed):
    before = furnished()
    after = before.changed(0.5, np.random.default_rng(seed))
    gone = [thing for thing in after.things if not thing.present]
    new = after.things[len(before.things) :]
    assert len(gone) == 3 and all(thing.mapped for thing in gone)
    assert 1 <= len(new) <= 3 and all(not thing.mapped and thing.present and thing.movable for thing in new)
    surfaces = Building(after.walls, after.panes, things=tuple(t for t in after.things if t.present)).surfaces
    for thing in new:
        sides = np.roll(thing.outline_m, -1, axis=0) - thing.outline_m
        np.testing.assert_allclose(np.hypot(*sides.T), 0.5)
        assert (thing.outline_m > [0.1, 5.0]).all() and (thing.outline_m < 7.9).all()  # behind the pane as before
        points = np.concatenate([thing.outline_m + share * sides for share in (0.0, 0.25, 0.5, 0.75)])
        clear = building.distances(points, before.paths["high"][:1], before.paths["high"][1:])
        assert clear.min() > building.PATH_CLEARANCE_M
        away = ~np.isin(surfaces.from_m, thing.outline_m).all(axis=1)
        assert building.distances(points, surfaces.from_m[away], surfaces.to_m[away]).min() > 0.0


def test_the_same_seed_moves_the_same_and_nothing_is_moved_for_nothing():
    before = furnished()
    first, second = (before.changed(1.0, np.random.default_rng(3)) for _ in range(2))
    assert [t.outline_m.tolist() for t in first.things] == [t.outline_m.tolist() for t in second.things]
    assert sum(not thing.present for thing in first.things) == 6
    assert before.changed(0.0, np.random.default_rng(3)).things == before.things
    assert Building((Wall(SQUARE),)).changed(1.0, np.random.default_rng(0)).things == ()
    with pytest.raises(ValueError, match="^changed share must be 0 to 1, got 1.5$"):
        before.changed(1.5, np.random.default_rng(0))


def test_what_finds_no_place_has_left_the_building():
    closet = Building((Wall(SQUARE / 8.0),), things=(Thing(box(0.5, 0.5, 0.7, 0.7), movable=True),))
    things = closet.changed(1.0, np.random.default_rng(0)).things
    assert len(things) == 1 and not things[0].present


def test_in_an_opaque_building_film_is_on_every_pane_and_mirror():
    glass = Building(
        (Wall(LINE + 4.0),),
        panes=(Pane(LINE), Pane(LINE + 1.0, glazing="double")),
        mirrors=(Mirror(LINE + 2.0),),
        name="shop",
    )
    opaque = glass.opaque()
    assert (opaque.surfaces.kind == OPAQUE).all() and opaque.name == "shop"
    assert len(opaque.surfaces.kind) == 4 + 3
    np.testing.assert_array_equal(opaque.surfaces.from_m[-3:], [[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]])
    assert opaque.surfaces.present.all() and opaque.surfaces.mapped.all()
    assert (opaque.surfaces.glazing == -1).all()
    assert len(glass.panes) == 2 and not glass.panes[0].film
