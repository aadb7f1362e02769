"""What a person sees of a search before the pose is known."""

from __future__ import annotations

from typing import Dict, List, Optional, Tuple, Union

import made_atlases
import numpy as np
import pytest

from glass_nav.geometry import se2
from glass_nav.shapes import Shape, Text
from glass_nav.topology import search_scene
from glass_nav.topology.observations import Meetpoint, Traversal
from glass_nav.topology.search.atlas_localizer import AtlasLocalizer
from glass_nav.topology.search.belief import Belief
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.topology.search_scene import SearchScene

ATLAS = made_atlases.corridors([(0, 0), (6, 0), (14, 0), (6, 5)], [0.9, 1.3, 1.7, 0.6], [(0, 1), (1, 2), (1, 3)])
NONE = np.zeros(0, np.int64)


def belief_of(poses: List[List[float]], share: List[float], odom: Optional[np.ndarray] = None) -> Belief:
    count = len(share)
    none = np.zeros(count)
    return Belief(odom, np.array(poses), np.array(share), 1 - sum(share), none, none, none, none, np.full(count, -1))


def drawn(shapes: List[Union[Shape, Text]]) -> Tuple[Dict[str, np.ndarray], Dict[str, List[str]]]:
    """Points, and texts that are not empty, by namespace."""
    points = {each.namespace: each.points_m for each in shapes if isinstance(each, Shape)}
    texts: Dict[str, List[str]] = {}
    for each in shapes:
        if isinstance(each, Text) and each.text:
            texts.setdefault(each.namespace, []).append(each.text)
    return points, texts


def test_without_anything_known_everything_is_cleared() -> None:
    points, texts = drawn(SearchScene().shapes(ATLAS, None, NONE))
    assert set(points) == {"hypotheses", "scans", "driven", "ruled_out"} and not texts
    assert not any(len(each) for each in points.values())


def test_hypotheses_are_robots_with_their_share_and_move_on_with_dead_reckoning() -> None:
    scene = SearchScene()
    scene.saw(np.zeros((0, 2)), np.array([2.0, 0.0, 0.0]))
    belief = belief_of([[5.0, 1.0, 0.0], [9.0, 1.0, np.pi / 2]], [0.7, 0.25], np.array([1.0, 0.0, 0.0]))
    points, texts = drawn(scene.shapes(ATLAS, belief, NONE))
    assert texts["hypotheses"] == ["70 %", "25 %"]
    first, second = np.split(points["hypotheses"], 2)
    np.testing.assert_allclose(first[:-2].mean(axis=0), [6.0, 1.0], atol=0.02)  # 1 m driven since
    np.testing.assert_allclose(second[:-2].mean(axis=0), [9.0, 2.0], atol=0.02)


def test_the_scan_and_the_driven_path_are_laid_over_the_best_three() -> None:
    scene = SearchScene()
    for x in (0.0, 0.5, 1.0):
        scene.saw(np.array([[2.0, 0.0], [2.0, 1.0]]), np.array([x, 0.0, 0.0]))
    poses = [[4.0 * k, 1.0, 0.5 * k] for k in range(5)]
    points, _ = drawn(scene.shapes(ATLAS, belief_of(poses, [0.2] * 5, np.array([1.0, 0.0, 0.0])), NONE))
    assert len(points["scans"]) == 3 * 2
    np.testing.assert_allclose(
        points["scans"][2:4], se2.transform_points(np.array(poses[1]), np.array([[2, 0], [2, 1]]))
    )
    assert len(points["driven"]) == 3 * 4  # pairs of ends
    np.testing.assert_allclose(points["driven"][:4], [[-1.0, 1.0], [-0.5, 1.0], [-0.5, 1.0], [0.0, 1.0]], atol=1e-9)


def test_a_hypothesis_that_is_as_good_as_ruled_out_is_not_drawn() -> None:
    belief = belief_of([[5.0, 1.0, 0.0], [9.0, 1.0, 0.0]], [0.99, 0.001])
    _, texts = drawn(SearchScene().shapes(ATLAS, belief, NONE))
    assert texts["hypotheses"] == ["99 %"]


def test_no_cross_stands_on_a_candidate_that_is_alive_and_each_says_why_it_went() -> None:
    localizer, scene = AtlasLocalizer(ATLAS, SearchParams(max_detection_errors=0)), SearchScene()
    estimate = localizer.start(Meetpoint(1, 0.9))
    scene.stepped(localizer)
    points, texts = drawn(scene.shapes(ATLAS, None, estimate.dart))
    centres = points["ruled_out"].reshape(-1, 4, 2).mean(axis=1)
    np.testing.assert_allclose(centres, [[6, 0], [14, 0], [6, 5]], atol=1e-9)  # node 0 is left
    assert texts["ruled_out"] == ["degree 3, seen 1", "r 1.70 m, seen 0.90 m", "r 0.60 m, seen 0.90 m"]
    assert texts["rows"] == [
        "depth 0: degree 1, r 0.90 m | 0 | 1 x (degree 3, seen 1), 2 x (r 1.70 m, seen 0.90 m) and 1 more"
    ]


def test_each_step_adds_a_row_and_another_search_begins_with_none() -> None:
    localizer, scene = AtlasLocalizer(ATLAS, SearchParams(max_detection_errors=0)), SearchScene()
    localizer.start(Meetpoint(1, 0.9))
    scene.stepped(localizer)
    scene.stepped(localizer)
    localizer.update(Traversal(0, 6.0, 6.0), Meetpoint(3, 1.3))
    scene.stepped(localizer)
    _, texts = drawn(scene.shapes(ATLAS, None, NONE))
    assert [row.split(":")[0] for row in texts["rows"]] == ["depth 0", "depth 1"]
    localizer.start(Meetpoint(1, 0.9))
    scene.stepped(localizer)
    assert len(drawn(scene.shapes(ATLAS, None, NONE))[1]["rows"]) == 1
    scene.forget()
    assert not scene.ruled_out and not drawn(scene.shapes(ATLAS, None, NONE))[1]


def test_letters_can_be_read_where_all_of_the_map_is_seen() -> None:
    assert search_scene.letter_size_m(ATLAS) == pytest.approx(0.3)
