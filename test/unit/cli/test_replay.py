"""The subcommand as a user calls it, on small bags of a robot in a room; and the texts of what it refuses."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from glass_nav.cli import main as cli
from glass_nav.replay import replay_run
from glass_nav.world import map_file

REPO = Path(__file__).resolve().parents[3]
RAWLOGS = REPO / "test" / "data" / "mrpt"


@pytest.fixture
def run(room_map, tmp_path, capsys):
    """run(log, option, ...): exit code, stdout, stderr; the results are in tmp_path/out."""

    def command(log, *options, grid=room_map):
        code = cli.main(
            [
                "replay",
                str(log),
                "--map",
                str(grid),
                "--out",
                str(tmp_path / "out"),
                *(str(option) for option in options),
            ]
        )
        captured = capsys.readouterr()
        return code, captured.out, captured.err.replace(f"{tmp_path}/", "")

    return command


def figures(tmp_path):
    return json.loads((tmp_path / "out" / "metrics.json").read_text())


def test_a_smoothed_replay_says_how_far_the_filter_is_from_the_whole_log(run, room_bag, tmp_path):
    code, out, _ = run(room_bag().write(), "--smooth", "--no-picture")
    assert code == 0
    smoothed = np.loadtxt(tmp_path / "out" / "smoothed.tum")
    np.testing.assert_array_equal(smoothed[:, 0], np.loadtxt(tmp_path / "out" / "trajectory.tum")[:, 0])
    scores = figures(tmp_path)["smoothed"]
    assert 0.0 < scores["filter_from_smoothed"]["position_max_m"] < 0.2
    assert scores["smoothed_from_truth"]["position_max_m"] < 0.1
    assert "from smoothed   mean 0.0" in out and "smoothed error  mean 0.0" in out


def test_a_replay_follows_the_robot_and_writes_everything(run, room_bag, tmp_path):
    code, out, err = run(room_bag().write())
    assert code == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "metrics.json",
        "trajectory.tum",
        "per_scan.csv",
        "beam_cases.npz",
        "worst_scans.npz",
        "trajectory.png",
        "glass_map.yaml",
        "glass_map.png",
    }
    assert (map_file.load(tmp_path / "out" / "glass_map.yaml").occupancy >= 0).any()
    result = figures(tmp_path)
    assert result["scans"] == 20
    assert result["scans_refused"] == 0
    assert result["position_max_m"] < 0.2
    assert result["yaw_mean_deg"] < 3.0
    assert result["seed"] == 0
    assert result["start"] == "the ground truth's first pose"
    assert result["params"]["max_particles"] > 0
    assert result["versions"].keys() == {"python", "numpy", "scipy", "machine"}
    assert "position error  mean 0." in out
    assert out.endswith(f"written to {tmp_path / 'out'}\n")
    assert err == (
        "glass_nav replay: scans from /scan\nglass_nav replay: odometry from tf odom <- base_link\n"
        "glass_nav replay: ground truth from /ground_truth\n"
        "glass_nav replay: start: the ground truth's first pose\n"
    )


@pytest.mark.long_run
def test_the_same_seed_gives_the_same_answer_and_another_one_another(run, room_bag, tmp_path):
    path = room_bag().write()
    ways, cases, glass = [], [], []
    for seed in (1, 1, 2):
        assert run(path, "--seed", seed, "--no-picture")[0] == 0
        ways.append((tmp_path / "out" / "trajectory.tum").read_text())
        with np.load(tmp_path / "out" / "beam_cases.npz") as arrays:
            cases.append(arrays["cases"].tobytes())
        glass.append((tmp_path / "out" / "glass_map.png").read_bytes())
    assert ways[0] == ways[1] != ways[2]
    assert cases[0] == cases[1]
    assert glass[0] == glass[1]
    assert not (tmp_path / "out" / "trajectory.png").exists()


def test_a_start_given_by_hand_is_used_and_reported(run, room_bag, tmp_path):
    path = room_bag(ground_truth=False).write()
    x, y, yaw = room_bag().poses(np.array([room_bag().start_ns]))[0]
    code, out, err = run(path, "--initial-pose", x, y, yaw, "--initial-cov", 0.01, 0.01, 0.01)
    assert code == 0
    assert "glass_nav replay: start: --initial-pose\n" in err
    assert "position error" not in out
    result = figures(tmp_path)
    assert result["position_rmse_m"] is None
    way = np.loadtxt(tmp_path / "out" / "trajectory.tum")
    assert np.hypot(*(way[-1, 1:3] - room_bag().poses(room_bag().stamps_ns)[-1, :2])) < 0.2


def test_without_anything_else_the_start_is_that_of_the_parameters(run, room_bag, tmp_path):
    (tmp_path / "p.yaml").write_text(
        "initial_pose_x: 2.0\ninitial_pose_y: 1.2\nmax_particles: 1234\nglobal_frame_id: map\nlaser_model_type: beam\n"
    )
    code, _, err = run(room_bag(ground_truth=False).write(), "--params", tmp_path / "p.yaml", "--max-scans", 3)
    assert code == 0
    assert "glass_nav replay: start: initial_pose_* of the parameters\n" in err
    assert "glass_nav replay: parameters that only a node uses: global_frame_id, laser_model_type\n" in err
    assert figures(tmp_path)["params"]["max_particles"] == 1234
    assert figures(tmp_path)["scans"] == 3


def test_frames_named_in_the_parameters_are_looked_for(run, room_bag, tmp_path):
    (tmp_path / "p.yaml").write_text("odom_frame_id: wheels\n")
    code, _, err = run(room_bag().write(), "--params", tmp_path / "p.yaml")
    assert code == 3
    assert err == (
        "glass_nav replay: room.bag: no transform wheels <- base_link or base_footprint; frames in tf: "
        "base_link, laser, odom\n"
    )


def test_a_search_anywhere_in_the_map_starts(run, room_bag, tmp_path):
    assert run(room_bag().write(), "--global", "--max-scans", 2)[0] == 0
    assert figures(tmp_path)["start"] == "anywhere in the map"


def test_a_rawlog_and_a_grid_map_of_mrpt_replay_too(run, tmp_path):
    code, _, _ = run(RAWLOGS / "observations.rawlog", "--scan-topic", "front", grid=RAWLOGS / "small.gridmap.gz")
    assert code == 0
    assert figures(tmp_path)["scans"] == 4


def one_bad_scan(**changes):
    return lambda index, fields: {**fields, **changes} if index == 3 else fields


@pytest.mark.long_run
@pytest.mark.parametrize(
    "changes, reason",
    [
        ({"angle_increment": 0.0}, "angle_increment must be finite and not 0 rad, got 0.0"),
        ({"stamp_ns": 10**12 - 10**11}, "time runs backwards"),
    ],
)
def test_a_bad_scan_is_counted_and_reported(run, room_bag, tmp_path, changes, reason):
    code, _, err = run(room_bag(scan_fields=one_bad_scan(**changes)).write())
    assert code == 0
    assert figures(tmp_path)["scans"] == 19
    assert figures(tmp_path)["scans_refused"] == 1
    assert figures(tmp_path)["refusals"] == {reason: 1}
    assert f"glass_nav replay: 1 scans rejected: {reason}\n" in err


@pytest.mark.long_run
@pytest.mark.parametrize(
    "change",
    [
        pytest.param(lambda ranges: np.full(60, np.nan), id="all NaN"),
        pytest.param(lambda ranges: np.full(60, np.inf), id="all inf"),
        pytest.param(lambda ranges: np.full(60, -np.inf), id="all too near"),
        pytest.param(lambda ranges: np.r_[np.nan, np.inf, -np.inf, 0.0, ranges[4:]], id="some of each"),
        pytest.param(lambda ranges: ranges[:5], id="fewer than the beams asked for"),
        pytest.param(lambda ranges: ranges[:1], id="one"),
    ],
)
@pytest.mark.parametrize("scans", [pytest.param({3}, id="in one scan"), pytest.param({3, 4, 5, 6}, id="in four")])
def test_odd_ranges_neither_stop_nor_derail_a_replay(run, room_bag, tmp_path, change, scans):
    code, _, _ = run(
        room_bag(
            scan_fields=lambda index, fields: {
                **fields,
                "ranges": change(fields["ranges"]) if index in scans else fields["ranges"],
            }
        ).write()
    )
    assert code == 0
    assert figures(tmp_path)["scans"] == 20
    assert figures(tmp_path)["position_max_m"] < 0.3
    with np.load(tmp_path / "out" / "beam_cases.npz") as cases:
        beams = len(change(np.ones(60)))
        assert (cases["cases"][3, beams:] == 255).all()
        assert (cases["cases"][3, :beams] <= 4).all()
        assert cases["cases"].shape == (20, 60)


@pytest.mark.parametrize(
    "fields, text",
    [
        (
            {"angle_increment": 0.0},
            "room.bag: none of its 20 scans can be used; 20 times: angle_increment must be finite "
            "and not 0 rad, got 0.0",
        ),
        ({"ranges": []}, "room.bag: none of its 20 scans can be used; 20 times: no ranges, a scan needs at least 1"),
    ],
)
def test_a_log_without_one_good_scan_is_refused(run, room_bag, fields, text):
    code, _, err = run(room_bag(scan_fields=lambda index, given: {**given, **fields}).write())
    assert code == 3
    assert err.splitlines()[-1] == f"glass_nav replay: {text}"


def last_line(run, log, *options, **more):
    code, out, err = run(log, *options, **more)
    assert (code, out) == (3, "")
    assert "Traceback" not in err
    assert len(err.splitlines()) == 1
    return err.strip()


def test_bad_input_is_one_line_and_exit_code_3(run, room_bag, room_map, tmp_path):
    path = room_bag().write()
    assert last_line(run, path, "--scan-topic", "/lidar") == (
        "glass_nav replay: room.bag: no topic /lidar; it has /ground_truth (geometry_msgs/PoseStamped), "
        "/scan (sensor_msgs/LaserScan), /tf (tf2_msgs/TFMessage), /tf_static (tf2_msgs/TFMessage)"
    )
    (tmp_path / "cut.bag").write_bytes(path.read_bytes()[:-1])
    assert last_line(run, tmp_path / "cut.bag") == (
        "glass_nav replay: cut.bag: cut short or never closed (its index is missing); "
        "`rosbag reindex cut.bag` may save what it holds"
    )
    assert last_line(run, path, grid=tmp_path / "no.yaml") == (
        "glass_nav replay: no.yaml: cannot be read: No such file or directory"
    )
    shutil.copy(room_map, tmp_path / "map.yaml")
    assert last_line(run, path, grid=tmp_path / "map.yaml") == (
        "glass_nav replay: map.yaml: its image map.pgm does not exist"
    )
    (tmp_path / "map.pgm").write_bytes((room_map.parent / "map.pgm").read_bytes()[:-99])
    assert last_line(run, path, grid=tmp_path / "map.yaml") == (
        "glass_nav replay: map.yaml: the data of its image map.pgm do not fit its 122 x 82 pixels: "
        "the file is cut short or damaged"
    )
    (tmp_path / "p.yaml").write_text("max_particle: 10\n")
    assert last_line(run, path, "--params", tmp_path / "p.yaml") == (
        "glass_nav replay: p.yaml: unknown parameter ~max_particle; did you mean ~max_particles?"
    )
    (tmp_path / "taken").write_text("")
    assert cli.main(["replay", str(path), "--map", str(room_map), "--out", str(tmp_path / "taken")]) == 3


def test_a_start_that_is_no_pose_is_refused(run, room_bag):
    code, _, err = run(room_bag().write(), "--initial-pose", "nan", 0, 0)
    assert code == 3
    assert err.splitlines()[-1].startswith("glass_nav replay: a pose needs finite x, y, yaw, got ")


@pytest.mark.parametrize(
    "options, text",
    [
        (["--seed", "-1"], "glass_nav replay: --seed must be >= 0, got -1"),
        (["--every", "0"], "glass_nav replay: --every must be >= 1, got 0"),
        (["--max-scans", "0"], "glass_nav replay: --max-scans must be >= 1, got 0"),
        (["--start", "-2"], "glass_nav replay: --start must be >= 0 s, got -2.0"),
        (["--duration", "0"], "glass_nav replay: --duration must be > 0 s, got 0.0"),
        (
            ["--global", "--initial-pose", "0", "0", "0"],
            "glass_nav replay: --global and --initial-pose exclude each other",
        ),
        (
            ["--fail-if", "position_p95_m"],
            "glass_nav replay: --fail-if must be METRIC, one of >= <= > <, and a number, "
            "such as position_p95_m>0.3, got 'position_p95_m'",
        ),
        (["--seed", "x"], "glass_nav replay: error: argument --seed: invalid int value: 'x'"),
    ],
)
def test_wrong_usage_is_exit_code_2(run, options, text):
    code, _, err = run("absent.bag", *options)
    assert code == 2
    assert err.splitlines()[-1] == text


@pytest.mark.parametrize(
    "options, code, line",
    [
        (["--fail-if", "position_p95_m>0.3", "--fail-if", "lost_share > 0"], 0, None),
        (
            ["--fail-if", "position_p95_m>0.3", "--fail-if", "scans<1000"],
            1,
            "glass_nav replay: scans is 20: failed by --fail-if scans < 1000",
        ),
        (
            ["--fail-if", "cases.accuracy<0.9"],
            3,
            "glass_nav replay: --fail-if cases.accuracy < 0.9: this log gives no "
            "cases.accuracy; it has no ground truth or no true cases for it, "
            "or --topology was not given",
        ),
    ],
)
def test_a_limit_on_a_figure_decides_the_exit_code(run, room_bag, tmp_path, options, code, line):
    told, _, err = run(room_bag().write(), "--no-picture", *options)
    assert told == code
    assert figures(tmp_path)["scans"] == 20  # the results are there whatever they are
    if line is not None:
        assert err.splitlines()[-1] == line


def test_two_parts_of_a_run_replay_as_one(room_bag, room_map, tmp_path, capsys):
    first = room_bag(scans=8).write()
    first.rename(tmp_path / "a_0.bag")
    second = room_bag(scans=20, scan_fields=lambda index, fields: fields if index >= 8 else None).write()
    assert (
        cli.main(
            [
                "replay",
                str(tmp_path / "a_0.bag"),
                str(second),
                "--map",
                str(room_map),
                "--out",
                str(tmp_path / "out"),
                "--no-picture",
            ]
        )
        == 0
    )
    assert "20 scans, " in capsys.readouterr().out
    assert figures(tmp_path)["scans"] == 20
    assert figures(tmp_path)["log"] == f"{tmp_path / 'a_0.bag'} {second}"


def test_help_and_no_command(capsys):
    assert cli.main(["--help"]) == 0
    assert "replay" in capsys.readouterr().out
    assert cli.main([]) == 2


def test_an_interrupted_replay_says_so(run, room_bag, monkeypatch):
    def interrupt(*_args, **_kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr(replay_run, "run", interrupt)
    code, _, err = run(room_bag().write())
    assert code == 130
    assert err.splitlines()[-1] == "glass_nav replay: interrupted, nothing written"


def test_a_package_that_is_not_built_is_said_in_one_line(capsys, monkeypatch):
    for module in ("glass_nav.cli.replay", "glass_nav.replay.prepared_replay"):
        monkeypatch.delitem(sys.modules, module)
        monkeypatch.delattr(module)
    monkeypatch.setitem(sys.modules, "glass_nav.localization.localizer", None)
    assert cli.main(["replay"]) == 3
    assert capsys.readouterr().err == (
        "glass_nav: glass_nav.localization.localizer is missing: build the package and source its setup.bash\n"
    )


@pytest.mark.long_run
def test_the_script_runs_by_itself(room_bag, room_map, tmp_path):
    done = subprocess.run(
        [
            sys.executable,
            str(REPO / "scripts" / "glass_nav"),
            "replay",
            str(room_bag().write()),
            "--map",
            str(room_map),
            "--out",
            str(tmp_path / "out"),
            "--max-scans",
            "2",
        ],
        capture_output=True,
        text=True,
        env=os.environ,
    )
    assert (done.returncode, "Traceback" in done.stderr) == (0, False), done.stderr
    assert figures(tmp_path)["scans"] == 2


TRUE_BEAMS = {"true_beams": (("/true_beams", "TrueBeams"),)}


@pytest.mark.long_run
def test_a_log_with_the_truth_about_its_beams_has_its_cases_scored(run, room_bag, tmp_path):
    code, out, err = run(room_bag(**TRUE_BEAMS).write())
    assert code == 0
    assert "glass_nav replay: true cases from /true_beams\n" in err
    result = figures(tmp_path)
    cases = result["cases"]
    assert result["scans_with_true_cases"] == 20
    assert cases["beams"] == cases["beams_answered"] == 20 * 60
    assert cases["accuracy"] == pytest.approx(result["case_share"]["1"])  # a room without glass: all are diffuse
    assert cases["accuracy"] > 0.95
    assert cases["recall"][1] == cases["accuracy"]
    assert cases["macro_f1_cases"] == [1]
    assert result["scan_surfaces"]["at_pane"] == 0
    assert result["scan_surfaces"]["others"] == 20 * 60
    assert result["scan_surfaces"]["scans"] == 20
    lines = out.splitlines()
    assert any(line.startswith(f"reported cases  {cases['accuracy']:.3f} of 1200 beams correct, ") for line in lines)
    assert any(line.startswith("  1 first surface ") and line.endswith(f"{cases['f1'][1]:.3f}") for line in lines)
    assert any(
        line.startswith("scan_surfaces   - of 0 beams that passed or were mirrored at a pane cut within 0.15 m of it, ")
        for line in lines
    )
    assert (tmp_path / "out" / "cases.png").stat().st_size > 10_000
    with np.load(tmp_path / "out" / "beam_cases.npz") as told:
        np.testing.assert_array_equal(told["true_cases"], np.ones((20, 60), np.uint8))


def test_scans_without_truth_are_left_out_of_the_scores(run, room_bag, tmp_path):
    bag = room_bag(
        true_beams=(("/true_cases", "BeamCases"),), true_fields=lambda index, fields: fields if index % 2 else None
    )
    assert run(bag.write(), "--no-picture")[0] == 0
    result = figures(tmp_path)
    assert result["scans_with_true_cases"] == 10
    assert result["cases"]["beams"] == 10 * 60
    assert result["scan_surfaces"] is None
    assert not (tmp_path / "out" / "cases.png").exists()
    with np.load(tmp_path / "out" / "beam_cases.npz") as told:
        assert (told["true_cases"][::2] == 255).all()
        assert (told["true_cases"][1::2] == 1).all()


def test_only_part_of_a_log_is_scored_against_its_own_truth(run, room_bag, tmp_path):
    def third_differs(index, fields):
        return {**fields, "cases": np.full(60, 4)} if index == 6 else fields

    assert (
        run(
            room_bag(**TRUE_BEAMS, true_fields=third_differs).write(),
            "--no-picture",
            "--start",
            0.3,
            "--every",
            3,
            "--max-scans",
            4,
        )[0]
        == 0
    )
    assert figures(tmp_path)["cases"]["true_share"] == [0.0, 0.75, 0.0, 0.0, 0.25]  # scans 3, 6, 9, 12


@pytest.mark.long_run
def test_the_truth_is_not_looked_at_when_it_is_not_wanted(run, room_bag, tmp_path):
    code, out, _ = run(room_bag(**TRUE_BEAMS).write(), "--true-beams", "none")
    assert code == 0
    assert figures(tmp_path)["cases"] is figures(tmp_path)["scans_with_true_cases"] is None
    assert "reported cases" not in out
    assert not (tmp_path / "out" / "cases.png").exists()


def test_truth_about_other_beams_is_refused(run, room_bag):
    bag = room_bag(
        **TRUE_BEAMS, true_fields=lambda index, fields: {**fields, "cases": np.ones(50), "crossing": np.ones(50)}
    )
    code, _, err = run(bag.write())
    assert code == 3
    assert err.splitlines()[-1] == (
        "glass_nav replay: room.bag: the truth at 1000.000 s is about 50 beams, the scan has 60"
    )
