from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from glass_nav.compare import compare_runs
from glass_nav.compare.compare_runs import Contestant, Log
from glass_nav.geometry.trajectory import Trajectory

SECOND_NS = 10**9


def test_a_recorded_pose_is_carried_on_by_odometry():
    """A robot drives 1 m a second along its x axis; its odometry thinks that it started at (10, 0)."""
    stamps_ns = np.arange(6) * SECOND_NS
    odometry = Trajectory(stamps_ns, np.array([[10.0 + second, 0.0, 0.0] for second in range(6)]))
    half_pi = np.pi / 2
    poses = Trajectory(np.array([1, 4]) * SECOND_NS + SECOND_NS // 2, np.array([[0.0, 0.0, half_pi], [7.0, 7.0, 0.0]]))
    found, map_from_base = compare_runs.carried(poses, odometry, stamps_ns)
    assert found.tolist() == [False, False, True, True, True, True]
    np.testing.assert_allclose(
        map_from_base[2:], [[0.0, 0.5, half_pi], [0.0, 1.5, half_pi], [0.0, 2.5, half_pi], [7.5, 7.0, 0.0]], atol=1e-12
    )
    assert np.isnan(map_from_base[:2]).all()


def test_a_recorded_pose_from_before_the_odometry_is_of_no_use():
    odometry = Trajectory(np.arange(2) * SECOND_NS, np.zeros((2, 3)))
    found, _ = compare_runs.carried(Trajectory(np.array([-SECOND_NS]), np.zeros((1, 3))), odometry, odometry.stamps_ns)
    assert not found.any()


def test_contestants_are_told_by_what_they_are(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    assert compare_runs.contestants(
        [
            "default",
            "wide=params/wide.yaml",
            "topic:/amcl_pose",
            "amcl=tf:map",
            f"{tmp_path}/a/",
            f"ours={tmp_path}/a",
            f"ours={tmp_path}/b",
        ]
    ) == [
        Contestant("default"),
        Contestant("wide", params=Path("params/wide.yaml")),
        Contestant("topic:/amcl_pose", recorded="topic:/amcl_pose"),
        Contestant("amcl", recorded="tf:map"),
        Contestant(f"{tmp_path}/a", (tmp_path / "a",)),
        Contestant("ours", (tmp_path / "a", tmp_path / "b")),
    ]


def test_a_folder_may_have_an_equals_sign_in_its_name(tmp_path):
    (tmp_path / "max=500").mkdir()
    (found,) = compare_runs.contestants([f"{tmp_path}/max=500"])
    assert found.results == (tmp_path / "max=500",)


@pytest.mark.parametrize(
    "texts, line",
    [
        (["default", "default"], "two contestants are named default: give them names, NAME=default"),
        (["a=default", "a=x.yaml"], "two contestants are named a: give them names, NAME=x.yaml"),
        (["=default"], "expected NAME=WHAT, got '=default'"),
        (["a="], "expected NAME=WHAT, got 'a='"),
        (["topic:"], "expected topic:/TOPIC or tf:FRAME, got 'topic:'"),
        (
            ["gone/results"],
            "gone/results: expected a folder of results, a .yaml of parameters, 'default', topic:/TOPIC or tf:FRAME",
        ),
    ],
)
def test_what_takes_no_part_is_refused(texts, line):
    with pytest.raises(ValueError) as caught:
        compare_runs.contestants(texts)
    assert str(caught.value) == line


def test_logs_come_from_pairs_and_from_a_list(tmp_path):
    listing = tmp_path / "logs.yaml"
    (tmp_path / "truth.txt").touch()
    listing.write_text(
        "- {log: a.bag, map: a.yaml, ground_truth: truth.txt, initial_pose: [1, 2.5, 0]}\n"
        "- {log: [b_0.bag, b_1.bag], map: /maps/b.yaml, ground_truth: /pose}\n"
        "- {log: other/a.bag, map: a.yaml}\n"
    )
    assert compare_runs.logs(["x=1.bag=x.yaml"], listing) == [
        Log("x=1.bag", (Path("x=1.bag"),), Path("x.yaml")),
        Log(
            f"{tmp_path}/a.bag",
            (tmp_path / "a.bag",),
            tmp_path / "a.yaml",
            str(tmp_path / "truth.txt"),
            (1.0, 2.5, 0.0),
        ),
        Log("b_0.bag", (tmp_path / "b_0.bag", tmp_path / "b_1.bag"), Path("/maps/b.yaml"), "/pose"),
        Log(f"{tmp_path}/other/a.bag", (tmp_path / "other/a.bag",), tmp_path / "a.yaml"),
    ]


@pytest.mark.parametrize(
    "text, line",
    [
        ("log: a", "must be a list of log and map, a log each, got dict"),
        ("", "must be a list of log and map, a log each, got NoneType"),
        (
            "- {log: a.bag}",
            "item 1 must have log and map, may have ground_truth and initial_pose, got {'log': 'a.bag'}",
        ),
        ("- {log: a.bag, map: 3}", "item 1: log, map and ground_truth must be texts, got {'log': 'a.bag', 'map': 3}"),
        (
            "- {log: a.bag, map: b, initial_pose: [1, 2]}",
            "item 1: initial_pose must be [x, y, yaw] in m, m, rad, got [1, 2]",
        ),
    ],
)
def test_a_list_of_another_form_is_refused(tmp_path, text, line):
    (tmp_path / "logs.yaml").write_text(text)
    with pytest.raises(ValueError) as caught:
        compare_runs.logs([], tmp_path / "logs.yaml")
    assert str(caught.value) == f"{tmp_path}/logs.yaml: {line}"


def test_a_list_that_is_no_yaml_and_a_log_named_twice_are_refused(tmp_path):
    (tmp_path / "logs.yaml").write_text("[a")
    with pytest.raises(ValueError, match="logs.yaml: is no yaml: "):
        compare_runs.logs([], tmp_path / "logs.yaml")
    with pytest.raises(ValueError, match="^a log is named twice: a.bag$"):
        compare_runs.logs(["a.bag=m.yaml", "a.bag=n.yaml"], None)
