from __future__ import annotations

from pathlib import Path

import pytest

from glass_nav.compare import contestants
from glass_nav.compare.contestants import Contestant


def test_contestants_are_told_by_what_they_are(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    assert contestants.parse(
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
    (found,) = contestants.parse([f"{tmp_path}/max=500"])
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
        contestants.parse(texts)
    assert str(caught.value) == line
