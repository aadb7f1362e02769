"""The subcommand as a user calls it, on small bags of a robot in a room; the page in a real browser."""

from __future__ import annotations

import csv
import json

import browser
import numpy as np
import pytest

FILES = {"compare.html", "compare.json", "compare.png", "runs.csv", "timings.csv"}


@pytest.fixture
def few(tmp_path):
    """Parameters that make another run."""
    path = tmp_path / "few.yaml"
    path.write_text("max_particles: 300\nmin_particles: 100\n")
    return path


def rows(folder):
    with (folder / "runs.csv").open() as file:
        return list(csv.DictReader(file))


@pytest.mark.long_run
def test_any_number_of_jobs_gives_the_same_answer_bit_for_bit(run, room_bag, room_map, few, tmp_path):
    path = room_bag(scans=12).write()
    for jobs in (1, 2):
        code, out, _ = run(
            "compare",
            "default",
            f"few={few}",
            "--log",
            f"{path}={room_map}",
            "--seeds",
            2,
            "--first-seed",
            5,
            "--jobs",
            jobs,
            "--out",
            tmp_path / f"out{jobs}",
        )
        assert code == 0
        assert out.startswith("4 runs over 1 log, 12 scans compared; mean ± 95 % interval over seeds\n")
        assert "position error, mean [m]" in out and "few − default" in out
    for name in ("runs.csv", "compare.json"):
        assert (tmp_path / "out1" / name).read_bytes() == (tmp_path / "out2" / name).read_bytes()
    found = rows(tmp_path / "out1")
    assert [(row["contestant"], row["seed"]) for row in found] == [
        ("default", "5"),
        ("default", "6"),
        ("few", "5"),
        ("few", "6"),
    ]
    assert len({row["trajectory_sha256"] for row in found}) == 4
    page = browser.opened(tmp_path / "out1" / "compare.html", tmp_path)
    assert (page.requests, page.console) == ([], [])
    assert page.document.count("<img ") == 3


@pytest.mark.long_run
@pytest.mark.parametrize(
    "limits, code, told",
    [
        (["position_p95_m>0.4", "position_mean_m>0.25"], 0, None),
        (
            ["position_p95_m>0.4", "position_mean_m>0.15"],
            1,
            "glass_nav compare: position_mean_m of amcl is 0.2: failed by --fail-if position_mean_m > 0.15\n",
        ),
        (
            ["case_accuracy<0.9"],
            3,
            "glass_nav compare: --fail-if case_accuracy < 0.9: no contestant has case_accuracy; ",
        ),
        (["lost_shar>0"], 2, "glass_nav compare: --fail-if: unknown metric 'lost_shar'; did you mean lost_share?"),
        (["position_mean_m"], 2, "glass_nav compare: --fail-if must be METRIC, one of >= <= > <, and a number, "),
    ],
)
def test_a_limit_makes_the_exit_code(run, room_bag, room_map, tmp_path, limits, code, told):
    """Poses at the scans 5, 10 and 15, wrong by 0.1, 0.2 and 0.3 m."""
    path = room_bag(amcl_error_m=0.1).write()
    options = [option for limit in limits for option in ("--fail-if", limit)]
    found, _, err = run(
        "compare", "amcl=topic:/amcl_pose", "--log", f"{path}={room_map}", "--out", tmp_path / "out", *options
    )
    assert found == code
    assert told is None or told in err
    assert ("failed by" in err) == (code == 1)


@pytest.mark.long_run
def test_what_another_localization_left_in_the_bag_is_measured_as_ours_is(run, room_bag, room_map, tmp_path):
    """Its poses come at the scans 5, 10 and 15, wrong by 0.1, 0.2 and 0.3 m; odometry is exact."""
    path = room_bag(amcl_error_m=0.1).write()
    code, out, err = run(
        "compare",
        "amcl=topic:/amcl_pose",
        "tf=tf:map",
        "default",
        "--log",
        f"{path}={room_map}",
        "--seeds",
        1,
        "--out",
        tmp_path / "out",
    )
    assert code == 0
    assert "glass_nav compare: room.bag: compared over the 15 of 20 scans that all runs have a pose for\n" in err
    amcl, tf, ours = rows(tmp_path / "out")
    assert float(amcl["position_mean_m"]) == pytest.approx(0.2)
    # tf answers between the transforms, from one scan before the first on; 0.3 m holds at the end
    assert float(tf["position_mean_m"]) == pytest.approx(np.mean(np.minimum(0.1 * np.arange(5, 20) / 5.0, 0.3)))
    assert float(tf["yaw_mean_deg"]) == pytest.approx(0.0, abs=1e-6)
    assert (amcl["scans"], tf["scans"], ours["scans"]) == ("15", "16", "20")
    assert (amcl["seed"], amcl["localized_share"], ours["seed"]) == ("", "", "0")
    assert float(ours["position_mean_m"]) < 0.1
    assert "default against amcl (-0.1" in (tmp_path / "out" / "compare.html").read_text()


