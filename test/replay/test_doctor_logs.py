"""The doctor has nothing to say about logs that are good: real robots with their maps."""

from __future__ import annotations

from pathlib import Path

import pytest

from glass_nav.checkup import doctor
from glass_nav.recording import bag_observer
from glass_nav.world import map_file

LOGS = [
    "acapulco",
    "aces",
    "intel",
    "mit_csail",
    "mit_racecar2",
    "olin_mac",
    "seattle",
    "uob_trace0",
    "wean1",
    "wean2",
    "wean4",
]


@pytest.mark.parametrize("name", LOGS)
def test_nothing_is_found_in_a_good_log(data_dir: Path, name: str) -> None:
    folder = data_dir / "logs" / name
    report = doctor.examine(bag_observer.observe([folder / f"{name}.bag"]), map_file.load(folder / "map.yaml"))
    assert report.findings == []
