"""The lidar preset "sensitive" against real glass: 30 labelled frames of nine rings, one pane 5.05 m ahead.

INDEX.md beside the data tells where they are from. A beam reaches the pane unless something stands before it or is
part of its frame; the share of those that come back from the glass is what is compared, by incidence. Beams that
nothing came back from are not in the file: they are counted by the spacing of the beams, 0.6 degrees.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Dict

import numpy as np
import pytest

from glass_nav.simulation import lidar
from glass_nav.simulation.building import Building, Pane, Wall
from glass_nav.vocabulary import BeamCase

PANE_M = 5.05
BINS_DEG = np.arange(0.0, 45.0, 5.0)  # edges; from 40 degrees on the pane ends
ORDINARY, GLASS = 1, 2  # labels
SPACING_DEG, FRAMES, RINGS = 0.6, 30, 9
AT_PANE_M = 0.2  # along the pane's normal: its frame, and what is no nearer
TOLERANCE = 0.12  # the two sides of the pane differ by up to 0.3 beyond 15 degrees


@pytest.fixture
def returns(data_dir: Path) -> Dict[str, np.ndarray]:
    """Columns (N,) of all first returns: bearing [rad], range_xy [m], label, ..."""
    with np.load(data_dir / "glass_3dref" / "rings.npz") as file:
        columns = dict(zip(file["columns"].tolist(), file["data"].T))
    first = columns["return_no"] == 1
    return {name: column[first] for name, column in columns.items()}


def real_shares(returns: Dict[str, np.ndarray]) -> np.ndarray:
    """(bins,) share of the beams reaching the pane that come back from it."""
    incidence_deg = np.abs(np.rad2deg(returns["bearing"]))
    ahead_m = returns["range_xy"] * np.cos(returns["bearing"])
    glass = returns["label"] == GLASS
    stopped = ~glass & (
        (ahead_m < PANE_M - AT_PANE_M) | (np.abs(ahead_m - PANE_M) <= AT_PANE_M) & (returns["label"] == ORDINARY)
    )
    sent = 2.0 * np.diff(BINS_DEG) / SPACING_DEG * FRAMES * RINGS
    count = [np.histogram(incidence_deg[which], BINS_DEG)[0] for which in (glass, stopped)]
    return count[0] / (sent - count[1])


def simulated_shares() -> np.ndarray:
    """(bins,) the same of the preset: a wide pane, a wall 6 m behind it, thirty frames."""
    box_m = np.array([[-1.0, -12.0], [11.0, -12.0], [11.0, 12.0], [-1.0, 12.0], [-1.0, -12.0]])
    building = Building(
        (Wall(box_m),), (Pane(np.array([[PANE_M, -12.0], [PANE_M, 12.0]])),), seen_m=np.array([[8.0, 0.0]])
    )
    model = replace(lidar.preset("sensitive"), beams=1801, field_of_view_rad=np.deg2rad(90.0))
    rng = np.random.default_rng(0)
    case = np.stack([lidar.scan(model, building, np.zeros(3), 0.0, rng).case for _ in range(FRAMES)])
    incidence_deg = np.broadcast_to(np.abs(np.rad2deg(model.angles_rad)), case.shape)
    returned, sent = (
        np.histogram(values, BINS_DEG)[0] for values in (incidence_deg[case == BeamCase.DIFFUSE], incidence_deg)
    )
    return returned / sent


def test_the_preset_sees_a_pane_as_often_as_a_real_lidar_does(returns: Dict[str, np.ndarray]) -> None:
    real, simulated = real_shares(returns), simulated_shares()
    print("incidence from [deg]", BINS_DEG[:-1], "real", real.round(2), "simulated", simulated.round(2))
    assert real[:2].min() > 0.9 and real[5:].max() < 0.25  # the data are those meant
    np.testing.assert_allclose(simulated, real, rtol=0.0, atol=TOLERANCE)
