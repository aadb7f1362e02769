"""The subcommand as a user calls it: a bag that replays as it is, its map, its one line; and what it refuses."""

from __future__ import annotations

import json
import re
import sys

import numpy as np
import pytest

from glass_nav.cli import main as cli
from glass_nav.cli import simulate
from glass_nav.recording.bag_writer import BagWriter
from glass_nav.recording.log_file import open_log
from glass_nav.world import map_file

HALL = """
walls:
  - line: [[-0.1, -0.1], [6.1, -0.1], [6.1, 4.1], [-0.1, 4.1], [-0.1, -0.1]]
panes:
  - line: [[3.0, 1.4], [3.0, 4.0]]
furniture:
  - {box: [4.5, 2.8, 0.4, 0.3], movable: true}
  - {box: [5.2, 3.6, 0.4, 0.3], movable: true}
paths:
  round: [[1.0, 1.0], [1.0, 3.0], [2.0, 3.0]]
  out: [[1.0, 1.0], [8.0, 1.0]]
start: [1.0, 1.0, 90.0]
"""


@pytest.fixture
def hall(tmp_path):
    (tmp_path / "hall").mkdir()
    (tmp_path / "hall" / "building.yaml").write_text(HALL)
    return tmp_path / "hall"


@pytest.fixture
def run(hall, tmp_path, capsys):
    """run(option, ...): exit code, stdout, stderr; the bag is tmp_path/run.bag."""

    def command(*options, building=hall):
        code = cli.main(
            [
                "simulate",
                str(building),
                "--out",
                str(tmp_path / "run.bag"),
                "--beams",
                "61",
                *(str(option) for option in options),
            ]
        )
        captured = capsys.readouterr()
        return code, captured.out.replace(f"{tmp_path}/", ""), captured.err.replace(f"{tmp_path}/", "")

    return command


@pytest.mark.long_run
def test_a_lidar_that_turns_makes_a_bag_that_says_so(run, tmp_path):
    code, _, err = run("--turn-time", 0.05, "--seed", 2)
    assert code == 0, err
    recording = open_log(tmp_path / "run.bag")
    assert "a sweep of the lidar takes 50 ms: scans are deskewed by odometry" in recording.notes
    entries = list(recording)
    assert len(entries) > 20 and all(entry.scan.origins_m is not None for entry in entries[1:])
    stamps_ns = [entry.scan.stamp_ns for entry in entries]
    assert recording.ground_truth is not None
    assert set(stamps_ns) <= set(recording.ground_truth.stamps_ns.tolist())


@pytest.mark.long_run
def test_a_bag_and_its_map_replay_as_they_are(run, tmp_path):
    code, out, err = run("--seed", 1)
    assert code == 0, err
    assert {path.name for path in tmp_path.iterdir()} == {"hall", "run.bag", "run.map.yaml", "run.map.png"}
    said = re.fullmatch(
        r"(\d+) scans, 2\.\d m, (\d+\.\d) s \(\d+ times real time\); beams: first surface \d+\.\d %, "
        r"mirrored \d+\.\d %, behind one pane \d+\.\d %, behind two panes \d+\.\d %, uncertain "
        r"\d+\.\d %; written to run.bag and run.map.yaml\n",
        out,
    )
    assert said, out
    recording = open_log(tmp_path / "run.bag")
    assert len(recording) == int(said[1]) == round(10 * float(said[2])) + 1
    assert (
        cli.main(
            [
                "replay",
                str(tmp_path / "run.bag"),
                "--map",
                str(tmp_path / "run.map.yaml"),
                "--no-picture",
                "--out",
                str(tmp_path / "out"),
            ]
        )
        == 0
    )
    figures = json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert figures["scans"] == len(recording)
    assert figures["position_max_m"] < 0.2


@pytest.mark.long_run
def test_the_same_seed_gives_the_same_bag(run, tmp_path):
    bags = []
    for seed in (2, 2, 3):
        assert run("--seed", seed)[0] == 0
        bags.append((tmp_path / "run.bag").read_bytes())
    assert bags[0] == bags[1] != bags[2]


def test_options_reach_the_run(run, tmp_path):
    (tmp_path / "way.csv").write_text("1,1\n2,1\n")
    code, out, err = run(
        "--path",
        tmp_path / "way.csv",
        "--lidar",
        "weak",
        "--robot",
        "omni",
        "--rate",
        5,
        "--speed",
        0.25,
        "--echo",
        "last",
        "--changed",
        1.0,
        "--resolution",
        0.1,
    )
    assert code == 0, err
    steps = list(open_log(tmp_path / "run.bag"))
    assert {len(step.scan) for step in steps} == {61}
    stamps_ns = np.array([step.scan.stamp_ns for step in steps])
    np.testing.assert_array_equal(np.diff(stamps_ns), 200_000_000)
    assert 1.0 / 0.25 < (stamps_ns[-1] - stamps_ns[0]) * 1e-9 < 1.3 / 0.25
    assert map_file.load(tmp_path / "run.map.yaml").resolution_m == 0.1


def test_the_map_does_not_know_what_moved(run, tmp_path):
    maps = []
    for share in (0.0, 1.0):
        assert run("--changed", share)[0] == 0
        maps.append((tmp_path / "run.map.png").read_bytes())
    assert maps[0] == maps[1]


