"""When nodes and edges fit: tolerances against their definition, tests against plain arithmetic."""

from __future__ import annotations

import math

import made_atlases
import numpy as np
import pytest

from glass_nav.topology.observations import Meetpoint, Traversal
from glass_nav.topology.search.matching import Matcher, Tolerances, poses_at


def test_the_risk_is_shared_by_all_tests_of_a_run() -> None:
    limits = Tolerances(risk=0.01, risk_edges=10)
    outside = math.erfc(limits.z / math.sqrt(2.0))  # of one test
    assert 7 * 10 * outside == pytest.approx(0.01, rel=1e-6)
    assert 4.0 < Tolerances().z < 5.0


@pytest.mark.parametrize(
    "fields, line",
    [
        ({"risk": 0.0}, "~risk must be in (0, 1), got 0.0"),
        ({"risk_edges": 0}, "~risk_edges must be >= 1, got 0"),
        ({"r_sigma_m": 0.0}, "~r_sigma_m must be finite and > 0, got 0.0"),
        ({"turn_sigma_rad": math.nan}, "~turn_sigma_rad must be finite and > 0, got nan"),
        ({"length_sigma_share": -0.1}, "~length_sigma_share must be finite and >= 0, got -0.1"),
    ],
)
def test_tolerances_that_mean_nothing_are_refused(fields: "dict[str, float]", line: str) -> None:
    with pytest.raises(ValueError) as refused:
        Tolerances(**fields)
    assert str(refused.value) == line


def bent() -> Matcher:
    """An edge of 5 m from (0, 0) that leaves eastward, ends at (3, 3) and arrives there going north."""
    atlas = made_atlases.atlas_of(
        np.array([[0.0, 0.0], [3.0, 3.0]]),
        np.array([1.0, 2.0]),
        np.array([[0, 1]]),
        np.array([5.0]),
        np.array([0.0, -np.pi / 2]),
    )
    return Matcher(atlas, Tolerances(), use_angles=True)


LIMIT_M = Tolerances().z * math.hypot(0.1 + 0.02 * 5.0, made_atlases.SIGMA_M)


@pytest.mark.parametrize("off", [-1.02, -0.98, 0.98, 1.02])
def test_lengths_and_chords_fit_within_their_tolerance(off: float) -> None:
    matcher, dart = bent(), np.array([0, 1])
    sigma = 0.2  # given, so that it does not move with the length
    limit = matcher.z * math.hypot(sigma, made_atlases.SIGMA_M)
    fits = len(dart) if abs(off) < 1.0 else 0
    chord = math.sqrt(18.0)
    assert len(matcher.edges_along(dart, Traversal(0, 5.0 + off * limit, chord, sigma, sigma))) == fits
    assert len(matcher.edges_along(dart, Traversal(0, 5.0, chord + off * limit, sigma, sigma))) == fits
    joined = matcher.paths_along(
        dart,
        dart ^ 1,
        np.full(2, 5.0),
        np.full(2, made_atlases.SIGMA_M),
        Traversal(0, 5.0, chord + off * limit, sigma, sigma),
    )
    assert joined.sum() == fits
    assert len(matcher.edges_along(dart, Traversal(0, 5.0, math.nan, sigma))) == 2  # no chord was measured


def test_a_bend_fits_in_the_direction_in_which_it_was_driven() -> None:
    matcher, chord = bent(), math.sqrt(18.0)
    # There: the chord is 45 degrees to the left, arrival 90 to the left; back: 45 and 90 to the right.
    left = Traversal(0, 5.0, chord, chord_bearing_rad=math.pi / 4, turn_rad=math.pi / 2)
    right = Traversal(0, 5.0, chord, chord_bearing_rad=-math.pi / 4, turn_rad=-math.pi / 2)
    assert matcher.edges_along(np.array([0, 1]), left).tolist() == [0]
    assert matcher.edges_along(np.array([0, 1]), right).tolist() == [1]
    blind = Matcher(matcher.atlas, Tolerances(), use_angles=False)
    assert blind.edges_along(np.array([0, 1]), left).tolist() == [0, 1]


def test_near_its_beginning_a_way_has_no_direction() -> None:
    atlas = made_atlases.atlas_of(
        np.array([[0.0, 0.0], [0.3, 0.0]]), np.ones(2), np.array([[0, 1]]), np.array([6.0]), np.array([0.0, 0.0])
    )
    matcher = Matcher(atlas, Tolerances(), use_angles=True)
    backward = Traversal(0, 6.0, 0.2, chord_bearing_rad=math.pi, turn_rad=math.pi)
    assert matcher.edges_along(np.array([0]), backward).tolist() == [0]


