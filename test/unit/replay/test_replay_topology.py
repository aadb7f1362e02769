"""glass_nav replay --topology as a user calls it, on a robot that was simulated in a T of corridors."""

from __future__ import annotations

import csv
import json
from types import SimpleNamespace

import numpy as np
import pytest

from glass_nav.cli import main as cli
from glass_nav.cli.simulate import write_frame
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.recording.bag_writer import BagWriter
from glass_nav.replay import replay_topology
from glass_nav.simulation import building_map, lidar
from glass_nav.simulation.building import Building, Wall
from glass_nav.simulation.simulation import Simulation
from glass_nav.world import map_file

OUTLINE_M = [
    [-6.0, -1.05],
    [5.0, -1.05],
    [5.0, 1.05],
    [1.05, 1.05],
    [1.05, 5.0],
    [-1.05, 5.0],
    [-1.05, 1.05],
    [-6.0, 1.05],
    [-6.0, -1.05],
]


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """Folder with run.bag and run.map.yaml: from the left through the meetpoint to the right."""
    folder = tmp_path_factory.mktemp("drive")
    building = Building(walls=(Wall(np.array(OUTLINE_M), 0.1),))
    simulation = Simulation(building, lidar.preset("coated"), seed=1, scan_rate_hz=5.0)
    with BagWriter(folder / "run.bag") as bag:
        bag.mounting(simulation.stamp_ns, simulation.base_from_laser)
        for frame in simulation.drive(np.array([[-3.2, 0.0], [1.6, 0.0]])):
            write_frame(bag, frame, simulation.scan_period_s)
    map_file.save(building_map.draw(building), folder / "run.map.yaml", ".png")
    return folder


@pytest.fixture
def run(drive, tmp_path, capsys):
    """run(option, ...): exit code, stdout, stderr; the results are in tmp_path/out."""

    def command(*options):
        code = cli.main(
            [
                "replay",
                str(drive / "run.bag"),
                "--map",
                str(drive / "run.map.yaml"),
                "--out",
                str(tmp_path / "out"),
                *map(str, options),
            ]
        )
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return command


@pytest.mark.long_run
def test_a_meetpoint_on_the_way_is_seen_and_told(run, tmp_path):
    code, out, _ = run("--topology")
    assert code == 0
    figures = json.loads((tmp_path / "out" / "metrics.json").read_text())["topology"]
    assert (figures["passed"], figures["seen"], figures["invented"], figures["degree_right"]) == (1, 1, 0, 1)
    assert figures["position_off_m"]["median_abs"] < 0.1
    with (tmp_path / "out" / "topology.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert (row["verdict"], row["degree"], row["seen_degree"]) == ("seen", "3", "3")
    assert float(row["x_m"]) == pytest.approx(0.0, abs=0.06)
    assert (tmp_path / "out" / "topology.png").stat().st_size > 10_000
    told = [line.split() for line in out.splitlines() if line.startswith("  meetpoints")]
    assert told == [["meetpoints", "1", "1", "(100", "%)", "0", "0", "100", "%"]]


@pytest.mark.long_run
def test_an_atlas_may_be_given_and_figures_of_it_may_decide_the_exit_code(run, drive, tmp_path):
    assert cli.main(["atlas", "build", str(drive / "run.map.yaml"), "--out", str(tmp_path / "t")]) == 0
    code, _, err = run(
        "--topology",
        tmp_path / "t",
        "--no-picture",
        "--ground-truth",
        "none",
        "--initial-pose",
        -3.2,
        0,
        0,
        "--fail-if",
        "topology.seen>0",
    )
    assert code == 1, err
    assert "topology.seen is 1: failed by --fail-if topology.seen > 0" in err
    assert not (tmp_path / "out" / "topology.png").exists()


def test_an_atlas_of_another_map_is_refused(run, tmp_path):
    code, _, err = run("--topology", "opaque_office")
    assert code == 3
    assert "was made from another map than" in err
    assert not (tmp_path / "out").exists()


def test_without_a_reference_the_filter_says_where_the_robot_was_unless_it_is_lost():
    result = SimpleNamespace(reference=None, states=["LOCALIZED", "LOST", "UNCERTAIN"], map_from_base=np.ones((3, 3)))
    assert np.isfinite(replay_topology.poses(result)).all(axis=1).tolist() == [True, False, True]


def test_where_the_reference_does_not_reach_nobody_knows_where_the_robot_was():
    reference = Trajectory(np.array([0, 10]), np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    result = SimpleNamespace(
        reference=reference, stamps_ns=np.array([5, 99]), errors=SimpleNamespace(matched=np.array([True, False]))
    )
    assert np.isfinite(replay_topology.poses(result)).all(axis=1).tolist() == [True, False]
