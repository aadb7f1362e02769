"""Real logs through `glass_nav replay`, each held to a line of the table. The whole of it takes about two minutes.

The reference of the bags is another estimator's, see INDEX.md beside the data; AMCL's figures there are the
measure for rmse and for the share of scans more than 1 m off. All logs and seeds: test/benchmark/replay_logs.py.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Callable, Dict, NamedTuple, Optional

import numpy as np
import pytest

from glass_nav.cli.main import main

MRPT_DATASETS = Path("/usr/share/mrpt/datasets")  # apt: mrpt-common


class Limits(NamedTuple):
    """Not more than this."""

    scans: int  # of the log: every one is used
    median_m: float
    rmse_m: float
    p95_m: float
    yaw_mean_deg: float
    lost_1m_share: float
    duration_s: Optional[float] = None  # of the log that is replayed; None: all


# A third above what the filter does on these, and within AMCL's figures (test/benchmark/replay_logs.py), except on
# olin_mac, whose reference is 0.16 m off the map while the robot stands at the start: how far the filter follows the
# map there depends on the seed (rmse 0.058 to 0.094), so its median is what tells.
TABLE = {
    "uob_trace0": Limits(958, 0.025, 0.035, 0.070, 0.6, 0.0),
    "olin_mac": Limits(357, 0.025, 0.105, 0.190, 0.8, 0.0),
    # Then the wheels lock and the car slides on: the filter follows the scans, which fit; the reference stays behind.
    "mit_racecar2": Limits(304, 0.050, 0.078, 0.130, 0.9, 0.0, duration_s=7.6),
    "seattle": Limits(240, 0.020, 0.110, 0.040, 0.7, 0.0084),
    "aces": Limits(440, 0.025, 0.040, 0.080, 0.25, 0.0),
    "wean4": Limits(600, 0.190, 0.229, 0.400, 1.6, 0.0),
}
# The ground truth is rotated against the map by 1.2 degrees, which makes up the median; seeds differ by 5 mm around 0.120.
UWB = Limits(343, 0.125, 0.153, 0.250, 1.5, 0.0)


@pytest.fixture
def replay(tmp_path: Path) -> Callable[..., Dict[str, Any]]:
    """replay(log, map, options): metrics.json of a run with seed 0."""

    def run(log: Path, grid: Path, *options: str) -> Dict[str, Any]:
        assert main(["replay", str(log), "--map", str(grid), "--out", str(tmp_path), *options]) == 0
        figures: Dict[str, Any] = json.loads((tmp_path / "metrics.json").read_text())
        return figures

    return run


def check(figures: Dict[str, Any], limits: Limits, out: Path) -> None:
    print(
        {
            name: figures[name]
            for name in (
                "position_median_m",
                "position_rmse_m",
                "position_p95_m",
                "yaw_mean_deg",
                "lost_1m_share",
                "cpu_ms_per_scan",
            )
        }
    )
    assert (figures["scans"], figures["scans_refused"]) == (limits.scans, 0)
    assert figures["lost_1m_share"] <= limits.lost_1m_share
    assert figures["position_rmse_m"] <= limits.rmse_m
    assert figures["position_median_m"] <= limits.median_m
    assert figures["position_p95_m"] <= limits.p95_m
    assert figures["yaw_mean_deg"] <= limits.yaw_mean_deg
    with np.load(out / "beam_cases.npz") as cases:
        assert cases["cases"].shape[0] == limits.scans
    assert (out / "trajectory.png").stat().st_size > 10_000


@pytest.mark.parametrize("log", list(TABLE))
def test_a_real_bag_is_tracked(data_dir: Path, replay: Callable[..., Dict[str, Any]], tmp_path: Path, log: str) -> None:
    folder, limits = data_dir / "logs" / log, TABLE[log]
    part = () if limits.duration_s is None else ("--duration", str(limits.duration_s))
    check(replay(folder / f"{log}.bag", folder / "map.yaml", *part), limits, tmp_path)


@pytest.mark.skipif(not MRPT_DATASETS.is_dir(), reason="apt's mrpt-common is not installed")
def test_the_rawlog_of_mrpt_is_tracked(replay: Callable[..., Dict[str, Any]], tmp_path: Path) -> None:
    stem = MRPT_DATASETS / "uwb_ro-localization_demo"
    check(replay(stem.with_suffix(".rawlog"), stem.with_name(f"{stem.name}_map.gridmap.gz")), UWB, tmp_path)
