from __future__ import annotations

import csv
import json

import numpy as np
import pytest
from made_results import GRID, a_result

from glass_nav.evaluation.metrics import case_scores, replay_result
from glass_nav.evaluation.metrics.replay_result import NO_BEAM, BeamExample, ReplayResult
from glass_nav.evaluation.plots import run_pictures
from glass_nav.vocabulary import BeamCase
from glass_nav.world.grid_map import GridMap


def test_the_metrics_have_the_promised_names_and_values():
    figures = a_result().metrics()
    assert figures["scans"] == 4
    assert figures["scans_refused"] == 2
    assert figures["refusals"] == {"time runs backwards": 2}
    assert figures["updates"] == 2
    assert figures["scans_without_ground_truth"] == 1
    assert figures["position_mean_m"] == pytest.approx(0.1)
    assert {
        "position_median_m",
        "position_rmse_m",
        "position_p95_m",
        "position_max_m",
        "yaw_mean_deg",
        "lost_share",
        "lost_1m_share",
    } <= figures.keys()
    assert figures["case_share"] == {"0": 1 / 7, "1": 4 / 7, "2": 1 / 7, "3": 1 / 7, "4": 0.0}
    assert figures["state_share"] == {"LOCALIZED": 0.75, "UNKNOWN": 0.25}
    assert figures["cpu_ms_per_scan"] == 9.0
    assert figures["cpu_ms_per_update"] == 15.0
    assert figures["log_duration_s"] == pytest.approx(3.0)
    assert figures["times_real_time"] == pytest.approx(6.0)
    assert figures["seed"] == 7


def test_without_ground_truth_the_errors_are_null(tmp_path):
    replay_result.write(a_result(reference=None), tmp_path, {"log": "x"})
    figures = json.loads((tmp_path / "metrics.json").read_text())
    assert figures["position_mean_m"] is figures["yaw_mean_deg"] is figures["lost_share"] is None
    assert figures["scans_without_ground_truth"] is None
    assert figures["log"] == "x"


def test_json_never_holds_nan(tmp_path):
    replay_result.write_json(
        tmp_path / "x.json", {"a": float("nan"), "b": [np.float64("inf"), np.int64(3)], "c": {"d": (1.5, True, None)}}
    )
    text = (tmp_path / "x.json").read_text()
    assert "NaN" not in text
    assert json.loads(text) == {"a": None, "b": [None, 3], "c": {"d": [1.5, True, None]}}


