"""A mapper draws what a lidar meets. Cases worked by hand; the shipped buildings against rays in their lines."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from glass_nav.sensing.raycast import RayCaster
from glass_nav.simulation import building_file, building_map, lidar
from glass_nav.simulation.building import Building, Door, Mirror, Pane, Thing, Wall, box, distances
from glass_nav.vocabulary import BeamCase
from glass_nav.world import map_file

MAPS = Path(__file__).resolve().parents[3] / "maps"
SHIPPED = sorted(path.parent.name for path in MAPS.glob("*/building.yaml"))
ROOM = Wall(np.array([[0.0, 0.0], [6.03, 0.0], [6.03, 4.03], [0.0, 4.03], [0.0, 0.0]]), 0.3)
PATH = {"in": np.array([[0.5, 1.0], [1.5, 1.0]])}
START = np.array([0.5, 1.0, 0.0])
FREE, WALL, UNKNOWN = 0, 100, -1


def at(grid, x, y):
    return int(grid.occupancy[grid.cells(np.array([x, y]))])


def along(grid, start, end, count=4000):
    """Values of the cells from start to end, each run once."""
    values = grid.occupancy[grid.cells(np.linspace(start, end, count))]
    return values[np.flatnonzero(np.diff(values.astype(int), prepend=-99))].tolist()


@pytest.mark.parametrize("resolution_m", [0.03, 0.05, 0.07])
def test_a_wall_is_a_thin_surface_with_the_unknown_behind(resolution_m):
    grid = building_map.draw(Building((ROOM,), paths=PATH, start=START), resolution_m)
    assert grid.resolution_m == resolution_m
    assert along(grid, (-0.9, 2.0), (6.9, 2.0)) == [UNKNOWN, WALL, FREE, WALL, UNKNOWN]
    rows, columns = np.nonzero(grid.occupied)
    inner = np.abs(grid.centres(rows, columns) - [3.015, 2.015]) - [3.015 - 0.15, 2.015 - 0.15]
    assert np.abs(inner.max(axis=1)).max() < 1.5 * resolution_m  # all at the face that the room sees
    assert at(grid, 6.03, 2.0) == UNKNOWN  # inside the wall


def test_furniture_is_an_outline_with_the_unknown_inside():
    table = Thing(box(3.0, 2.0, 1.6, 0.8, 0.3))
    grid = building_map.draw(Building((ROOM,), things=(table,), paths=PATH, start=START))
    assert along(grid, (0.5, 2.0), (5.5, 2.0)) == [FREE, WALL, UNKNOWN, WALL, FREE]


def test_glass_is_drawn_like_a_wall_and_the_room_behind_only_if_seen():
    pane = Pane(np.array([[3.01, 0.0], [3.01, 4.03]]))
    unseen = Building((ROOM,), panes=(pane,), paths=PATH, start=START)
    assert along(building_map.draw(unseen), (1.0, 2.0), (5.0, 2.0)) == [FREE, WALL, UNKNOWN]
    seen = replace(unseen, seen_m=np.array([[5.0, 1.0]]))
    assert along(building_map.draw(seen), (1.0, 2.0), (5.0, 2.0)) == [FREE, WALL, FREE]


def test_erased_panes_are_free_and_the_rest_of_the_map_is_the_same():
    lines = [[[3.01, 0.0], [3.01, 4.03]], [[4.5, 0.0], [4.5, 4.03]]]
    post = Thing(box(3.01, 2.0, 0.1, 0.1))
    building = Building(
        (ROOM,),
        tuple(Pane(np.array(line)) for line in lines),
        things=(post,),
        paths=PATH,
        start=START,
        seen_m=np.array([[4.0, 1.0], [5.0, 1.0]]),
    )
    whole, lacking = building_map.draw(building), building_map.draw(building, erased=[0])
    rows, columns = np.nonzero(whole.occupancy != lacking.occupancy)
    assert (lacking.occupancy[rows, columns] == FREE).all() and (whole.occupancy[rows, columns] == WALL).all()
    assert np.abs(whole.centres(rows, columns)[:, 0] - 3.01).max() < 0.05
    assert along(lacking, (1.0, 1.0), (5.0, 1.0)) == [FREE, WALL, FREE]
    assert along(lacking, (1.0, 2.01), (4.0, 2.01)) == [FREE, WALL, UNKNOWN, WALL, FREE]  # a post of its frame


@pytest.mark.parametrize("gap_m", [0.01, 0.05, 0.09])
def test_double_glazing_is_drawn_as_one_surface(gap_m):
    line = np.array([[3.01, 0.0], [3.01, 4.03]])
    building = Building((ROOM,), paths=PATH, start=START, seen_m=np.array([[5.0, 1.0]]))
    double = building_map.draw(replace(building, panes=(Pane(line, glazing="double", gap_m=gap_m),)))
    single = building_map.draw(replace(building, panes=(Pane(line),)))
    np.testing.assert_array_equal(double.occupancy, single.occupancy)


def test_the_map_knows_what_was_there_and_not_what_came():
    building = Building(
        (ROOM,),
        things=(Thing(box(1.5, 3.0, 0.5, 0.5), present=False), Thing(box(3.0, 3.0, 0.5, 0.5), mapped=False)),
        doors=(Door(np.array([[4.0, 0.0], [4.0, 4.03]]), mapped="open", now="closed"),),
        mirrors=(Mirror(np.array([[5.0, 1.0], [5.0, 3.0]])),),
        paths=PATH,
        start=START,
    )
    grid = building_map.draw(building)
    assert along(grid, (0.5, 3.0), (2.5, 3.0)) == [FREE, WALL, UNKNOWN, WALL, FREE]
    assert along(grid, (2.5, 3.0), (4.6, 3.0)) == [FREE]
    assert along(grid, (4.6, 2.0), (5.4, 2.0)) == [FREE, WALL, FREE]


def test_moved_furniture_changes_nothing_on_the_map():
    building = building_file.load(MAPS / "glass_office")
    changed = building.changed(0.5, np.random.default_rng(1))
    assert sum(not thing.present for thing in changed.things) > 20
    np.testing.assert_array_equal(building_map.draw(changed).occupancy, building_map.draw(building).occupancy)


def test_an_open_building_is_seen_as_far_as_the_drawing_goes():
    grid = building_map.draw(Building((Wall(np.array([[0.0, 0.0], [3.0, 0.0]])),), start=np.array([1.0, 1.0, 0.0])))
    assert along(grid, (1.5, -0.5), (1.5, 1.5)) == [FREE, WALL, UNKNOWN, WALL, FREE]


def test_a_point_is_on_the_map_at_a_surface_and_in_the_cells_next_to_it():
    building = Building((ROOM,), panes=(Pane(np.array([[3.01, 0.0], [3.01, 4.03]])),), paths=PATH, start=START)
    points = np.array([[3.01, 1.0], [3.06, 1.0], [3.13, 1.0], [2.89, 1.0], [5.88, 1.0], [99.0, 1.0]])
    assert building_map.is_drawn(building, points).tolist() == [True, True, False, False, False, False]


@pytest.mark.parametrize("resolution_m", [0.0, -1.0, np.nan, np.inf])
def test_a_resolution_is_a_length(resolution_m):
    with pytest.raises(ValueError, match="^a map needs resolution > 0 m, got"):
        building_map.draw(Building((ROOM,), paths=PATH, start=START), resolution_m)


def test_redraw_writes_the_map_beside_the_building(tmp_path):
    (tmp_path / "building.yaml").write_text("walls: [{line: [[0, 0], [3, 0]]}]\nstart: [1, 1, 0]\n")
    building_map.redraw(tmp_path)
    assert (tmp_path / "map.png").is_file()
    assert map_file.load(tmp_path / "map.yaml").occupied.any()


def test_seven_buildings_ship():
    assert SHIPPED == [
        "changed_rooms",
        "double_glazing",
        "glass_atrium",
        "glass_bridge",
        "glass_office",
        "glass_wedge",
        "opaque_office",
    ]


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_map_is_what_its_building_draws(name):
    """To the cell, on every machine. After a change:
    python3 -c "from glass_nav.simulation.building_map import redraw; redraw('maps/NAME')".
    """
    drawn, shipped = building_map.draw(building_file.load(MAPS / name)), map_file.load(MAPS / name / "map.yaml")
    assert shipped.fingerprint == drawn.fingerprint


@pytest.mark.parametrize("name", SHIPPED)
def test_coordinates_that_are_rounded_otherwise_draw_the_same_cells(name):
    """Another numpy or processor rounds the last digits of a sine differently."""
    building, rng = building_file.load(MAPS / name), np.random.default_rng(0)

    def nudged(points_m):
        return points_m * (1.0 + rng.choice([-4e-16, 0.0, 4e-16], points_m.shape))

    other = replace(
        building,
        walls=tuple(replace(wall, line_m=nudged(wall.line_m)) for wall in building.walls),
        panes=tuple(replace(pane, line_m=nudged(pane.line_m)) for pane in building.panes),
        things=tuple(replace(thing, outline_m=nudged(thing.outline_m)) for thing in building.things),
    )
    assert building_map.draw(other).fingerprint == building_map.draw(building).fingerprint


@pytest.mark.parametrize("per_cell", [1, 10])
def test_points_along_a_line_are_no_farther_apart_than_asked_and_begin_and_end_with_it(per_cell):
    """Against fractions; lengths that are whole steps, or nearly, included."""
    rng = np.random.default_rng(0)
    ends = np.concatenate([[[0, 0], [3_000_000, 4_000_000]], rng.integers(-(10**8), 10**8, (8, 2))])
    from_um, to_um = np.array([ends[0], *ends[2:6]]), np.array([ends[1], *ends[6:]])
    for start, end in zip(from_um, to_um):
        cells = building_map._cells(start[None], end[None], 50_000, per_cell)
        count = len(cells) - 1
        exact = [
            [Fraction(int(a) * count + k * int(b - a), count) // 50_000 for a, b in zip(start, end)]
            for k in range(count + 1)
        ]
        np.testing.assert_array_equal(cells, np.array(exact, int))
        assert count * 50_000 >= per_cell * np.hypot(*(end - start).astype(float))


@pytest.mark.parametrize("name", SHIPPED)
def test_paths_of_the_shipped_buildings_are_free_and_those_of_a_real_drive(name):
    building = building_file.load(MAPS / name)
    grid, surfaces = building_map.draw(building), building.surfaces
    lengths = []
    for path in building.paths.values():
        legs = np.hypot(*np.diff(path, axis=0).T)
        lengths.append(legs.sum())
        points = np.concatenate(
            [np.linspace(a, b, int(leg / 0.05) + 2) for a, b, leg in zip(path[:-1], path[1:], legs)]
        )
        present = surfaces.present
        assert distances(points, surfaces.from_m[present], surfaces.to_m[present]).min() > 0.35
        assert grid.is_free(points).all()
    assert 25.0 < min(lengths) and 55.0 < max(lengths) < 100.0
    assert grid.is_free(building.start[:2])


@pytest.mark.parametrize("name", SHIPPED)
def test_rays_on_the_map_meet_what_rays_in_the_building_meet(name):
    """The ray caster knows cells only, the lidar lines only; to a lidar for which glass is white both are alike."""
    building = building_file.load(MAPS / name)
    present = tuple(replace(thing, present=thing.mapped) for thing in building.things)
    doors = tuple(replace(door, now=door.mapped) for door in building.doors)
    building = replace(building, people=(), things=present, doors=doors)
    model = lidar.LidarModel(noise_m=0.0, dropout=0.0, dirty_share=1.0, half_rad=np.pi, echo="first", beams=181)
    caster = RayCaster(building_map.draw(building))
    late_m = []
    for path in building.paths.values():
        for point in path:
            pose = np.append(point, 0.3)
            scan = lidar.scan(model, building, pose, 0.0, np.random.default_rng(0))
            cells_m = caster.cast(pose[None], model.angles_rad, model.range_max_m)[0]
            answered = np.isfinite(scan.exact_m)
            assert (scan.case[answered] == BeamCase.DIFFUSE).mean() > 0.99
            late_m.append((scan.exact_m - cells_m)[answered])
    late = np.concatenate(late_m)
    assert np.median(np.abs(late)) < 0.05
    assert (np.abs(late) < 0.1).mean() > 0.85  # flat beams meet the stairs of a slanted wall early
    assert (np.abs(late) < 0.6).mean() > 0.97


@pytest.mark.parametrize("name", SHIPPED)
def test_film_on_the_glass_does_not_change_the_map(name):
    building = building_file.load(MAPS / name)
    np.testing.assert_array_equal(building_map.draw(building.opaque()).occupancy, building_map.draw(building).occupancy)
