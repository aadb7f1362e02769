"""The simulated robot against geometry."""

from __future__ import annotations

import math

import made_atlases
import numpy as np
import pytest

from glass_nav.geometry import angles
from glass_nav.topology.search.atlas_robot import AtlasRobot, Surroundings, TrialParams


@pytest.mark.parametrize("seed", range(10))
def test_what_the_robot_adds_up_by_dead_reckoning_is_the_geometry_of_the_atlas(seed: int) -> None:
    """Property: also over edges that missed meetpoints join, the chord leads from node to node."""
    rng = np.random.default_rng(seed)
    atlas = made_atlases.voronoi(80, seed)
    robot = AtlasRobot(Surroundings.of(atlas), TrialParams(noise_limit=0.0, missed=0.4), rng)
    here = robot.wake_up()
    joined = 0
    for _ in range(40):
        came, errors, rank = robot.dart, robot.detection_errors, int(rng.integers(here.degree))
        departure = int(atlas.clockwise(np.array(came), np.array(rank)))
        traversal, here = robot.drive(rank)
        joined += robot.detection_errors > errors
        start, end = atlas.nodes.position_m[atlas.darts.node[[departure, robot.dart]]]
        step = end - start
        assert traversal.chord_m == pytest.approx(math.hypot(*step), abs=1e-9)
        if traversal.chord_m > 0.01:
            ahead = math.atan2(step[1], step[0]) - atlas.darts.bearing_rad[departure]
            assert abs(angles.wrap(ahead - traversal.chord_bearing_rad)) < 1e-6
        turned = atlas.darts.bearing_rad[robot.dart] + np.pi - atlas.darts.bearing_rad[departure]
        assert abs(angles.wrap(turned - traversal.turn_rad)) < 1e-9
        assert (here.degree, here.r_m) == (
            len(atlas.rings[int(atlas.darts.node[robot.dart])]),
            atlas.nodes.r_m[atlas.darts.node[robot.dart]],
        )
        gaps = (
            atlas.darts.bearing_rad[robot.dart]
            - atlas.darts.bearing_rad[atlas.clockwise(np.full(here.degree, robot.dart), np.arange(here.degree))]
        )
        np.testing.assert_allclose(angles.wrap(here.gaps_rad - gaps), 0.0, atol=1e-6)
    assert joined > 5


def test_an_edge_that_is_split_adds_up_to_itself() -> None:
    atlas = made_atlases.corridors([(0, 0), (20, 0)], [1.0, 1.5], [(0, 1)])
    for seed in range(30):
        robot = AtlasRobot(
            Surroundings.of(atlas), TrialParams(noise_limit=0.0, spurious=0.5), np.random.default_rng(seed)
        )
        robot.wake_up(0)
        at, way = 0.0, 1.0
        for _ in range(10):
            turn = 0 if robot.on_edge == 0.0 or seed % 3 == 0 else 1
            way = -way if robot.on_edge and turn == 0 else way
            traversal, here = robot.drive(turn)
            at += way * traversal.length_m
            assert traversal.chord_m == pytest.approx(traversal.length_m)
            if robot.on_edge:
                travelled = 20.0 * robot.on_edge
                assert at == pytest.approx(travelled if robot.dart == 0 else 20.0 - travelled)
                assert here.degree in (1, 3)
            else:
                assert at == pytest.approx(20.0 if robot.dart == 1 else 0.0, abs=1e-9)
                way = -way


def test_shuffled_surroundings_have_the_same_parts() -> None:
    atlas = made_atlases.voronoi(200, 1)
    here = Surroundings.of(atlas)
    there = here.shuffled(np.random.default_rng(0))
    for name in ("r_m", "length_m", "chord_m", "chord_bearing_rad", "turn_rad"):
        one, other = getattr(here, name), getattr(there, name)
        np.testing.assert_array_equal(np.sort(one), np.sort(other))
        assert (one != other).mean() > 0.5
    np.testing.assert_allclose(np.sort(there.gap_rad), np.sort(here.gap_rad))


@pytest.mark.parametrize(
    "fields, line",
    [
        ({"missed": 1.0}, "missed must be in [0, 1), got 1.0"),
        ({"spurious": -0.1}, "spurious must be in [0, 1)"),
        ({"noise_gain": -1.0}, "noise_gain must be >= 0"),
        ({"max_edges": 0}, "max_edges must be >= 1, got 0"),
    ],
)
def test_trials_that_mean_nothing_are_refused(fields: "dict[str, float]", line: str) -> None:
    with pytest.raises(ValueError) as refused:
        TrialParams(**fields)  # type: ignore[arg-type]
    assert line in str(refused.value)
