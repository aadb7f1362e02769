"""Atlases of floors whose measures are known, and properties that every atlas of a map has."""

from __future__ import annotations

from contextlib import contextmanager

import numpy as np
import pytest
from drawn_floors import floor

from glass_nav.simulation import shipped_buildings
from glass_nav.topology.atlas import atlas_builder, atlas_file
from glass_nav.topology.atlas.atlas import DEAD_END, MEETPOINT, RING_MARKER, AtlasError, twin
from glass_nav.world import map_file

W = 2.0
CROSS = floor(15, 13, [(1, 5, 13, 5 + W), (6, 1, 6 + W, 12)])
RING = floor(14, 12, [(2, 2, 12, 10)], [(4, 4, 10, 8)])


def faces(atlas):
    """How many faces the rotation system has: walk in along a dart, leave by the next one clockwise."""
    following = atlas.clockwise(twin(np.arange(len(atlas.darts))), np.ones(len(atlas.darts), int)).tolist()
    walked, count = [False] * len(following), 0
    for dart in range(len(following)):
        count += not walked[dart]
        while not walked[dart]:
            walked[dart] = True
            dart = following[dart]
    return count


def test_a_cross_has_the_measures_of_its_corridors():
    atlas, graph = atlas_builder.build(CROSS, "cross", "drawn")
    assert (atlas.name, atlas.source.name, atlas.source.sha256) == ("cross", "drawn", CROSS.fingerprint)
    middle = int(np.flatnonzero(atlas.nodes.kind == MEETPOINT)[0])
    assert atlas.degree[middle] == 4 and (atlas.nodes.kind == DEAD_END).sum() == 4
    np.testing.assert_allclose(atlas.nodes.position_m[middle], [7.0, 6.0], atol=0.03)
    # From the middle to W / 2 before the end of each arm.
    np.testing.assert_allclose(np.sort(atlas.edges.length_m), [4.0, 5.0, 5.0, 5.0], atol=0.05)
    np.testing.assert_allclose(atlas.edges.chord_m, atlas.edges.length_m, atol=0.02)
    np.testing.assert_allclose(atlas.edges.clearance_m, W / 2.0, atol=0.05)
    leaving = atlas.rings[middle]
    np.testing.assert_allclose(np.mod(np.diff(atlas.darts.bearing_rad[leaving]), 2 * np.pi), 1.5 * np.pi, atol=0.05)
    assert len(graph.lines_m) == 4


def test_a_ring_is_a_self_loop_of_its_marker():
    atlas, _ = atlas_builder.build(RING, "ring", "drawn")
    assert atlas.nodes.kind.tolist() == [RING_MARKER] and atlas.degree.tolist() == [2]
    assert atlas.edges.chord_m[0] == 0.0 and atlas.edges.length_m[0] > 20.0
    assert atlas.darts.node.tolist() == [0, 0]


def test_each_way_of_an_edge_has_its_own_segment_map():
    atlas, _ = atlas_builder.build(CROSS, "cross", "drawn")
    for edge in range(4):
        there, back = atlas.darts.segments_m[2 * edge], atlas.darts.segments_m[2 * edge + 1]
        assert len(there) >= 2 and len(back) >= 2
        assert there.shape != back.shape or not np.allclose(there, back)


def test_lines_in_the_file_stay_near_the_way():
    atlas, graph = atlas_builder.build(RING, "ring", "drawn")
    line = atlas.edges.polyline_m[0]
    assert len(line) < len(graph.lines_m[0]) / 4
    corners = np.abs(graph.lines_m[0][:, None] - line[None]).sum(axis=2).min(axis=0)
    np.testing.assert_allclose(corners, 0.0, atol=1e-9)


def test_the_deviations_cover_what_rough_walls_change():
    """The same floor with other rough walls: r, position and length stay within 4 standard deviations."""
    smooth, _ = atlas_builder.build(CROSS, "a", "a")
    for seed in range(6):
        free = [(1, 5, 13, 5 + W), (6, 1, 6 + W, 12)]
        rough, _ = atlas_builder.build(floor(15, 13, free, rough=0.3, seed=seed), "b", "b")
        away = np.hypot(*(smooth.nodes.position_m[:, None] - rough.nodes.position_m).transpose(2, 0, 1))
        same = away.argmin(axis=1)
        assert sorted(same) == list(range(5))
        assert (np.abs(smooth.nodes.r_m - rough.nodes.r_m[same]) < 4.0 * rough.nodes.sigma_r_m[same]).all()
        change = np.sort(smooth.edges.length_m) - np.sort(rough.edges.length_m)
        assert (np.abs(change) < 4.0 * rough.edges.sigma_m.max()).all()


def test_what_borders_on_unknown_space_has_a_deviation_to_match():
    unknown = floor(12, 8, [(1, 5, 11, 5 + W)], unknown=[(7.5, 4, 12, 8)])
    atlas, _ = atlas_builder.build(unknown, "a", "a")
    left, right = np.argsort(atlas.nodes.position_m[:, 0])
    assert atlas.nodes.sigma_r_m[left] < 0.1 < 0.8 < atlas.nodes.sigma_r_m[right]


@pytest.mark.long_run
@pytest.mark.parametrize("name", sorted(shipped_buildings.shipped()))
def test_the_atlas_of_a_building_is_drawn_on_a_plane_and_is_the_one_shipped(name):
    """Euler: nodes - edges + faces = 2 for each part. It fails where two darts of a node are in the wrong order."""
    path_map = shipped_buildings.shipped()[name].with_name("map.yaml")
    grid_map = map_file.load(path_map)
    atlas, graph = atlas_builder.build(grid_map, name, name)
    assert len(atlas.nodes) - len(atlas.edges) + faces(atlas) == 2 * atlas.components()[0]
    assert grid_map.is_free(np.concatenate(graph.lines_m)).all()
    assert (atlas.edges.clearance_m > 0.22 - 0.05).all()  # a line is drawn to a cell
    shipped = atlas_file.load(path_map.parents[2] / "atlas" / name)
    assert (shipped.name, shipped.source) == (name, atlas.source)
    np.testing.assert_array_equal(shipped.rings.values, atlas.rings.values)
    np.testing.assert_array_equal(shipped.darts.node, atlas.darts.node)
    for part, values in (
        ("nodes", ("position_m", "r_m", "sigma_r_m", "kind")),
        ("edges", ("length_m", "chord_m", "sigma_m", "clearance_m")),
        ("darts", ("bearing_rad",)),
    ):
        for value in values:
            np.testing.assert_allclose(
                getattr(getattr(shipped, part), value), getattr(getattr(atlas, part), value), atol=1e-3, err_msg=value
            )
    for edge in range(len(atlas.edges)):
        np.testing.assert_allclose(shipped.edges.polyline_m[edge], atlas.edges.polyline_m[edge], atol=2e-3)
        for dart in (2 * edge, 2 * edge + 1):
            np.testing.assert_allclose(shipped.darts.segments_m[dart], atlas.darts.segments_m[dart], atol=2e-3)


def test_a_map_without_a_way_has_no_atlas():
    with pytest.raises(AtlasError, match="^no path of 2 m in this map for a robot of 0.22 m radius$"):
        atlas_builder.build(floor(3, 3, [(1, 1, 1.3, 2)]), "a", "a")


def test_who_watches_sees_every_step():
    told = {}

    @contextmanager
    def watch(what, steps):
        told[what] = [steps, 0]

        def step():
            told[what][1] += 1

        yield step

    atlas_builder.build(CROSS, "a", "a", watch=watch)
    assert told == {"graph": [5, 5], "segment maps": [5, 5]}
