from __future__ import annotations

import csv
import json
import math

import numpy as np
import pytest

from glass_nav.evaluation.metrics import comparison, pose_errors
from glass_nav.evaluation.metrics.comparison import BY_NAME, Run
from glass_nav.evaluation.metrics.confidence import Interval
from glass_nav.geometry.trajectory import Trajectory

MEAN = BY_NAME["position_mean_m"]
TRUTH = Trajectory(np.arange(4, dtype=np.int64) * 10**9, np.zeros((4, 3)))


def run(contestant, seed, error_m, log="a.bag", scans=range(4), reference=TRUTH, **fields):
    """A run that is error_m off along x, at those seconds."""
    stamps_ns = np.array(scans, np.int64) * 10**9
    way = np.stack([np.full(len(stamps_ns), error_m), np.zeros(len(stamps_ns)), np.zeros(len(stamps_ns))], axis=1)
    errors = pose_errors.of(stamps_ns, way, reference)
    given = {"states": None, "case_accuracy": None, "cpu_ms": None, "wall_s": 1.0, "reference": reference, **fields}
    return Run(contestant, log, seed, stamps_ns, way, errors, **given)


def test_seeds_are_compared_in_pairs():
    """Seeds that are hard for both do not hide that one is always a little better."""
    runs = [run("old", seed, error) for seed, error in enumerate((0.1, 0.5, 0.9))]
    runs += [run("new", seed, error) for seed, error in enumerate((0.09, 0.49, 0.88))]
    found = comparison.of(runs, ["old", "new"], ["a.bag"])
    difference = found.difference("new", MEAN)
    assert difference.mean == pytest.approx(-0.04 / 3)
    assert difference.half_width == pytest.approx(4.302653 * np.std([0.01, 0.01, 0.02], ddof=1) / math.sqrt(3))
    # -0.0133 +- 0.0143: three seeds do not yet tell them apart
    assert comparison.judged(MEAN, difference) == "not significantly different"
    assert comparison.judged(MEAN, Interval(-0.0133, 0.01)) == "better"
    assert comparison.judged(BY_NAME["localized_share"], Interval(-0.2, 0.1)) == "worse"
    assert comparison.judged(MEAN, Interval(0.0, 0.0)) == "equal"
    assert comparison.judged(BY_NAME["apart_mean_m"], Interval(1.0, 0.1)) == ""
    assert found.interval("old", MEAN).half_width > 0.5


def test_other_seeds_are_compared_as_groups():
    runs = [run("old", 0, 0.1), run("old", 1, 0.3), run("new", 2, 0.4), run("new", 3, 0.8)]
    difference = comparison.of(runs, ["old", "new"], ["a.bag"]).difference("new", MEAN)
    assert difference.mean == pytest.approx(0.4)
    variance = 0.02 / 2 + 0.08 / 2
    freedom = variance**2 / (0.01**2 + 0.04**2)
    assert 1.0 < freedom < 2.0
    assert difference.half_width == pytest.approx(comparison.confidence._quantile(freedom) * math.sqrt(variance))


def test_recorded_poses_stand_against_every_seed():
    runs = [run("ours", 0, 0.1), run("ours", 1, 0.2), run("amcl", None, 0.5)]
    found = comparison.of(runs, ["ours", "amcl"], ["a.bag"])
    assert found.interval("amcl", MEAN) == Interval(0.5, None)
    difference = found.difference("amcl", MEAN)
    assert difference.mean == pytest.approx(0.35)
    assert difference.half_width > 0.0
    # How far from the first: 0.4 and 0.3 m.
    assert found.value(runs[2], BY_NAME["apart_mean_m"]) == pytest.approx(0.35)
    turned = comparison.of(runs, ["amcl", "ours"], ["a.bag"])
    assert turned.difference("ours", MEAN).mean == pytest.approx(-0.35)
    assert turned.value(runs[1], BY_NAME["apart_mean_m"]) == pytest.approx(0.3)
    assert math.isnan(turned.value(runs[2], BY_NAME["apart_mean_m"]))


def test_only_scans_that_all_have_a_pose_for_are_compared():
    late = run("late", 0, 0.2, scans=[2, 3])
    found = comparison.of([run("all", 0, 0.1), late], ["all", "late"], ["a.bag"])
    assert found.scans == {"a.bag": 2}
    assert found.notes == ["a.bag: compared over the 2 of 4 scans that all runs have a pose for"]
    with pytest.raises(ValueError, match="^a.bag: there is no scan that all its runs have a pose for$"):
        comparison.of([run("early", 0, 0.1, scans=[0, 1]), late], ["early", "late"], ["a.bag"])


