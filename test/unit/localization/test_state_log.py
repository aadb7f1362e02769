"""What /rosout says about the state: each change once, with where, why and after how far."""

from __future__ import annotations

import logging

import numpy as np
import pytest

from glass_nav.geometry import se2
from glass_nav.localization.localizer import Estimate
from glass_nav.localization.state_log import QUIET_S, StateLog


def no_beams():
    raise AssertionError("nobody looks at the beams")


class Drive:
    """A robot that drives along x by odometry; says where it thinks it is."""

    def __init__(self):
        self.log = StateLog()
        self.second, self.x_m = 0.0, 0.0

    def step(self, state, seconds=1.0, metres=0.0, pose=None, reason="why", places=1):
        """The text that is logged, None without one."""
        self.second += seconds
        self.x_m += metres
        odom_from_base = np.array([self.x_m, 0.0, 0.0])
        map_from_base = odom_from_base if pose is None else np.array(pose)
        line = self.log.take(
            Estimate(
                int(self.second * 1e9),
                map_from_base,
                np.eye(3),
                se2.compose(map_from_base, se2.inverse(odom_from_base)),
                no_beams,
                np.zeros((1, 3)),
                state,
                reason,
                True,
                0.9,
                places,
            )
        )
        self.level = None if line is None else line.level
        return None if line is None else line.text


def test_the_loss_says_where_and_why_and_the_return_from_where_to_where_after_how_far():
    drive = Drive()
    assert drive.step("LOCALIZED") == "LOCALIZED at (0.00 m, 0.00 m, 0 deg)"
    assert drive.step("LOCALIZED", metres=2.0) is None
    assert drive.step("LOST", seconds=6.0, metres=1.0, reason="the scans fit elsewhere") == (
        "LOCALIZED is lost at (2.00 m, 0.00 m, 0 deg), now LOST: the scans fit elsewhere"
    )
    assert drive.level == logging.WARNING
    assert drive.step("LOST", metres=3.0) is None
    assert drive.step("UNCERTAIN", metres=3.0) is None
    assert drive.step("LOCALIZED", metres=1.0, pose=[30.0, 4.0, np.pi / 2]) == (
        "LOCALIZED again: from (2.00 m, 0.00 m, 0 deg) to (30.00 m, 4.00 m, 90 deg) after 8.0 m and 9.0 s"
    )
    assert drive.level == logging.INFO
    assert drive.step("LOCALIZED", metres=1.0) is None


@pytest.mark.parametrize(
    "state, reason, ending",
    [
        (
            "LOCALIZED",
            "fine",
            "global search ended: LOCALIZED at (5.00 m, 0.00 m, 0 deg) after 4.0 m and 2.0 s, of at most 7 places",
        ),
        (
            "UNCERTAIN",
            "few beams",
            "global search ended: UNCERTAIN at (5.00 m, 0.00 m, 0 deg) after 4.0 m and 2.0 s, of at most 7 places: few beams",
        ),
    ],
)
def test_a_global_search_says_how_it_ended(state, reason, ending):
    drive = Drive()
    assert drive.step("GLOBAL_SEARCH", metres=1.0, places=3) is None
    assert drive.step("GLOBAL_SEARCH", metres=2.0, places=7) is None
    assert drive.step(state, metres=2.0, reason=reason) == ending
    assert drive.step(state, metres=2.0) is None


def test_before_it_was_ever_known_no_pose_is_lost():
    drive = Drive()
    assert drive.step("UNCERTAIN") is None
    assert drive.step("LOST") is None


def test_a_search_that_begins_while_it_is_known_ends_like_any_other():
    drive = Drive()
    drive.step("LOCALIZED")
    assert drive.step("GLOBAL_SEARCH") is None
    assert drive.step("LOCALIZED").startswith("global search ended: LOCALIZED")


def test_a_state_that_flickers_is_said_once_and_a_loss_that_lasts_is_not_forgotten():
    drive = Drive()
    drive.step("LOCALIZED")
    said = [drive.step(state, seconds=0.1) for state in ["UNCERTAIN", "LOCALIZED"] * 10]
    assert said == [None] * 20
    lines = [drive.step("UNCERTAIN", seconds=1.0) for _ in range(int(QUIET_S) + 3)]
    assert [line for line in lines if line] == ["LOCALIZED is lost at (0.00 m, 0.00 m, 0 deg), now UNCERTAIN: why"]
    assert drive.step("LOCALIZED", seconds=1.0).startswith("LOCALIZED again")
