"""The benchmark of glass buildings on drives of a few scans: its figures go where they belong."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from glass_nav.evaluation.metrics import case_scores, replay_result
from glass_nav.evaluation.metrics.case_scores import SurfaceScores
from glass_nav.localization.localizer_params import LocalizerParams

REPO = Path(__file__).resolve().parents[3]
sys.path.append(str(REPO / "test" / "benchmark"))

import drives  # noqa: E402
import glass_buildings  # noqa: E402
from glass_buildings import Bar, Job, Run  # noqa: E402


def a_run(localizer="ours", building="hall", rmse_m=0.01, yaw_deg=0.1, told=(1, 3, 3, 3), lost=0.0):
    """Four beams: one diffuse, three behind a pane; all but what is told wrongly cut at it."""
    cases = case_scores.of_cases(np.array([1, 3, 3, 3]), np.array(told), np.ones(4, bool))
    pose = {"position_rmse_m": rmse_m, "position_median_m": rmse_m, "yaw_mean_deg": yaw_deg, "lost_share": lost}
    return Run(
        building,
        "weak",
        100,
        localizer,
        pose,
        cases if localizer.startswith("ours") else None,
        SurfaceScores(3, 3, 3, 1, 0, 1, 1) if localizer == "ours" else None,
        5,
        4,
        0.2,
    )


def test_a_drive_is_the_same_for_the_same_seed_and_another_for_another():
    ways = [
        np.array([frame.scan.ranges_m for frame in drives.drive("opaque_office", "weak", seed, 0.0, 2).frames])
        for seed in (1, 1, 2)
    ]
    assert ways[0].shape == (2, 541)
    np.testing.assert_array_equal(ways[0], ways[1])
    assert np.any(ways[0] != ways[2])
    assert "opaque_office" in drives.buildings()
    assert {"sensitive", "weak", "coated"} <= set(drives.lidars())


@pytest.mark.long_run
def test_every_localizer_is_scored_on_the_same_drive():
    job = Job("opaque_office", "sensitive", 100, 0.0, 4, ("ours", "ours_oracle", "amcl_field60"), LocalizerParams())
    runs = {each.localizer: each for each in glass_buildings.run(job)}
    assert list(runs) == list(job.localizers)
    assert runs["ours"].cases.metrics()["beams"] == 4 * 541
    assert runs["ours"].surfaces.scans == 4
    assert runs["amcl_field60"].cases is None
    assert all(each.pose["position_rmse_m"] < 0.2 for each in runs.values())
    assert all(each.scans == 4 and each.cpu_s > 0.0 for each in runs.values())


def test_the_results_are_strict_json(tmp_path):
    replay_result.write_json(tmp_path / "x.json", {"runs": [a_run().as_json(), a_run("amcl_field60").as_json()]})
    ours, plain = json.loads((tmp_path / "x.json").read_text())["runs"]
    assert ours["cases"]["accuracy"] == 1.0
    assert ours["scan_surfaces"]["cut_at_pane_share"] == 1.0
    assert plain["cases"] is plain["scan_surfaces"] is None
    assert plain["pose"]["position_rmse_m"] == 0.01


def test_the_ratio_is_to_the_best_baseline_of_the_building_and_never_to_the_oracle():
    runs = [
        a_run(rmse_m=0.01),
        a_run(rmse_m=0.03),
        a_run("ours_oracle", rmse_m=0.001),
        a_run("amcl_field60", rmse_m=0.04),
        a_run("amcl_beam60", rmse_m=0.08),
        a_run("amcl_beam60", "yard", 0.001),
    ]
    assert glass_buildings.to_best_baseline(runs, "hall", "position_rmse_m") == (pytest.approx(0.5), "amcl_field60")
    assert glass_buildings.to(runs, "hall", "position_rmse_m", "ours_oracle") == pytest.approx(20.0)


def test_baselines_of_an_earlier_benchmark_count_where_they_drove_the_same(tmp_path):
    runs = [a_run(name) for name in ("amcl_field60", "amcl_beam60", "ours", "ours_oracle")]
    runs.append(a_run("ours_case1", "yard"))
    replay_result.write_json(tmp_path / "x.json", {"changed": 0.0, "runs": [each.as_json() for each in runs]})
    job = Job("hall", "weak", 100, 0.0, None, ("ours", "amcl_beam60"), LocalizerParams())
    assert glass_buildings.baselines_from(tmp_path / "x.json", [job]) == [a_run("amcl_field60")]
    assert glass_buildings.baselines_from(tmp_path / "x.json", [job._replace(changed=0.3)]) == []
    assert glass_buildings.baselines_from(tmp_path / "x.json", [job._replace(seed=101)]) == []


@pytest.mark.parametrize(
    "changes, missed",
    [
        ({}, []),
        ({"rmse_m": 0.016}, ["hall: position_rmse_m / best baseline"]),
        ({"lost": 0.1}, ["largest lost share"]),
        ({"told": (1, 3, 3, 1)}, ["case accuracy", "macro F1", "precision of case 1"]),
    ],
)
def test_bars_are_kept_or_missed(capsys, changes, missed):
    runs = [a_run(**changes), a_run("amcl_field60", rmse_m=0.02, yaw_deg=0.2)]
    assert glass_buildings.print_bars(runs) == (not missed)
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(" | ")[0].lstrip("| ") for line in lines if line.endswith("MISSED |")] == missed
    assert any(line.startswith("| precision of case 4 ") and line.endswith("not measured |") for line in lines)


def test_without_glass_it_is_enough_to_be_as_good():
    found = case_scores.of_cases(np.ones(100, int), np.ones(100, int), np.ones(100, bool))
    runs = [a_run(rmse_m=0.02)._replace(cases=found), a_run("amcl_field60", rmse_m=0.02)]
    assert glass_buildings.print_bars(runs)


def test_the_tables_have_a_line_for_each(capsys):
    runs = [a_run(), a_run("ours_paper", told=(1, 1, 1, 1)), a_run("amcl_field60", rmse_m=0.02)]
    glass_buildings.print_cases(runs, (lambda each: each.building, lambda each: "all"))
    glass_buildings.print_confusion(runs)
    glass_buildings.print_poses(runs)
    glass_buildings.print_surfaces(runs)
    out = capsys.readouterr().out
    assert out.count("| hall | soft | 1.000 |") == 1
    assert out.count("| all | paper | 0.250 |") == 1
    assert "| hall | amcl_field60 | 0.020 | 0.020 | 0.100 | 0.000 (0.000) | 40.0 | 50.0 |" in out
    assert "| hall | 0.50 (amcl_field60) |" in out
    assert "| hall | weak | 3 | 1.000 | 0.000 | 0.0000 | 1.000 |" in out
    assert "| 1 first surface | 100.0 % | 0.0 % |" in out


@pytest.mark.parametrize(
    "bar, kept",
    [
        (Bar("x", 0.95, 0.95), True),
        (Bar("x", 0.94, 0.95), False),
        (Bar("x", 0.01, most=0.01), True),
        (Bar("x", 0.02, most=0.01), False),
        (Bar("x", None, 0.95), True),
    ],
)
def test_a_bar_includes_its_edge(bar, kept):
    assert bar.kept is kept
