"""Who steers the simulated robot, and when its time goes on."""

from __future__ import annotations

import logging

import numpy as np
import pytest

from glass_nav.simulation.path_follower import PathFollower, PathFollowerParams
from glass_nav.simulation.robot import RobotParams
from glass_nav.simulation.steering import Audience, Pace, Steering

SECOND = 1_000_000_000
NOBODY, LISTENER, ANSWERED = Audience(0, 0, 1.0), Audience(0, 1, 1.0), Audience(1, 1, 1.0)
STANDS = [0.0, 0.0, 0.0]


def follower():
    return PathFollower(np.array([[0.0, 0.0], [2.0, 0.0]]), RobotParams(), PathFollowerParams(speed_m_s=0.5))


def velocity(steering, audience=LISTENER, stamp_ns=10 * SECOND, x=0.5):
    return steering.velocity(stamp_ns, np.array([x, 0.0, 0.0]), audience).tolist()


def test_a_command_goes_before_the_path_until_it_is_old():
    steering = Steering(follower(), repeat=False, wait_for_answer=False)
    steering.take(np.array([0.1, 0.0, 0.3]), 10 * SECOND)
    assert velocity(steering, stamp_ns=10 * SECOND + 499_999_999) == [0.1, 0.0, 0.3]
    assert velocity(steering, stamp_ns=10 * SECOND + 500_000_000) == [0.5, 0.0, 0.0]


def test_a_command_to_move_is_overdue_once_it_is_old_and_until_nobody_waits_for_the_next():
    steering = Steering(None, repeat=False, wait_for_answer=False)
    assert not steering.is_overdue(10 * SECOND)  # there was none
    for begun_ns in (10 * SECOND, 20 * SECOND):
        steering.take(np.array([0.1, 0.0, 0.3]), begun_ns)
        assert not steering.is_overdue(begun_ns + 199_999_999)
        assert steering.is_overdue(begun_ns + 200_000_000)
        steering.give_up_waiting()
        assert not steering.is_overdue(begun_ns + 200_000_000)
    steering.take(np.zeros(3), 30 * SECOND)  # to stand: no next command is needed
    assert not steering.is_overdue(31 * SECOND)


def test_without_a_path_a_robot_whose_driver_fell_silent_stops():
    steering = Steering(None, repeat=False, wait_for_answer=False)
    assert velocity(steering) == STANDS and not steering.waits


@pytest.mark.parametrize(
    "wait_for_answer, audience, drives",
    [
        (False, NOBODY, False),
        (False, LISTENER, True),
        (True, LISTENER, False),
        (True, ANSWERED, True),
        (True, Audience(0, 1, 30.5), True),
    ],
)
def test_a_path_begins_once_somebody_follows_it(wait_for_answer, audience, drives):
    steering = Steering(follower(), repeat=False, wait_for_answer=wait_for_answer)
    assert steering.waits
    assert (velocity(steering, audience) != STANDS) == drives != steering.waits
    if drives:  # and goes on when they leave
        assert velocity(steering, NOBODY) != STANDS


def test_it_is_said_that_nobody_answered(caplog):
    logging.getLogger("glass_nav").propagate = True
    caplog.set_level(logging.INFO, logger="glass_nav")
    velocity(Steering(follower(), repeat=False, wait_for_answer=True), Audience(0, 1, 31.0))
    assert [record.message for record in caplog.records] == [
        "the path begins without a localization: no answer for 30 s",
        "driving 2.0 m",
    ]


@pytest.mark.parametrize("repeat", [True, False])
def test_a_path_may_be_driven_back_and_again(repeat):
    steering = Steering(follower(), repeat, wait_for_answer=False)
    velocity(steering, x=0.0)
    velocity(steering, x=2.0)
    assert (velocity(steering, x=2.0) != STANDS) == repeat


def test_simulated_time_waits_for_the_wall_clock():
    pace = Pace(0, 100.0)
    assert pace.wait_s(SECOND, 2.0, 100.1) == pytest.approx(0.4)
    assert pace.wait_s(SECOND, 2.0, 101.4) == 0.0  # late: made up for
    assert pace.wait_s(SECOND, 2.0, 102.5) == pytest.approx(-2.0)  # too late: not any more
    assert pace.wait_s(2 * SECOND, 2.0, 102.5) == pytest.approx(0.5)


def test_as_fast_as_possible_nothing_is_waited_for_or_made_up_for():
    pace = Pace(0, 100.0)
    assert pace.wait_s(50 * SECOND, 0.0, 101.0) == 0.0
    assert pace.wait_s(51 * SECOND, 1.0, 101.0) == pytest.approx(1.0)
