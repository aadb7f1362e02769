"""The comparison with other localizers: what they are started with, and the lines of its table."""

from __future__ import annotations

import configparser
import sys
from pathlib import Path

import numpy as np
import pytest

from glass_nav.world.grid_map import GridMap

REPO = Path(__file__).resolve().parents[3]
sys.path.append(str(REPO / "test" / "benchmark"))

import against_peers  # noqa: E402
import pf_localization  # noqa: E402
from against_peers import Figures  # noqa: E402


def test_particles_of_the_other_begin_around_the_pose_and_not_anywhere(tmp_path):
    grid_map = GridMap(np.zeros((40, 60), np.int8), 0.05, np.zeros(3))
    settings = pf_localization.settings_with(against_peers.PF_CHANGES)
    text = against_peers.started_around(
        pf_localization.config_text(tmp_path, grid_map, settings), np.array([1.0, 2.0, np.pi / 2.0])
    )
    config = configparser.ConfigParser(strict=True)  # refuses a value that is there twice
    config.read_string(text)
    found = config["LocalizationExperiment"]
    assert found["init_PDF_mode"] == "1"
    assert [float(found[f"init_PDF_{end}_x"]) for end in ("min", "max")] == pytest.approx([0.5, 1.5])
    assert [float(found[f"init_PDF_{end}_y"]) for end in ("min", "max")] == pytest.approx([1.5, 2.5])
    assert [float(found[f"init_PDF_{end}_phi_deg"]) for end in ("min", "max")] == pytest.approx([75.0, 105.0])
    assert found["particles_count"] == str(against_peers.PARTICLES)


def test_a_line_has_the_ratio_to_the_other_where_it_ran():
    ours, other = Figures(6.0, 90.0, 12, 0.0123, 0.02), Figures(4.0, 140.0, 12, 0.1, 0.2)
    assert against_peers.row("hall", "ours", ours, other) == "| hall | ours | 6.0 | 1.50 | 90 | 12 | 0.012 | 0.020 |"
    assert against_peers.row("hall", "ours", ours, None).count("|  |") == 1
