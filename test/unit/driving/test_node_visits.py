"""A robot that knows its pose is moved through a T, and past where its map has more than there is."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import List

import numpy as np
import pytest
from made_buildings import T_MEETPOINT, T_R_M, W, scan_at, t_corridor, walled

from glass_nav.driving import node_visits
from glass_nav.driving.node_visits import NodeVisit, VisitWatch
from glass_nav.simulation import building_map
from glass_nav.simulation.building import Building
from glass_nav.topology.atlas import atlas_builder
from glass_nav.topology.atlas.atlas import Atlas

ODOM_FROM_MAP = np.array([3.0, -2.0, 0.0])  # odometry began elsewhere


@pytest.fixture(scope="module")
def atlas() -> Atlas:
    building = replace(
        t_corridor(), start=np.array([2.0, 1.0, 0.0]), seen_m=np.array([[2.0, 1.0], [6.0, -4.0]]), name="t"
    )
    return atlas_builder.build(building_map.draw(building), "t", "t")[0]


def junction(atlas: Atlas) -> int:
    return int(np.hypot(*(atlas.nodes.position_m - T_MEETPOINT).T).argmin())


def along_corridor(atlas: Atlas, building: Building) -> List[NodeVisit]:
    """What a drive along x finds, from before the junction until far behind it."""
    watch, rng = VisitWatch(atlas), np.random.default_rng(0)
    for number, x in enumerate(np.arange(4.0, 9.0, 0.15)):
        pose = np.array([x, 0.5 * W, 0.0])
        watch.see(scan_at(building, tuple(pose), rng, 0.2 * number), pose + ODOM_FROM_MAP, pose)
    visits = watch.take()
    assert not watch.take()
    return visits


@pytest.mark.long_run
def test_the_node_that_it_drives_past_is_seen_as_the_map_has_it(atlas: Atlas) -> None:
    visits = [visit for visit in along_corridor(atlas, t_corridor()) if visit.node == junction(atlas)]
    assert len(visits) == 1
    assert visits[0].r_m == pytest.approx(T_R_M, abs=0.08)


@pytest.mark.long_run
def test_a_node_that_is_not_there_is_missed(atlas: Atlas) -> None:
    """The side corridor is walled off."""
    straight = walled(np.array([[0.0, 0.0], [12.0, 0.0], [12.0, W], [0.0, W]]))
    visits = along_corridor(atlas, straight)
    assert [visit.node for visit in visits] == [junction(atlas)] and math.isnan(visits[0].r_m)


@pytest.mark.long_run
def test_what_is_seen_otherwise_is_neither_a_visit_nor_a_miss(atlas: Atlas, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(node_visits.PassingObserver, "counts", lambda observer, node: False)
    assert not along_corridor(atlas, t_corridor())


def test_a_drive_without_scans_passes_nothing(atlas: Atlas) -> None:
    assert VisitWatch(atlas).take() == []
