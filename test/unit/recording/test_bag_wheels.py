"""A bag of a robot that sends encoder counts: the same odometry as tf's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_buildings import COARSE, walled

from glass_nav.cli import simulate
from glass_nav.geometry import angles
from glass_nav.recording.bag_writer import BagWriter
from glass_nav.recording.log_file import open_log
from glass_nav.recording.recording import LogOptions, RecordingError, Step
from glass_nav.sensing.wheel_odometry import WheelParams
from glass_nav.simulation import odometry
from glass_nav.simulation.simulation import Simulation

HALL = walled(np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0]]))
WHEELS = LogOptions(wheels=WheelParams(("joint_states",)))
SECONDS = 12


def bends(second):
    """An S, with a turn on the spot and a piece backwards."""
    if second < 2:
        return np.array([0.0, 0.0, 0.9])
    return np.array([-0.4 if second == 6 else 0.8, 0.0, 0.7 * np.sin(second)])


DRIVES = {"straight": lambda second: np.array([0.8, 0.0, 0.0]), "curved": bends}


@pytest.fixture(scope="module", params=DRIVES)
def bag(request, tmp_path_factory):
    """A drive through a hall with wheels that do not err."""
    path = tmp_path_factory.mktemp("wheels") / f"{request.param}.bag"
    lidar = replace(COARSE, beams=31)
    simulation = Simulation(
        HALL, lidar, odometry=odometry.EXACT, start=np.array([4.0, 10.0, 0.1]), scan_rate_hz=4.0, turn_time_s=0.1
    )
    with BagWriter(path) as writer:
        writer.mounting(simulation.stamp_ns, simulation.base_from_laser)
        simulate.write_frame(writer, simulation.look(), simulation.scan_period_s)
        for step in range(4 * SECONDS):
            frame = simulation.step(0.25, DRIVES[request.param](step // 4))
            simulate.write_frame(writer, frame, simulation.scan_period_s)
    return path


def odometries(path, options):
    recording = open_log(path, options)
    return recording.notes, np.array([step.odom_from_base for step in recording if isinstance(step, Step)])


@pytest.mark.long_run
def test_wheels_and_tf_give_the_same_trajectory(bag):
    _, by_tf = odometries(bag, LogOptions())
    notes, by_wheels = odometries(bag, WHEELS)
    assert "odometry from the counts of joint_states" in notes
    assert len(by_wheels) == len(by_tf) > 40 and np.ptp(by_tf[:, 0]) > 1.0
    assert np.hypot(*(by_wheels - by_tf)[:, :2].T).max() < 1e-3
    assert np.abs(angles.wrap(by_wheels - by_tf)[:, 2]).max() < 1e-4


def test_what_holds_no_counts_is_refused(bag):
    with pytest.raises(RecordingError, match=r"no topic /wheels \(~wheel_topics\); it has /clock"):
        open_log(bag, replace(WHEELS, wheels=WheelParams(("wheels",))))
    with pytest.raises(RecordingError, match="scan: a sensor_msgs__msg__LaserScan|scan: a LaserScan"):
        open_log(bag, replace(WHEELS, wheels=WheelParams(("scan",))))
    with pytest.raises(RecordingError, match="/joint_states hold no counts of both wheels at the same time"):
        open_log(bag, replace(WHEELS, wheels=WheelParams(("joint_states",), wheel_joints=("l", "r"))))
    with pytest.raises(RecordingError, match="a rawlog has no topics, so that ~wheel_topics need a bag"):
        open_log("run.rawlog", WHEELS)
