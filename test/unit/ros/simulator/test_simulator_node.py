"""The node's parameters; the running node is in test/rostest/demo.test."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from glass_nav import params
from glass_nav.params import ParamError
from glass_nav.ros.simulator import simulator_node
from glass_nav.ros.simulator.simulator_node import SimulatorNodeParams

CONFIG = Path(__file__).resolve().parents[4] / "config" / "simulator.yaml"


def test_the_file_of_parameters_names_them_all_with_their_defaults():
    given = yaml.safe_load(CONFIG.read_text())
    assert given == params.as_mapping(SimulatorNodeParams())
    assert params.load(SimulatorNodeParams, given, "/simulator") == SimulatorNodeParams()


@pytest.mark.parametrize(
    "given, text",
    [
        ({"speed_factor": -1.0}, "~speed_factor must be >= 0, got -1.0"),
        ({"speed_factor": float("inf")}, "~speed_factor must be >= 0, got inf"),
        ({"speed_factor": "fast"}, "~speed_factor must be float, got 'fast'"),
        ({"beams": -1}, "~beams must be >= 0, got -1"),
        ({"map_resolution_m": 0.0}, "~map_resolution_m must be 0.01 to 1 m, got 0.0"),
        (
            {"odom_frame_id": "map"},
            "~global_frame_id, ~odom_frame_id, ~base_frame_id, ~laser_frame_id and "
            "~emitter_frame_id must differ and name a frame, got 'map', 'map', 'base_link', "
            "'laser', 'emitter'",
        ),
        (
            {"laser_frame_id": ""},
            "~global_frame_id, ~odom_frame_id, ~base_frame_id, ~laser_frame_id and "
            "~emitter_frame_id must differ and name a frame, got 'map', 'odom', 'base_link', '', "
            "'emitter'",
        ),
        ({"glass_erased": 1.5}, "~glass_erased must be 0 to 1, got 1.5"),
        ({"speed": 1.0}, "unknown parameter ~speed"),
    ],
)
def test_parameters_that_cannot_be_used_are_refused(given, text):
    with pytest.raises(ParamError) as caught:
        params.load(SimulatorNodeParams, given, "/simulator")
    assert str(caught.value).startswith(f"/simulator: {text}")


@pytest.mark.parametrize(
    "given, text",
    [
        ({"building": "palace"}, "palace: no such file, nor a building of the package, which are "),
        ({"lidar": "strong"}, "unknown lidar preset 'strong', known are sensitive, weak, coated"),
        ({"echo": "loudest"}, "lidar echo must be one of first, strongest, last, got 'loudest'"),
        ({"beams": 1}, "lidar beams must be a whole number >= 2, got 1"),
        ({"robot": "car"}, "robot must be diff or omni, got 'car'"),
        ({"seed": -1}, "seed must be a whole number >= 0, got -1"),
        ({"changed": 2.0}, "changed share must be 0 to 1, got 2.0"),
        ({"scan_rate_hz": 0.0}, "scan rate must be 0.1 to 1000 Hz, got 0.0"),
        ({"landmark_reading_deg": 0.1}, "a landmark scanner needs 0 < motor step <= reading step <= "),
        ({"landmark_move_s": 0.0}, "a move of a landmark scanner must take > 0 s, got 0.0"),
        ({"emitter_x_m": float("nan")}, "the emitter's pose on the robot must be finite x, y, yaw, got "),
        ({"start": "here"}, "start must be x y yaw in m and rad, or random, got 'here'"),
        ({"braking_factor": 0.0}, "braking_factor of the robot must be > 0 and finite, got 0.0"),
        ({"path": "nowhere"}, "glass_office: no path 'nowhere', it has "),
        (
            {"path": "first", "path_speed_m_s": 0.0},
            "speed_m_s of the path follower must be > 0 m/s and finite, got 0.0",
        ),
    ],
)
def test_what_cannot_be_simulated_is_a_line(given, text):
    with pytest.raises(ValueError) as caught:
        simulator_node._drive(params.load(SimulatorNodeParams, given, "/simulator"))
    assert str(caught.value).startswith(text)
    assert "\n" not in str(caught.value)


def test_a_path_and_a_lidar_are_those_asked_for():
    drive = simulator_node._drive(SimulatorNodeParams(path="first", beams=33, echo="last", laser_x_m=0.3))
    assert drive.follower is not None
    assert (drive.simulation.map_from_base == drive.follower.start).all()
    assert (drive.simulation.lidar_model.beams, drive.simulation.lidar_model.echo) == (33, "last")
    assert drive.simulation.base_from_laser.tolist() == [0.3, 0.0, 0.0]
    assert simulator_node._drive(SimulatorNodeParams()).follower is None
    assert simulator_node._drive(SimulatorNodeParams(path="none")).follower is None


def test_a_robot_may_start_anywhere_of_a_building_with_film_on_its_glass():
    drive = simulator_node._drive(SimulatorNodeParams(opaque=True, start="random", seed=3))
    assert (drive.simulation.building.surfaces.kind == 0).all()
    again = simulator_node._drive(SimulatorNodeParams(start="random", seed=3, path="first"))
    assert (again.simulation.map_from_base == drive.simulation.map_from_base).all()
