"""The rotation system: what its arrays say, and each rule that an atlas may break."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Callable, Tuple

import made_atlases
import numpy as np
import pytest

from glass_nav.topology.atlas.atlas import (
    Atlas,
    AtlasError,
    Darts,
    Edges,
    MapReference,
    Nodes,
    Ragged,
    Visits,
    rings_clockwise,
    twin,
)
from glass_nav.world.free_space import FreeSpace
from glass_nav.world.grid_map import GridMap


def crossing() -> Atlas:
    """A place with four corridors, east 0, north 1, west 2 and south 3."""
    return made_atlases.corridors(
        [(0, 0), (5, 0), (0, 4), (-3, 0), (0, -2)], [1.4, 0.5, 0.6, 0.7, 0.8], [(0, 1), (0, 2), (0, 3), (0, 4)]
    )


def test_clockwise_of_north_is_east() -> None:
    atlas = crossing()
    east, north, west, south = 0, 2, 4, 6
    assert atlas.clockwise(np.array([north, north, north, north, east]), np.array([0, 1, 2, 3, -1])).tolist() == [
        north,
        east,
        south,
        west,
        north,
    ]
    assert atlas.degree.tolist() == [4, 1, 1, 1, 1]


@pytest.mark.parametrize("seed", range(20))
def test_once_round_a_ring_comes_back_and_a_dart_turned_twice_is_itself(seed: int) -> None:
    atlas = made_atlases.rotation_system(np.random.default_rng(seed))
    darts = np.arange(len(atlas.darts))
    assert (twin(twin(darts)) == darts).all() and (
        atlas.darts.node[twin(darts)] == np.roll(atlas.darts.node.reshape(-1, 2), 1, axis=1).ravel()
    ).all()
    assert (atlas.clockwise(darts, atlas.degree[atlas.darts.node]) == darts).all()
    assert (atlas.rings.values[atlas.rings.offsets[atlas.darts.node] + atlas.rank] == darts).all()


def test_parts_that_do_not_touch_are_counted() -> None:
    atlas = made_atlases.corridors([(0, 0), (5, 0), (20, 0), (26, 0)], [1.0] * 4, [(0, 1), (2, 3)])
    count, label = atlas.components()
    assert count == 2 and label[0] == label[1] != label[2] == label[3]


def test_a_robot_at_a_dart_looks_along_it() -> None:
    atlas = crossing()
    north = np.array([2, 3])
    np.testing.assert_allclose(atlas.map_from_dart(north), [[0, 0, np.pi / 2], [0, 4, 1.5 * np.pi]], atol=1e-12)


def test_visits_have_the_mean_and_spread_of_what_was_measured() -> None:
    visits, r = Visits.none(2, 1), np.array([1.0, 1.4, 1.2, 1.1])
    visits.add_nodes(np.array([1, 1, 1, 1]), r)
    visits.add_edges(np.array([0]), np.array([7.0]))
    assert visits.node_count.tolist() == [0, 4] and visits.edge_count.tolist() == [1]
    assert visits.node_r_mean_m[1] == pytest.approx(r.mean())
    assert visits.node_r_m2[1] == pytest.approx(((r - r.mean()) ** 2).sum())
    assert (visits.edge_length_mean_m[0], visits.edge_length_m2[0]) == (7.0, 0.0)


def floor_of(free_cells: int, shape: Tuple[int, int] = (40, 60)) -> GridMap:
    occupancy = np.full(shape, 100, np.int8)
    occupancy.ravel()[:free_cells] = 0
    return GridMap(occupancy, 0.05, np.zeros(3))


def test_an_atlas_of_another_map_is_refused_one_without_a_map_fits_all() -> None:
    lab = floor_of(2000)
    atlas = replace(crossing(), source=MapReference("office", "ab" * 32))
    assert replace(atlas, source=MapReference("office", lab.fingerprint)).check_map(lab, "lab.yaml") == ""
    assert crossing().check_map(lab, "lab.yaml") == ""
    with pytest.raises(AtlasError) as refused:
        atlas.check_map(lab, "lab.yaml")
    assert str(refused.value) == (
        "was made from another map than lab.yaml: from office with sha256 abababababab..., got "
        f"{lab.fingerprint[:12]}..."
    )


def test_a_map_that_differs_in_a_few_cells_is_told_from_another_map() -> None:
    drawn = floor_of(2000)
    atlas = replace(crossing(), source=MapReference("office", drawn.fingerprint, FreeSpace.of(drawn)))
    assert atlas.check_map(drawn, "lab.yaml") == ""
    assert atlas.check_map(floor_of(2002), "lab.yaml") == (
        "was made from office, which differs from lab.yaml in 2 of 2000 free cells"
    )
    with pytest.raises(AtlasError) as refused:
        atlas.check_map(floor_of(1997), "lab.yaml")
    assert str(refused.value) == (
        "was made from another map than lab.yaml: from office, which differs in 3 of 2000 free cells"
    )
    with pytest.raises(AtlasError, match="from office with sha256 .*, got "):
        atlas.check_map(floor_of(2000, (60, 40)), "lab.yaml")


def test_walls_that_look_unknown_do_not_matter_to_an_atlas() -> None:
    drawn, scanned = floor_of(2000), floor_of(2000)
    scanned.occupancy[scanned.occupancy == 100] = -1
    atlas = replace(crossing(), source=MapReference("office", drawn.fingerprint, FreeSpace.of(drawn)))
    assert atlas.check_map(scanned, "lab.yaml") == ""


def changed(part: str, name: str, value: Any) -> Callable[[Atlas], Atlas]:
    """The atlas with one array replaced, or changed by a function."""

    def change(atlas: Atlas) -> Atlas:
        old = getattr(atlas, part)
        new = value(getattr(old, name)) if callable(value) else value
        return replace(atlas, **{part: replace(old, **{name: new})})

    return change


def put(index: Any, value: Any) -> Callable[[np.ndarray], np.ndarray]:
    def change(old: np.ndarray) -> np.ndarray:
        new = old.copy()
        new[index] = value
        return new

    return change


def ring(*darts: int) -> Callable[[Atlas], Atlas]:
    """The ring of node 0 replaced."""
    return lambda atlas: replace(
        atlas, rings=Ragged(np.concatenate([darts, atlas.rings.values[4:]]), atlas.rings.offsets)
    )


def no_nodes(atlas: Atlas) -> Atlas:
    return replace(atlas, nodes=Nodes(np.zeros((0, 2)), np.zeros(0), np.zeros(0), np.zeros(0, np.int8)))


def no_edges(atlas: Atlas) -> Atlas:
    none = np.zeros(0)
    return replace(atlas, edges=Edges(none, none, none, none, Ragged.empty(0, 2)))


@pytest.mark.parametrize(
    "change, line",
    [
        (no_nodes, "an atlas needs at least one node, got none"),
        (no_edges, "an atlas needs at least one edge, got none"),
        (changed("nodes", "sigma_r_m", np.ones(3)), "sigma_r_m of 5 nodes must be (5,), got (3,)"),
        (changed("nodes", "position_m", put((2, 0), np.nan)), "node 2: the position must be finite, got [nan, 4.0]"),
        (changed("nodes", "r_m", put(1, 0.0)), "node 1: r must be finite and > 0 m, got 0.0"),
        (changed("nodes", "sigma_r_m", put(1, -1.0)), "node 1: sigma_r must be finite and > 0 m, got -1.0"),
        (changed("nodes", "kind", put(4, 3)), "node 4: the kind must be 0 to 2, got 3"),
        (changed("nodes", "kind", put(0, 1)), "node 0: a dead_end has degree 1, got 4"),
        (changed("nodes", "kind", put(1, 2)), "node 1: a ring_marker has degree 2, got 1"),
        (changed("edges", "chord_m", np.ones(3)), "chord_m of 4 edges must be (4,), got (3,)"),
        (changed("edges", "length_m", put(3, np.inf)), "edge 3: the length must be finite and > 0 m, got inf"),
        (changed("edges", "sigma_m", put(3, 0.0)), "edge 3: sigma must be finite and > 0 m, got 0.0"),
        (changed("edges", "chord_m", put(3, -0.1)), "edge 3: the chord must be finite and >= 0 m, got -0.1"),
        (changed("edges", "clearance_m", put(0, np.nan)), "edge 0: the clearance must be finite and >= 0 m, got nan"),
        (
            changed("edges", "chord_m", put(1, 4.1)),
            "edge 1: the chord must not be longer than the edge, got chord 4.1 m and length 4 m",
        ),
        (changed("edges", "polyline_m", Ragged.empty(3, 2)), "the polylines of edges need 4 rows, got 3"),
        (
            changed("edges", "polyline_m", Ragged(np.zeros((3, 2)), np.array([0, 2, 1, 3, 3]))),
            "the offsets of the polylines of edges must ascend from 0 to 3",
        ),
        (
            changed("edges", "polyline_m", Ragged.of([np.full((2, 2), np.nan)] + [np.zeros((0, 2))] * 3, 2)),
            "polylines of edges must be rows of x y, all finite",
        ),
        (
            changed("edges", "polyline_m", Ragged.of([np.array([[0.0, 0.0], [5.0, 0.8]])] + [np.zeros((0, 2))] * 3, 2)),
            "edge 0: its line ends 0.80 m from node 1, allowed 0.5 m",
        ),
        (changed("darts", "node", np.zeros(7, int)), "4 edges have 8 darts, got 7 nodes of darts and 8 bearings"),
        (changed("darts", "node", put(5, 9)), "edge 2: its to must be a node 0 to 4, got 9"),
        (changed("darts", "node", put(4, -1)), "edge 2: its from must be a node 0 to 4, got -1"),
        (changed("darts", "bearing_rad", put(2, np.nan)), "dart 2: the bearing must be finite, got nan"),
        (
            changed("darts", "segments_m", Ragged.empty(8, 3)),
            "segments of darts must be rows of x1 y1 x2 y2, all finite",
        ),
        (ring(0, 6, 4, 4), "node 0: dart 4 is listed 2 times, each is once in one ring"),
        (ring(0, 6, 4, 8), "node 0: there is no dart 8, allowed 0 to 7"),
        (
            lambda atlas: replace(atlas, rings=Ragged(atlas.rings.values, np.array([0, 5, 5, 6, 7, 8]))),
            "node 1: has no darts; no edge leads there",
        ),
        (lambda atlas: replace(atlas, rings=Ragged(atlas.rings.values, np.array([0, 3, 5, 6, 7, 8]))), "lists dart"),
        (changed("darts", "node", put(1, 2)), "node 1: lists dart 1, but edge 0 says that it leaves node 2"),
        (
            lambda atlas: replace(atlas, rings=Ragged(atlas.rings.values[:7], np.array([0, 4, 5, 6, 7, 7]))),
            "node 4: has no darts; no edge leads there",
        ),
        (
            lambda atlas: replace(atlas, rings=Ragged(np.delete(atlas.rings.values, 1), np.array([0, 3, 4, 5, 6, 7]))),
            "leaves it, but its ring does not list dart",
        ),
        (ring(0, 2, 4, 6), "node 0: its darts are not in clockwise order, bearings 0.000, 1.571, 3.142, -1.571 rad"),
        (changed("visits", "node_count", put(0, -1)), "visits of node 0: the count must be >= 0, got -1"),
        (
            changed("visits", "edge_length_mean_m", put(0, np.nan)),
            "visits of edge 0: the mean must be finite and >= 0 m",
        ),
        (
            changed("visits", "edge_length_m2", put(0, -1.0)),
            "visits of edge 0: m2 must be finite and >= 0 m^2, got -1.0",
        ),
        (changed("visits", "edge_count", np.zeros(2, int)), "visits of 4 edges need count, mean and m2 (4,)"),
    ],
)
def test_a_broken_rule_is_named_in_one_line(change: Callable[[Atlas], Atlas], line: str) -> None:
    with pytest.raises(AtlasError) as refused:
        change(crossing())
    assert line in str(refused.value)
    assert "\n" not in str(refused.value)


def test_darts_in_the_same_direction_have_no_order() -> None:
    with pytest.raises(AtlasError, match="node 0: its darts are not in clockwise order"):
        made_atlases.atlas_of(
            np.array([[0.0, 0.0], [3.0, 0.0]]), np.ones(2), np.array([[0, 1], [0, 1]]), np.array([3.0, 4.0])
        )


def test_rounding_may_turn_two_darts_past_each_other() -> None:
    bearing = np.array([0.0, 3.0, 0.0005, 3.1, -2.0, 1.0])
    node = np.array([0, 1, 0, 1, 0, 1])
    rings = rings_clockwise(node, bearing, 2)
    swapped = rings.values.copy()
    at = swapped.tolist().index(0), swapped.tolist().index(2)
    swapped[list(at)] = swapped[list(at[::-1])]
    base = made_atlases.atlas_of(
        np.array([[0.0, 0.0], [3.0, 0.0]]), np.ones(2), node.reshape(-1, 2), np.full(3, 4.0), bearing
    )
    assert replace(base, rings=Ragged(swapped, rings.offsets)).degree.tolist() == [3, 3]


def test_rows_of_different_lengths_come_back_as_they_were() -> None:
    rows = [np.ones((2, 2)), np.zeros((0, 2)), np.full((1, 2), 3.0)]
    ragged = Ragged.of(rows, 2)
    assert len(ragged) == 3
    for index, row in enumerate(rows):
        np.testing.assert_array_equal(ragged[index], row)
    assert Ragged.of([], 2).values.shape == (0, 2)


def test_a_ring_of_one_edge_without_a_meetpoint_is_an_atlas() -> None:
    atlas = made_atlases.atlas_of(
        np.zeros((1, 2)), np.ones(1), np.array([[0, 0]]), np.array([9.0]), np.array([0.5, 0.5 + np.pi]), np.zeros(1)
    )
    assert atlas.clockwise(np.array([0, 1]), np.array([1, 1])).tolist() == [1, 0]
    assert isinstance(atlas.darts, Darts)