def test_nodes_fit_by_degree_r_and_angles() -> None:
    atlas = made_atlases.corridors([(0, 0), (6, 0), (0, 6), (-6, 0)], [1.0, 1.0, 1.1, 2.0], [(0, 1), (0, 2), (0, 3)])
    matcher = Matcher(atlas, Tolerances(), use_angles=True)
    assert matcher.all_at(Meetpoint(1, 1.05)).tolist() == [1, 3]
    assert matcher.all_at(Meetpoint(3, 1.0)).tolist() == [0, 2, 4]
    assert matcher.all_at(Meetpoint(2, 1.0)).tolist() == []
    # A T junction met from its foot (dart 2, north): one way to the left, one to the right, none straight on.
    from_foot = Meetpoint(3, 1.0, bearings_rad=np.array([np.pi, np.pi / 2, -np.pi / 2]))
    assert matcher.all_at(from_foot).tolist() == [2]
    assert matcher.at(np.array([0, 1, 2, 4]), from_foot).tolist() == [False, False, True, False]


@pytest.mark.parametrize("seed", range(5))
def test_all_darts_that_fit_are_found(seed: int) -> None:
    """Property: the index by degree and r gives what trying every dart gives."""
    atlas = made_atlases.voronoi(300, seed)
    matcher = Matcher(atlas, Tolerances(), use_angles=True)
    everything = np.arange(len(atlas.darts))
    for dart in everything[::37].tolist():
        node = int(atlas.darts.node[dart])
        ring = atlas.clockwise(np.full(len(atlas.rings[node]), dart), np.arange(len(atlas.rings[node])))
        gaps = np.mod(atlas.darts.bearing_rad[dart] - atlas.darts.bearing_rad[ring], 2 * np.pi)
        seen = Meetpoint(len(ring), float(atlas.nodes.r_m[node]), bearings_rad=np.pi - gaps)
        found = matcher.all_at(seen)
        assert dart in found
        np.testing.assert_array_equal(found, everything[matcher.at(everything, seen)])


@pytest.mark.parametrize("seed", range(10))
def test_departures_are_those_of_the_rotation_system(seed: int) -> None:
    atlas = made_atlases.rotation_system(np.random.default_rng(seed))
    matcher = Matcher(atlas, Tolerances(), use_angles=False)
    for degree in np.unique(atlas.degree).tolist():
        darts = np.flatnonzero(atlas.degree[atlas.darts.node] == degree)
        for rank in range(degree):
            np.testing.assert_array_equal(matcher.departures(darts, rank), atlas.clockwise(darts, np.array(rank)))
    others, beside = matcher.others(np.arange(len(atlas.darts)))
    pairs = set(zip(beside.tolist(), others.tolist()))
    assert len(pairs) == len(others)
    assert pairs == {
        (a, b)
        for ring in (atlas.rings[n].tolist() for n in range(len(atlas.nodes)))
        for a in ring
        for b in ring
        if a != b
    }


def test_what_is_alike_is_what_a_robot_without_errors_would_not_rule_out() -> None:
    """Second way: observe the first dart exactly, test the second as an observation."""
    atlas = made_atlases.voronoi(120, 8)
    matcher = Matcher(atlas, Tolerances(), use_angles=False)
    darts = np.arange(len(atlas.darts))
    for first in darts[::11].tolist():
        seen = Traversal(0, float(atlas.edges.length_m[first >> 1]), float(atlas.edges.chord_m[first >> 1]))
        node = int(atlas.darts.node[first ^ 1])
        end = Meetpoint(len(atlas.rings[node]), float(atlas.nodes.r_m[node]))
        along = np.isin(darts, matcher.edges_along(darts, seen))
        np.testing.assert_array_equal(matcher.alike_along(np.array(first), darts), along & matcher.at(darts ^ 1, end))


def test_a_candidate_stands_where_its_meetpoint_and_the_edge_behind_it_say() -> None:
    """Second way: what the robot saw, put where its pose says, is the node and the direction of the dart."""
    rng = np.random.default_rng(0)
    atlas = made_atlases.voronoi(40, 2)
    for dart in range(0, len(atlas.darts), 7):
        degree = int(atlas.degree[atlas.darts.node[dart]])
        first = rng.uniform(-np.pi, np.pi)
        bearings = first - np.linspace(0.0, 5.0, degree)
        seen = Meetpoint(degree, 1.0, bearings_rad=bearings, centre_m=rng.normal(0.0, 0.3, 2))
        ((x, y, yaw),) = poses_at(atlas, np.array([dart]), seen)
        cos, sin = math.cos(yaw), math.sin(yaw)
        centre = [
            x + cos * seen.centre_m[0] - sin * seen.centre_m[1],
            y + sin * seen.centre_m[0] + cos * seen.centre_m[1],
        ]
        np.testing.assert_allclose(centre, atlas.nodes.position_m[atlas.darts.node[dart]], atol=1e-9)
        assert math.remainder(yaw + first - float(atlas.darts.bearing_rad[dart]), 2 * np.pi) == pytest.approx(
            0.0, abs=1e-9
        )