def test_the_files_hold_every_scan(tmp_path):
    result = a_result()
    replay_result.write(result, tmp_path, {})
    tum = np.loadtxt(tmp_path / "trajectory.tum")
    assert tum.shape == (4, 8)
    assert (tmp_path / "trajectory.tum").read_text().startswith("1000000000.000000000 0.000000 0.100000 0 0 0 ")
    with np.load(tmp_path / "beam_cases.npz") as cases:
        assert cases["stamps_ns"].dtype == np.int64
        assert cases["cases"].dtype == np.uint8
        np.testing.assert_array_equal(cases["stamps_ns"], result.stamps_ns)
        np.testing.assert_array_equal(cases["cases"], result.cases)
    with (tmp_path / "per_scan.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["stamp_ns"] for row in rows] == [str(stamp) for stamp in result.stamps_ns]
    assert float(rows[1]["position_error_m"]) == pytest.approx(0.1)
    assert rows[3]["position_error_m"] == rows[3]["true_x_m"] == rows[3]["used_share"] == ""
    assert rows[1]["reason"] == "a, b"
    assert [rows[2][f"beams_case_{case}"] for case in range(5)] == ["0", "1", "1", "0", "0"]


@pytest.mark.parametrize(
    "changes",
    [
        pytest.param({}, id="with a reference"),
        pytest.param({"reference": None}, id="without"),
        pytest.param({"map_from_base": np.full((4, 3), 1e6)}, id="far off the map"),
        pytest.param({"map_from_base": np.full((4, 3), np.nan)}, id="no pose at all"),
        pytest.param(
            {"states": ["NEW"] * 4, "map_from_base": np.array([[0, y, 0] for y in range(0, 40, 10)], float)},
            id="tall, a state of tomorrow",
        ),
    ],
)
def test_a_picture_is_drawn_whatever_came_out(tmp_path, changes, recwarn):
    from PIL import Image

    run_pictures.draw_trajectory(tmp_path / "way.png", GRID, a_result(**changes), "a log")
    with Image.open(tmp_path / "way.png") as image:
        assert image.width > 800
        assert image.height > 500
    assert not [str(warning.message) for warning in recwarn if "glass_nav" in str(warning.filename)]


def test_a_single_scan_has_a_picture_and_figures(tmp_path):
    result = a_result()
    one = ReplayResult(
        **{
            name: (value[:1] if isinstance(value, (np.ndarray, list)) else value)
            for name, value in vars(result).items()
        }
    )
    run_pictures.draw_trajectory(tmp_path / "way.png", GRID, one, "a log")
    assert one.metrics()["log_duration_s"] == 0.0


def test_the_wall_in_the_picture_is_where_the_map_has_it(tmp_path):
    """A free map with one wall, dark in the picture above the robot's way and nowhere else."""
    from PIL import Image

    occupancy = np.zeros((100, 100), np.int8)
    occupancy[70:73, :] = 100  # y = 2.0 .. 2.3 m
    flat = GridMap(occupancy, 0.1, np.array([-5.0, -5.0, 0.0]))
    way = np.array([[x, 0.0, 0.0] for x in (-3.0, -1.0, 1.0, 3.0)])
    run_pictures.draw_trajectory(tmp_path / "way.png", flat, a_result(map_from_base=way, reference=None), "a log")
    with Image.open(tmp_path / "way.png") as image:
        grey = np.asarray(image.convert("L")).astype(int)
    width = grey.shape[1]
    dark = (grey[:, width // 4 : width // 3] < 90).mean(axis=1) > 0.9  # rows that are a wall all along
    rows = np.nonzero(dark)[0]
    assert 0 < len(rows)
    thick = np.split(rows, np.nonzero(np.diff(rows) > 1)[0] + 1)
    assert len([part for part in thick if len(part) > 5]) == 1


def test_the_scores_are_among_the_metrics_and_the_true_cases_among_the_files(tmp_path):
    cases = np.array([[1, 1], [3, 0], [1, 2], [1, NO_BEAM]], np.uint8)
    true = np.array([[1, 1], [3, 3], [NO_BEAM] * 2, [1, NO_BEAM]], np.uint8)
    known = true != NO_BEAM
    scores = case_scores.of_cases(true[known], cases[known], np.ones(5, bool))
    surfaces = case_scores.of_surfaces(np.array([2.0, np.nan]), np.array([2.0, 9.0]), np.array([True, False]), True)
    result = a_result(true_cases=true, case_scores=scores, surface_scores=surfaces)
    figures = result.metrics()
    assert figures["scans_with_true_cases"] == 3
    assert figures["cases"]["accuracy"] == 0.8
    assert figures["scan_surfaces"]["cut_at_pane_share"] == 1.0
    replay_result.write(result, tmp_path, {})
    assert json.loads((tmp_path / "metrics.json").read_text())["cases"] == figures["cases"]
    with np.load(tmp_path / "beam_cases.npz") as written:
        np.testing.assert_array_equal(written["true_cases"], true)
    assert a_result().metrics()["cases"] is a_result().metrics()["scan_surfaces"] is None
    assert a_result().metrics()["scans_with_true_cases"] is None


def test_beams_have_the_colours_of_their_true_and_of_their_reported_cases(tmp_path):
    from PIL import Image

    ends = np.array([[3.0, 0.0], [0.0, 3.0], [np.nan, np.nan]])
    example = BeamExample(10**18, np.zeros(2), ends, np.array([4, 4, 0], np.uint8), np.array([2, 2, 0], np.uint8))
    scores = case_scores.of_cases(np.array([4, 4, 0]), np.array([2, 2, 0]), np.array([True, True, False]))
    run_pictures.draw_cases(tmp_path / "cases.png", GRID, a_result(case_scores=scores, examples=[example]), "a log")
    with Image.open(tmp_path / "cases.png") as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    pixels = pixels[:, int(0.6 * pixels.shape[1]) :]  # without the legend, which is below the matrix

    def rows_of(colour):
        wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
        return np.nonzero((np.abs(pixels - wanted).max(axis=2) < 3).any(axis=1))[0]

    true, reported = rows_of(BeamCase(4).colour), rows_of(BeamCase(2).colour)
    assert len(true)
    assert len(reported)
    assert true.max() < reported.min()  # the truth above


def test_cases_without_examples_have_a_picture_too(tmp_path):
    run_pictures.draw_cases(tmp_path / "cases.png", GRID, a_result(case_scores=case_scores.none_yet()), "a log")
    assert (tmp_path / "cases.png").stat().st_size > 5_000


def test_what_was_written_is_read_back(tmp_path):
    true = np.array([[1, 1], [3, 3], [NO_BEAM] * 2, [1, NO_BEAM]], np.uint8)
    result = a_result(true_cases=true)
    replay_result.write(result, tmp_path, {"log": "x"})
    back, metrics = replay_result.read(tmp_path)
    assert metrics["log"] == "x"
    for name in ("stamps_ns", "cases", "updated", "particles", "places", "true_cases"):
        np.testing.assert_array_equal(getattr(back, name), getattr(result, name), err_msg=name)
    for name in ("map_from_base", "odom_from_base", "deviation", "used_share", "reliability", "cpu_ms"):
        np.testing.assert_allclose(getattr(back, name), getattr(result, name), atol=1e-6, err_msg=name)
    assert (back.states, back.reasons, back.refusals, back.seed) == (result.states, result.reasons, result.refusals, 7)
    np.testing.assert_allclose(back.errors.position_m, result.errors.position_m, atol=1e-6)
    replay_result.write(a_result(reference=None), tmp_path, {})
    assert replay_result.read(tmp_path)[0].reference is None


@pytest.mark.parametrize(
    "damage, text",
    [
        (
            lambda folder: (folder / "metrics.json").unlink(),
            ": holds no results of a replay (there is no metrics.json)",
        ),
        (
            lambda folder: (folder / "worst_scans.npz").unlink(),
            ": its results have no 'worst_scans.npz', an older glass_nav wrote them: replay again",
        ),
        (
            lambda folder: (folder / "per_scan.csv").write_text("stamp_ns\n1\n2\n3\n4\n"),
            ": its results have no 'true_x_m', an older glass_nav wrote them: replay again",
        ),
        (
            lambda folder: (folder / "per_scan.csv").write_text(
                (folder / "per_scan.csv").read_text().rpartition("1000000003")[0]
            ),
            ": its results are damaged: 3 rows in per_scan.csv, cases of 4 scans in beam_cases.npz",
        ),
        (lambda folder: (folder / "beam_cases.npz").write_bytes(b"PK"), ": its results are damaged: "),
        (lambda folder: (folder / "metrics.json").write_text("{"), ": its results are damaged: "),
    ],
)
def test_results_that_are_not_whole_are_refused(tmp_path, damage, text):
    replay_result.write(a_result(), tmp_path, {})
    damage(tmp_path)
    with pytest.raises(ValueError) as caught:
        replay_result.read(tmp_path)
    assert str(caught.value).startswith(f"{tmp_path}{text}")
