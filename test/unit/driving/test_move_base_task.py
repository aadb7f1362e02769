"""A goal that move_base drives to: sent, held and sent again, ended by it, or by its silence."""

from __future__ import annotations

import math

import numpy as np
import pytest

from glass_nav.driving.move_base_task import MoveBaseTask
from glass_nav.driving.tasks import Ending, Moment
from glass_nav.vocabulary import Outcome

GOAL = np.array([3.0, 4.0, 0.0])
THERE = Ending(Outcome.SUCCEEDED, "is at the goal")


class MoveBase:
    """The side of move_base, as a test wants it."""

    name = "/move_base"

    def __init__(self):
        self.is_there = self.lives = True
        self.sent, self.cancelled = [], 0

    def was_heard(self):
        return self.lives

    def send(self, map_from_goal, done):
        self.sent.append((map_from_goal, done))

    def cancel(self):
        self.cancelled += 1


def steps(task, seconds, at=(0.0, 0.0, 0.0)):
    for _ in range(round(seconds / 0.05)):
        command = task.step(Moment(np.zeros(3), np.array(at), np.zeros(3), 0.05))
        assert not command.any()


@pytest.fixture
def move_base():
    return MoveBase()


@pytest.fixture
def task(move_base):
    return MoveBaseTask(move_base, GOAL, wait_s=60.0, patience_s=2.0)


def test_the_goal_is_sent_once_and_its_end_is_the_end(move_base, task):
    move_base.is_there = False
    steps(task, 0.5)
    assert not move_base.sent and task.reason == "waiting for /move_base"
    move_base.is_there = True
    steps(task, 0.5)
    assert len(move_base.sent) == 1 and task.remaining_m == 5.0 and task.reason == "/move_base drives"
    assert task.ending is None
    move_base.sent[0][1](THERE)
    steps(task, 0.05)
    assert task.ending == THERE
    task.cancel()
    assert not move_base.cancelled  # nothing is on any more


def test_held_it_is_called_off_and_then_sent_again(move_base, task):
    steps(task, 0.5)
    for _ in range(3):
        task.hold()
    assert move_base.cancelled == 1
    move_base.sent[0][1](Ending(Outcome.NO_MOVE_BASE, "ended the goal, preempted"))  # by hold()
    steps(task, 0.5)
    assert task.ending is None and len(move_base.sent) == 2
    move_base.sent[1][1](THERE)
    steps(task, 0.05)
    assert task.ending == THERE


def test_cancelled_before_it_was_sent_there_is_nothing_to_call_off(move_base, task):
    task.cancel()
    task.hold()
    assert not move_base.cancelled and math.isnan(task.remaining_m)
    steps(task, 0.1)
    task.cancel()
    assert move_base.cancelled == 1


def test_a_move_base_that_falls_silent_ends_the_goal_after_the_patience(move_base, task):
    steps(task, 5.0)
    assert task.ending is None
    move_base.lives = False
    steps(task, 1.9)
    assert task.ending is None
    steps(task, 0.2)
    assert task.ending == Ending(Outcome.NO_MOVE_BASE, "/move_base is silent for 2 s: move_base has ended or hangs")


def test_a_short_silence_is_forgiven(move_base, task):
    for _ in range(3):
        move_base.lives = False
        steps(task, 1.5)
        move_base.lives = True
        steps(task, 0.05)
    assert task.ending is None


def test_without_a_move_base_it_ends_after_the_wait(move_base):
    move_base.is_there = False
    task = MoveBaseTask(move_base, GOAL, wait_s=0.0, patience_s=2.0)
    steps(task, 0.1)
    assert task.ending == Ending(
        Outcome.NO_MOVE_BASE,
        "no action server /move_base within 0 s: start move_base, or set ~backend to internal",
    )
