from __future__ import annotations

from pathlib import Path

import pytest

from glass_nav.compare import compared_logs
from glass_nav.compare.compared_logs import Log


def test_logs_come_from_pairs_and_from_a_list(tmp_path):
    listing = tmp_path / "logs.yaml"
    (tmp_path / "truth.txt").touch()
    listing.write_text(
        "- {log: a.bag, map: a.yaml, ground_truth: truth.txt, initial_pose: [1, 2.5, 0]}\n"
        "- {log: [b_0.bag, b_1.bag], map: /maps/b.yaml, ground_truth: /pose}\n"
        "- {log: other/a.bag, map: a.yaml}\n"
    )
    assert compared_logs.parse(["x=1.bag=x.yaml"], listing) == [
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
        compared_logs.parse([], tmp_path / "logs.yaml")
    assert str(caught.value) == f"{tmp_path}/logs.yaml: {line}"


def test_a_list_that_is_no_yaml_and_a_log_named_twice_are_refused(tmp_path):
    (tmp_path / "logs.yaml").write_text("[a")
    with pytest.raises(ValueError, match="logs.yaml: is not yaml: "):
        compared_logs.parse([], tmp_path / "logs.yaml")
    with pytest.raises(ValueError, match="^a log is named twice: a.bag$"):
        compared_logs.parse(["a.bag=m.yaml", "a.bag=n.yaml"], None)