@pytest.mark.long_run
def test_a_log_that_has_no_recorded_pose_in_time_is_reported(run, room_bag, room_map, tmp_path):
    path = room_bag(amcl_error_m=0.1).write()
    options = ("compare", "topic:/amcl_pose", "--log", f"{path}={room_map}", "--out", tmp_path / "out")
    code, _, err = run(*options, "--max-scans", 4)
    assert (code, err.splitlines()[-1]) == (
        3,
        "glass_nav compare: none of 1 runs could be run; the first: room.bag: topic:/amcl_pose has no pose before "
        "the last scan",
    )
    assert run(*options, "--start", 60)[2].endswith("the first: room.bag: none of its scans can be used\n")
    assert run(*options, "--start", 1.0, "--max-scans", 2)[0] == 0  # carried on from before
    assert [row["scans"] for row in rows(tmp_path / "out")] == ["2"]


@pytest.mark.long_run
def test_without_a_ground_truth_ours_start_where_the_recorded_poses_have_the_robot(run, room_bag, room_map, tmp_path):
    """Known from scan 5 on, then 0.1 m too far: carried back to the first scan by odometry."""
    path = room_bag(amcl_error_m=0.1, ground_truth=False).write()
    options = ("compare", "amcl=topic:/amcl_pose", "default", "--log", f"{path}={room_map}", "--seeds", 1)
    code, out, err = run(*options, "--out", tmp_path / "out")
    assert code == 0
    assert "glass_nav compare: room.bag: no ground truth: all start where topic:/amcl_pose has the robot\n" in err
    assert "start: " not in err
    found = {row["contestant"]: row for row in rows(tmp_path / "out")}
    assert "position_mean_m" not in found["default"]
    assert 0.1 < float(found["default"]["apart_mean_m"]) < 0.3  # ours is right; the other is 0.2 m off in the mean
    code, _, err = run(*options, "--out", tmp_path / "other", "--initial-pose", 2.0, 1.2, 0.0)
    assert (code, "start: --initial-pose" in err) == (0, True)


@pytest.mark.long_run
def test_results_of_replays_are_compared_as_new_runs_are(run, room_bag, room_map, few, tmp_path):
    path = room_bag(scans=8, true_beams=(("/true_beams", "TrueBeams"),)).write()
    for seed in (0, 1):
        assert (
            run("replay", path, "--map", room_map, "--seed", seed, "--no-picture", "--out", tmp_path / f"old{seed}")[0]
            == 0
        )
    old = [f"old={tmp_path}/old0", f"old={tmp_path}/old1"]
    code, _, err = run(
        "compare",
        *old,
        f"new={few}",
        "again=default",
        "--log",
        f"{path}={room_map}",
        "--seeds",
        2,
        "--out",
        tmp_path / "out",
    )
    assert code == 0
    found = {(row["contestant"], row["seed"]): row for row in rows(tmp_path / "out")}
    assert len(found) == 6
    for seed in "01":  # the files of a replay hold six digits
        for name in ("position_mean_m", "case_accuracy"):
            assert float(found["old", seed][name]) == pytest.approx(float(found["again", seed][name]), abs=2e-6)
    assert json.loads((tmp_path / "out" / "compare.json").read_text())["what"]["new"].startswith("parameters ")
    code, out, err = run("compare", *old, "--out", tmp_path / "alone")
    assert (code, err) == (0, "")
    assert out.startswith("2 runs over 1 log, 8 scans compared")
    assert {file.name for file in (tmp_path / "alone").iterdir()} == FILES | {"errors_01.png", "ways_01.png"}


