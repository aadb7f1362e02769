"""Meetpoints on a real drive: `glass_nav replay --topology` on a short log."""

from __future__ import annotations

import csv
import json
from pathlib import Path

from glass_nav.cli.main import main


def test_a_robot_in_a_glass_lobby_sees_the_meetpoints_that_it_passes(data_dir: Path, tmp_path: Path, capsys) -> None:  # type: ignore[no-untyped-def]
    folder = data_dir / "logs" / "uob_trace0"
    assert (
        main(
            [
                "replay",
                str(folder / "uob_trace0.bag"),
                "--map",
                str(folder / "map.yaml"),
                "--out",
                str(tmp_path),
                "--every",
                "2",
                "--topology",
            ]
        )
        == 0
    )
    figures = json.loads((tmp_path / "metrics.json").read_text())["topology"]
    assert figures["passed"] >= 3
    assert figures["seen_share"] >= 0.6
    assert figures["invented"] <= 6  # the map has specks that this lidar does not see
    assert figures["position_off_m"]["median_abs"] <= 0.25
    with (tmp_path / "topology.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == figures["passed"] + figures["invented"]
    assert (tmp_path / "topology.png").stat().st_size > 10_000
    assert "topology" in capsys.readouterr().out