def test_only_logs_that_all_have_run_on_are_compared():
    runs = [run("one", 0, 0.1), run("one", 0, 0.9, log="b.bag"), run("two", 0, 0.1)]
    found = comparison.of(runs, ["one", "two"], ["a.bag", "b.bag"])
    assert (found.logs, found.notes) == (["a.bag"], ["b.bag left out: no run of two"])
    with pytest.raises(ValueError, match="^there is no log that all have run on: one on b.bag; two on a.bag$"):
        comparison.of(runs[1:], ["one", "two"], ["a.bag", "b.bag"])
    with pytest.raises(ValueError, match="^two runs of one over a.bag have the seed 0$"):
        comparison.of([runs[0], runs[0]], ["one"], ["a.bag"])


def test_all_logs_have_the_same_weight():
    runs = [run("one", seed, 0.1) for seed in range(3)] + [run("one", 0, 0.5, log="b.bag")]
    assert comparison.of(runs, ["one"], ["a.bag", "b.bag"]).interval("one", MEAN).mean == pytest.approx(0.3)


def test_without_a_ground_truth_they_are_only_measured_against_each_other():
    runs = [run("one", 0, 0.1, reference=None), run("two", 0, 0.4, reference=None)]
    found = comparison.of(runs, ["one", "two"], ["a.bag"])
    assert [figure.name for figure in found.figures] == ["apart_mean_m"]
    assert found.value(runs[1], BY_NAME["apart_mean_m"]) == pytest.approx(0.3)
    assert found.interval("one", MEAN) is None and found.difference("two", MEAN) is None


def test_a_filter_that_diverged_is_infinitely_far_off_and_no_interval_is_reported():
    runs = [run("one", 0, 0.1), run("two", 0, math.nan)]
    found = comparison.of(runs, ["one", "two"], ["a.bag"])
    assert found.interval("two", MEAN).mean == math.inf
    assert comparison.text(MEAN, found.interval("two", MEAN)) == "infinite"
    assert comparison.text(MEAN, found.difference("two", MEAN)) == "infinite"
    both = comparison.of([run("one", 0, math.nan), runs[1]], ["one", "two"], ["a.bag"])
    assert comparison.text(MEAN, both.difference("two", MEAN)) == "–"


@pytest.mark.parametrize(
    "interval, text",
    [
        (Interval(0.1234, 0.0456), "0.1234 ± 0.0456"),
        (Interval(0.1234, None), "0.1234"),
        (None, "–"),
        (Interval(-0.00001, 0.01), "0.0000 ± 0.0100"),
        (Interval(0.123456, 0.000012), "0.12346 ± 0.00001"),
        (Interval(0.5, 1e-9), "0.5000 ± 0.0000"),
    ],
)
def test_digits_go_as_far_as_the_interval(interval, text):
    assert comparison.text(MEAN, interval) == text


def test_files_hold_every_run_and_no_time(tmp_path):
    runs = [
        run("one", seed, 0.1 * seed, states=["LOCALIZED"] * 3 + ["LOST"], cpu_ms=np.full(4, 5.0), case_accuracy=0.5)
        for seed in (0, 1)
    ]
    found = comparison.of(runs, ["one"], ["a.bag"])
    comparison.write(found, tmp_path, {})
    with (tmp_path / "runs.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [
        (row["log"], row["contestant"], row["seed"], row["localized_share"], row["case_accuracy"]) for row in rows
    ] == [("a.bag", "one", "0", "0.75", "0.5"), ("a.bag", "one", "1", "0.75", "0.5")]
    assert len({row["trajectory_sha256"] for row in rows}) == 2
    assert "cpu" not in (tmp_path / "runs.csv").read_text() + (tmp_path / "compare.json").read_text()
    assert (tmp_path / "timings.csv").read_text().splitlines()[1] == "a.bag,one,0,1.000,5.0"
    means = json.loads((tmp_path / "compare.json").read_text())["means"]["one"]
    assert means["all"]["position_mean_m"]["value"]["mean"] == pytest.approx(0.05)
    assert means["all"] == means["a.bag"]


def test_the_hash_tells_the_last_bit_of_a_pose():
    first, second = run("one", 0, 0.1), run("one", 0, np.nextafter(0.1, 1.0))
    assert first.sha256 == run("other", 5, 0.1).sha256 != second.sha256