@pytest.mark.parametrize("options", [("--glass-erased", 1.0), ("--mapper", "erasing")])
def test_a_map_without_its_glass_comes_with_the_complete_one_and_the_same_bag(run, tmp_path, options):
    assert run()[0] == 0
    bag, complete = (tmp_path / "run.bag").read_bytes(), (tmp_path / "run.map.png").read_bytes()
    code, out, err = run(*options)
    assert code == 0, err
    assert out.endswith("written to run.bag, run.map.yaml and run.complete.map.yaml\n")
    assert (tmp_path / "run.bag").read_bytes() == bag
    assert (tmp_path / "run.complete.map.png").read_bytes() == complete
    pane = np.column_stack([np.full(40, 3.0), np.linspace(1.5, 3.9, 40)])
    shares = [
        np.mean(grid.occupied[grid.cells(pane)])
        for grid in (map_file.load(tmp_path / f"run.{name}.yaml") for name in ("map", "complete.map"))
    ]
    assert shares[0] < 0.8 and shares[1] == 1.0


def test_a_building_of_the_package_is_named(run):
    assert run("--path", "no", building="glass_office")[2].startswith("glass_nav simulate: glass_office: no path 'no'")


def test_bad_input_is_one_line_and_exit_code_3(run, hall, tmp_path):
    (tmp_path / "bad.csv").write_text("1,1\n")
    (tmp_path / "bare.yaml").write_text(HALL.partition("paths:")[0] + "start: [1, 1, 0]\n")
    for options, building, text in (
        (["--path", "rund"], hall, "hall: no path 'rund', it has round, out; did you mean round?"),
        (["--path", tmp_path / "bad.csv"], hall, "bad.csv: a path needs 2 different waypoints, got 1"),
        (["--path", tmp_path / "no.yaml"], hall, "no.yaml: cannot be read: No such file or directory"),
        (["--path", "out"], hall, "hall: the robot is stuck at x 5.78 m, y 1.00 m after"),
        ([], tmp_path / "bare.yaml", "has no path; give a file of waypoints"),
        ([], tmp_path, f"{tmp_path}: a folder without building.yaml"),
        ([], "palace", "palace: no such file, nor a building of the package, which are "),
    ):
        code, out, err = run(*options, building=building)
        line = err.splitlines()[-1]
        assert (code, out) == (3, "")
        assert line.startswith("glass_nav simulate: ")
        assert text.replace(f"{tmp_path}/", "") in line or text in line, line
        assert "Traceback" not in err
    assert not [path for path in tmp_path.iterdir() if "run" in path.name]


@pytest.mark.parametrize(
    "options, text",
    [
        (["--seed", "-1"], "--seed must be >= 0, got -1"),
        (["--changed", "1.5"], "--changed must be 0 to 1, got 1.5"),
        (["--glass-erased", "-1"], "--glass-erased must be 0 to 1, got -1.0"),
        (
            ["--glass-erased", "0.5", "--mapper", "erasing"],
            "--mapper erasing erases what beams pass; it takes no --glass-erased, got 0.5",
        ),
        (["--rate", "0"], "--rate must be 0.1 to 1000 Hz, got 0.0"),
        (["--speed", "0"], "--speed must be > 0 m/s, got 0.0"),
        (["--resolution", "0"], "--resolution must be 0.01 to 1 m, got 0.0"),
        (["--beams", "1"], "lidar beams must be a whole number >= 2, got 1"),
        (["--lidar", "wek"], "unknown lidar preset 'wek', known are sensitive, weak, coated; did you mean weak?"),
        (["--robot", "car"], "error: argument --robot: invalid choice: 'car' (choose from 'diff', 'omni')"),
        (
            ["--echo", "loudest"],
            "error: argument --echo: invalid choice: 'loudest' (choose from 'first', 'strongest', 'last')",
        ),
    ],
)
def test_wrong_usage_is_exit_code_2(run, tmp_path, options, text):
    code, _, err = run(*options)
    assert code == 2
    told = err.splitlines()[-1].replace("'", "")  # argparse quotes the choices of an option before Python 3.12 only
    assert told == f"glass_nav simulate: {text}".replace("'", "")
    assert not (tmp_path / "run.bag").exists()


def test_an_interrupted_run_leaves_no_bag(run, tmp_path, monkeypatch):
    def interrupt(*_args, **_kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr(BagWriter, "truth", interrupt)
    code, _, err = run()
    assert code == 130
    assert err.splitlines()[-1] == "glass_nav simulate: interrupted, nothing written"
    assert [path.name for path in tmp_path.iterdir()] == ["hall"]


def test_progress_counts_metres(run, monkeypatch):
    class Terminal:
        text = ""

        def isatty(self):
            return True

        def write(self, text):
            Terminal.text += text

        def flush(self):
            pass

    monkeypatch.setattr(sys, "stderr", Terminal())
    assert run()[0] == 0
    assert "simulate: 2 of 3 m" in Terminal.text


def test_the_help_names_the_buildings(capsys):
    assert cli.main(["simulate", "--help"]) == 0
    assert "glass_office" in capsys.readouterr().out
    assert simulate.HELP