@pytest.mark.long_run
def test_several_logs_are_told_apart_and_together(run, room_bag, room_map, tmp_path):
    first = room_bag(scans=6).write().rename(tmp_path / "first.bag")
    room_bag(scans=8, ground_truth=False).write().rename(tmp_path / "second.bag")
    x, y, yaw = room_bag().poses(room_bag().stamps_ns[:1])[0]
    (tmp_path / "logs.yaml").write_text(
        json.dumps([{"log": "second.bag", "map": str(room_map), "initial_pose": [x, y, yaw]}])
    )
    code, out, _ = run(
        "compare",
        "default",
        "--log",
        f"{first}={room_map}",
        "--logs",
        tmp_path / "logs.yaml",
        "--seeds",
        1,
        "--out",
        tmp_path / "out",
    )
    assert code == 0
    assert out.startswith("2 runs over 2 logs, 14 scans compared")
    means = json.loads((tmp_path / "out" / "compare.json").read_text())["means"]["default"]
    assert means["all"]["position_mean_m"]["value"] is None  # nobody knows it in the second
    assert means["first.bag"]["position_mean_m"]["value"]["mean"] < 0.2
    assert {file.name for file in (tmp_path / "out").iterdir()} == FILES | {
        "errors_01.png",
        "ways_01.png",
        "ways_02.png",
    }
    assert "<h2>second.bag</h2>" in (tmp_path / "out" / "compare.html").read_text()


@pytest.mark.long_run
def test_a_run_that_fails_is_named_and_the_others_are_compared(run, room_bag, room_map, tmp_path):
    path = room_bag(scans=6).write()
    (tmp_path / "elsewhere.yaml").write_text("odom_frame_id: wheels\n")
    code, out, err = run(
        "compare",
        "default",
        "amcl=topic:/amcl_pose",
        f"elsewhere={tmp_path}/elsewhere.yaml",
        "--log",
        f"{path}={room_map}",
        "--seeds",
        1,
        "--out",
        tmp_path / "out",
    )
    assert code == 3
    assert "glass_nav compare: amcl over room.bag: room.bag: no topic /amcl_pose; it has " in err
    assert "glass_nav compare: elsewhere over room.bag, seed 0: room.bag: no transform wheels <- base_link" in err
    assert err.endswith("glass_nav compare: 2 of 3 runs failed, see above; the others are compared\n")
    assert [row["contestant"] for row in rows(tmp_path / "out")] == ["default"]
    assert out.startswith("1 run over 1 log, 6 scans compared")


def test_what_cannot_be_compared_is_refused_in_one_line(run, room_bag, room_map, tmp_path):
    path = room_bag(scans=6).write()
    out = ("--out", tmp_path / "out")
    log = ("--log", f"{path}={room_map}")
    for options, line in [
        (("default",), "default needs a log: --log BAG=MAP"),
        (
            ("gone", *log),
            "gone: expected a folder of results, a .yaml of parameters, 'default', topic:/TOPIC or tf:FRAME",
        ),
        (("default", "--log", path), "--log must be BAG=MAP, got 'room.bag'"),
        (("default", *log, "--seeds", 0), "--seeds must be >= 1, got 0"),
        (("default", *log, "--first-seed", -1), "--first-seed must be >= 0, got -1"),
        (("default", *log, "--jobs", 0), "--jobs must be >= 1, got 0"),
        (("default", *log, "--jobs", 2, "--scheduler", "tcp://a:1"), "--jobs and --scheduler exclude each other"),
        (("default", *log, "--start", -1), "--start must be >= 0 s, got -1.0"),
    ]:
        assert run("compare", *options, *out) == (2, "", f"glass_nav compare: {line}\n")
    (tmp_path / "empty").mkdir()
    assert run("compare", tmp_path / "empty", *out) == (
        3,
        "",
        "glass_nav compare: empty: holds no results of a replay (there is no metrics.json)\n",
    )
    (tmp_path / "odd.yaml").write_text("max_particels: 3\n")
    code, _, err = run("compare", tmp_path / "odd.yaml", *log, *out)
    assert (code, err) == (
        3,
        "glass_nav compare: odd.yaml: unknown parameter ~max_particels; did you mean ~max_particles?\n",
    )
    code, _, err = run("compare", "default", "--log", f"{tmp_path}/gone.bag={room_map}", *out)
    assert (code, err) == (3, "glass_nav compare: gone.bag: does not exist\n")
    code, _, err = run("compare", "topic:/amcl_pose", *log, *out)
    assert code == 3
    assert err.splitlines()[-1].startswith(
        "glass_nav compare: none of 1 runs could be run; the first: room.bag: no topic /amcl_pose"
    )
    assert not (tmp_path / "out").exists()
