"""glass_nav landmarks limits: the document's tables in the terminal, and every wrong way to ask for one."""

from __future__ import annotations

from pathlib import Path

import pytest

from glass_nav.cli.main import main

TAGS = """landmarks:
  - {id: A, position: [0.0, 0.0]}
  - {id: B, position: [1.0, 0.0]}
  - {id: C, position: [0.0, 1.0]}
"""
PLACES = ["--tags", "0", "0", "1", "0", "0", "1"]


def limits(*options: str) -> int:
    return main(["landmarks", "limits", *options])


def test_the_second_table_of_the_document_is_printed(capsys):
    assert limits("--ranges", "8.592", "8.711", "10.210", "--between", "35", "29") == 0
    assert capsys.readouterr().out == (
        "position error [cm]; rows: angle 1 to 2 as read, columns: angle 2 to 3 [degrees]\n"
        "           28.00   28.50   29.00   29.50   30.00\n"
        "   34.00    32.8    25.9    35.1    51.7    70.1\n"
        "   34.50    34.6    16.1    17.3    35.0    54.4\n"
        "   35.00    43.5    21.5     0.0    20.8    41.1\n"
        "   35.50    55.8    34.7    16.6    15.7    32.2\n"
        "   36.00    69.2    49.4    32.7    24.4    30.9\n"
        "largest error 70.1 cm in steps of 1 degrees\n"
        "a step of at most 0.43 degrees keeps the error within 0.3 m\n"
    )


def test_landmarks_of_a_file_are_those_of_the_same_places(tmp_path: Path, capsys):
    (tmp_path / "tags.yaml").write_text(TAGS)
    assert limits(*PLACES, "--at", "3", "2") == 0
    by_places = capsys.readouterr().out
    assert limits("--landmarks", str(tmp_path / "tags.yaml"), "--ids", "A", "B", "C", "--at", "3", "2") == 0
    assert capsys.readouterr().out == by_places


@pytest.mark.parametrize(
    ("options", "code", "line"),
    [
        (
            [],
            2,
            "three landmarks must be given by --tags and --at, or --ranges and --between, or --landmarks and --ids and --at, got none",
        ),
        (
            PLACES,
            2,
            "three landmarks must be given by --tags and --at, or --ranges and --between, or --landmarks and --ids and --at, got --tags",
        ),
        ([*PLACES, "--at", "nan", "0"], 2, "--at must be finite, got nan 0"),
        (["--ranges", "1", "0", "1", "--between", "30", "30"], 2, "--ranges must be > 0 m, got 1 0 1"),
        ([*PLACES, "--at", "3", "2", "--step-deg", "0"], 2, "--step-deg must be > 0 and <= 45 degrees, got 0"),
        ([*PLACES, "--at", "3", "2", "--within", "inf"], 2, "--within must be finite and > 0 m, got inf"),
        (
            [*PLACES, "--at", "1", "1"],
            3,
            "no step keeps the error within 0.3 m: the robot is on the circle through the landmarks",
        ),
    ],
)
def test_what_cannot_be_answered_is_refused_in_one_line(options, code, line, capsys):
    try:
        assert limits(*options) == code
    except SystemExit as end:
        assert end.code == code
    out = capsys.readouterr()
    assert not out.out and out.err.strip().splitlines()[-1].endswith(line)


def test_an_unknown_landmark_is_named(tmp_path: Path, capsys):
    (tmp_path / "tags.yaml").write_text(TAGS)
    assert limits("--landmarks", str(tmp_path / "tags.yaml"), "--ids", "A", "B", "X", "--at", "3", "2") == 3
    assert "X" in capsys.readouterr().err
