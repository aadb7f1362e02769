"""Panes that the map lacks are found; things, people and chance are not."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import List

import made_pane_drive
import numpy as np
import pytest
from made_pane_drive import SURE, hall

import glass_nav.panes.pane_finder as module
from glass_nav.panes.pane_finder import PaneFinder, PaneFinderParams
from glass_nav.world.drawn_panes import drawn
from glass_nav.world.grid_map import GridMap
from glass_nav.world.pane import Pane


def found(*looks: made_pane_drive.Look, grid_map: "GridMap | None" = None, y_m: float = 1.0) -> List[Pane]:
    finder = PaneFinder(hall() if grid_map is None else grid_map)
    for scan, pose in made_pane_drive.scans(*looks, y_m=y_m):
        finder.observe(scan, pose, SURE)
    return [pane for pane in finder.panes() if pane.probability > 0.5]


def test_a_pane_is_found_where_it_is() -> None:
    (pane,) = found(made_pane_drive.pane((3.0, 2.5), (7.0, 2.5)))
    assert pane.probability > 0.95
    assert sorted([pane.start_m[0], pane.end_m[0]]) == pytest.approx([3.0, 7.0], abs=0.12)
    assert [pane.start_m[1], pane.end_m[1]] == pytest.approx([2.5, 2.5], abs=0.03)
    assert pane.returns > 20
    assert pane.passes > 100
    assert pane.seen_from_m > 3.0


def probability(intensity: "float | None") -> float:
    """Of a pane seen for a short way whose returns are so bright; those of walls are 100 to 120."""
    glass = made_pane_drive.pane((4.0, 2.5), (4.8, 2.5), 0.3)
    finder, rng = PaneFinder(hall()), np.random.default_rng(0)
    for _ in range(3):
        for scan, pose in made_pane_drive.scans(glass):
            if intensity is not None:
                at_glass = scan.ranges_m < made_pane_drive.wall_ranges(pose) - 0.1
                brightness = np.where(at_glass, intensity, rng.uniform(100.0, 120.0, len(scan)))
                scan = replace(scan, intensities=np.full(len(scan), 47.0) if intensity == 47.0 else brightness)
            finder.observe(scan, pose, SURE)
    (pane,) = finder.panes()
    return pane.probability


def test_bright_returns_make_a_pane_more_probable_and_constant_ones_change_nothing() -> None:
    without = probability(None)
    assert probability(300.0) > without > probability(110.0)
    assert probability(47.0) == without


def test_a_slanted_pane_has_its_direction() -> None:
    (pane,) = found(made_pane_drive.pane((3.0, 2.2), (7.0, 3.0)))
    assert abs(pane.direction[1] / pane.direction[0]) == pytest.approx(0.2, abs=0.02)


@pytest.mark.parametrize(
    "look",
    [
        pytest.param(made_pane_drive.wall((3.0, 2.5), (7.0, 2.5)), id="a new wall"),
        pytest.param(made_pane_drive.wall((4.0, 2.5), (4.8, 2.6)), id="a cupboard"),
        pytest.param(made_pane_drive.post((5.0, 2.5)), id="a pillar"),
        pytest.param(lambda pose, rng: np.where(rng.random(541) < 0.02, rng.uniform(0.5, 4.0, 541), np.inf), id="dust"),
    ],
)
def test_what_is_no_pane_is_not_found(look: made_pane_drive.Look) -> None:
    assert found(look) == []


@pytest.mark.parametrize("speed", [0.0, 0.5, -1.0, 1.5])
def test_a_person_who_walks_along_is_no_pane(speed: float) -> None:
    """The robot drives 0.1 m from scan to scan; the person walks in the same direction or towards it."""

    def look(pose: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        return made_pane_drive.post((4.0 + speed * (pose[0] - 4.0), 2.2), 0.25)(pose, rng)

    assert found(look) == []


def test_a_pane_on_the_map_is_not_found_again() -> None:
    look = made_pane_drive.pane((3.0, 2.5), (7.0, 2.5))
    assert found(look, grid_map=drawn(hall(), found(look))) == []


def test_panes_are_joined_over_a_mullion_but_not_over_a_doorway() -> None:
    glass = made_pane_drive.pane((2.0, 2.5), (4.0, 2.5)), made_pane_drive.pane((4.15, 2.5), (5.0, 2.5))
    mullion, after_a_door = made_pane_drive.wall((4.0, 2.5), (4.15, 2.5)), made_pane_drive.pane((6.0, 2.5), (8.0, 2.5))
    grid_map = hall()
    grid_map.occupancy[50:52, 81:84] = 100
    lengths = sorted(pane.length_m for pane in found(*glass, mullion, after_a_door, grid_map=grid_map))
    assert lengths == pytest.approx([2.0, 3.0], abs=0.2)


def test_a_pane_goes_up_to_the_wall_that_it_nearly_meets() -> None:
    grid_map = hall()
    grid_map.occupancy[:, 60:62] = 100  # x = 2.95 to 3.05 m
    (pane,) = found(made_pane_drive.pane((3.25, 2.5), (7.0, 2.5)), grid_map=grid_map)
    assert min(pane.start_m[0], pane.end_m[0]) == pytest.approx(3.05, abs=0.05)


def test_a_thing_whose_edges_let_beams_pass_is_no_pane() -> None:
    grid_map = hall()
    grid_map.occupancy[50:52, 81:83] = grid_map.occupancy[50:52, 99:101] = 100  # posts beside it
    edges = [made_pane_drive.pane((x_m, 2.5), (x_m + 0.1, 2.5), 0.2) for x_m in (4.3, 4.7)]
    assert found(made_pane_drive.wall((4.4, 2.5), (4.7, 2.5)), *edges, grid_map=grid_map) == []


def test_specks_that_a_mapper_left_do_not_hide_the_pane() -> None:
    grid_map = hall()
    grid_map.occupancy[51, 65:140:9] = 100  # on the line of the pane, a cell each
    (pane,) = found(made_pane_drive.pane((3.0, 2.525), (7.0, 2.525)), grid_map=grid_map)
    assert pane.length_m == pytest.approx(4.0, abs=0.2)


@pytest.mark.parametrize(
    "covariance", [np.diag([0.04, 0.0, 0.0]), np.diag([0.0, 0.0, 0.01])], ids=["position", "heading"]
)
def test_an_uncertain_pose_teaches_nothing(covariance: np.ndarray) -> None:
    finder = PaneFinder(hall())
    for scan, pose in made_pane_drive.scans(made_pane_drive.pane((3.0, 2.5), (7.0, 2.5))):
        assert not finder.observe(scan, pose, covariance)
    assert finder.panes() == []


def test_a_robot_that_stands_keeps_one_scan() -> None:
    finder = PaneFinder(hall())
    scan, pose = next(iter(made_pane_drive.scans()))
    assert [finder.observe(scan, pose, SURE) for _ in range(5)] == [True, False, False, False, False]


def test_it_is_due_after_some_way_and_not_again_at_once() -> None:
    finder = PaneFinder(hall())
    for scan, pose in made_pane_drive.scans():
        finder.observe(scan, pose, SURE)
    assert finder.due
    finder.panes()
    assert not finder.due


def test_a_pane_is_remembered_when_its_scans_were_dropped() -> None:
    finder = PaneFinder(hall(), PaneFinderParams(pane_max_scans=60))
    for scan, pose in made_pane_drive.scans(made_pane_drive.pane((2.0, 2.5), (4.0, 2.5))):
        finder.observe(scan, pose, SURE)
        finder.panes() if finder.due else None
    assert len(finder._scans) == 60
    assert [round(pane.length_m) for pane in finder.panes() if pane.probability > 0.5] == [2]


def test_a_known_pane_stays_until_beams_contradict_it() -> None:
    known = Pane(np.array([3.0, 2.5]), np.array([7.0, 2.5]), 0.9)
    finder = PaneFinder(hall(), known=[known])
    assert finder.panes() == [known]
    for scan, pose in made_pane_drive.scans():  # nothing stands there
        finder.observe(scan, pose, SURE)
    assert all(pane.probability < 0.5 for pane in finder.panes())


def test_a_known_pane_is_found_again_once() -> None:
    known = Pane(np.array([3.0, 2.5]), np.array([7.0, 2.5]), 0.9)
    finder = PaneFinder(hall(), known=[known])
    for scan, pose in itertools.islice(made_pane_drive.scans(made_pane_drive.pane((3.0, 2.5), (7.0, 2.5))), 40):
        finder.observe(scan, pose, SURE)
    assert len([pane for pane in finder.panes() if pane.probability > 0.5]) == 1


@pytest.mark.parametrize(
    "name, value, message",
    [
        ("pane_prior", 1.0, "must be in \\(0, 1\\), got 1.0"),
        ("pane_reach_m", 0.0, "must be finite and > 0, got 0.0"),
        ("pane_join_m", -1.0, "must be finite and >= 0 m, got -1.0"),
        ("pane_max_scans", 0, "must be >= 1, got 0"),
    ],
)
def test_a_bad_parameter_is_refused(name: str, value: float, message: str) -> None:
    with pytest.raises(ValueError, match=f"~{name} {message}"):
        module.PaneFinderParams(**{name: value})  # type: ignore[arg-type]


def test_looking_again_only_where_the_robot_was_finds_the_same() -> None:
    looks = made_pane_drive.pane((1.5, 2.5), (4.0, 2.5)), made_pane_drive.pane((6.0, 2.5), (8.0, 2.5))
    finder = PaneFinder(hall(), PaneFinderParams(pane_reach_m=2.0))
    for scan, pose in made_pane_drive.scans(*looks):
        finder.observe(scan, pose, SURE)
        finder.panes() if finder.due else None
    bit_by_bit, at_once = (
        sorted(pane.length_m for pane in finder.panes(anew) if pane.probability > 0.5) for anew in (False, True)
    )
    assert bit_by_bit == pytest.approx(at_once, abs=0.25)
    assert at_once == pytest.approx([2.0, 2.5], abs=0.25)
