"""Poses followed by scans and odometry, judged by a map of one dimension worked by hand.

In it a scan is one number, its first range, and so is what the map shows at a place: the map explains the share
1 - |seen - shown|. Places are x = 0, 10, 20 ... along a line, all headings 0.
"""

from __future__ import annotations

from typing import List, Optional, Sequence

import numpy as np
import pytest

from glass_nav.hypotheses.followed_poses import FollowedPoses
from glass_nav.sensing.scan import Scan


def scan_that_shows(value: float) -> Scan:
    return Scan(0, np.full(3, value), np.zeros(3), 0.0, 10.0, np.zeros(3))


class Line:
    """A map; poses slide to the nearest place if that is near enough."""

    def __init__(self, shown: Sequence[float], proposed: Optional[List[int]] = None) -> None:
        self._shown = np.array(shown)
        self.proposed = list(range(len(shown))) if proposed is None else proposed

    def places(self, scan: Scan, most: int) -> np.ndarray:
        return np.array([[10.0 * number, 0.0, 0.0] for number in self.proposed]).reshape(-1, 3)

    def fitted(
        self, scan: Scan, map_from_base: np.ndarray, most_m: float, most_rad: float
    ) -> "tuple[np.ndarray, np.ndarray]":
        number = np.clip(np.round(map_from_base[:, 0] / 10.0).astype(int), 0, len(self._shown) - 1)
        there = np.column_stack([10.0 * number, np.zeros((len(number), 2))])
        near = np.abs(there[:, 0] - map_from_base[:, 0]) < most_m
        poses = np.where(near[:, None], there, map_from_base)
        return poses, np.where(near, 1.0 - np.abs(scan.ranges_m[0] - self._shown[number]), 0.0)


def seen(x: float, shows: float) -> "tuple[np.ndarray, Scan]":
    """Odometry, which began at x = 0 with the robot's nose along the line, and the scan."""
    return np.array([x, 0.0, 0.0]), scan_that_shows(shows)


def test_the_pose_that_explains_all_scans_leads_by_what_the_next_best_explains_less() -> None:
    followed = FollowedPoses(Line([0.5, 0.9, 0.1, 0.5, 0.8, 0.5]))
    assert followed.standing is None
    followed.begin(*seen(0.0, 0.5))
    first = followed.standing
    assert first is not None and (first.share, first.lead, first.places) == (1.0, 0.0, 1)  # at 0, 30 and 50
    followed.follow(*seen(10.3, 0.9), 10.3)
    second = followed.standing
    assert second is not None and second.places == 2
    np.testing.assert_allclose(second.map_from_base, [10.0, 0.0, 0.0])  # it slid to where the scan fits
    assert (second.share, second.lead) == (1.0, pytest.approx(0.05))  # 30, then 40: 1 and 0.9
    followed.follow(*seen(20.5, 0.1), 10.2)
    third = followed.standing
    assert third is not None and third.places == 3
    assert third.lead == pytest.approx(1.0 - (1.0 + 0.9 + 0.6) / 3.0)
    assert (third.share_now, third.lead_now) == (1.0, pytest.approx(0.4))


def test_a_truth_that_the_first_scan_did_not_propose_is_followed_backwards() -> None:
    line = Line([0.5, 0.9, 0.1, 0.4, 0.8, 0.5], proposed=[3])
    followed = FollowedPoses(line)
    followed.begin(*seen(0.0, 0.5))
    line.proposed = [1, 4]
    followed.follow(*seen(10.0, 0.9), 10.0)
    standing = followed.standing
    assert standing is not None
    np.testing.assert_allclose(standing.map_from_base, [10.0, 0.0, 0.0])
    assert (standing.share, standing.lead) == (1.0, pytest.approx(0.1))  # the other: (0.9 + 0.9) / 2


def test_what_one_place_shows_counts_once_however_often_it_is_seen() -> None:
    followed = FollowedPoses(Line([0.5, 0.9, 0.5, 0.7, 0.0]))
    followed.begin(*seen(0.0, 0.5))
    followed.follow(*seen(10.0, 0.9), 10.0)
    before = followed.standing
    for x, shows in ((0.0, 0.5), (10.0, 0.9)) * 3:
        followed.follow(*seen(x, shows), 10.0)
    after = followed.standing
    assert before is not None and after is not None
    assert (after.places, after.share, after.lead) == (before.places, before.share, before.lead)


def test_after_a_long_drive_a_place_counts_as_new_only_if_odometry_is_sure_that_it_is() -> None:
    followed = FollowedPoses(Line([0.5, 0.5]))
    followed.begin(*seen(0.0, 0.5))
    followed.follow(*seen(2.0, 0.5), 30.0)  # 2 m beside where it was, but after 30 m
    assert followed.standing is not None and followed.standing.places == 1
    followed.follow(*seen(3.6, 0.5), 1.6)  # more than 1.5 m and 3 % of 31.6 m
    assert followed.standing.places == 2


def test_without_odometry_all_begins_anew_and_without_a_scan_nothing_is_learnt() -> None:
    followed = FollowedPoses(Line([0.5, 0.9, 0.1]))
    followed.begin(*seen(0.0, 0.5))
    followed.follow(np.array([10.0, 0.0, 0.0]), None, 10.0)
    standing = followed.standing
    assert standing is not None and standing.places == 1
    np.testing.assert_allclose(standing.map_from_base, [10.0, 0.0, 0.0])
    followed.follow(None, scan_that_shows(0.1), 10.0)
    assert followed.standing is None
    followed.follow(*seen(0.0, 0.9), 10.0)
    assert followed.standing is not None and followed.standing.places == 1


def test_a_scan_that_proposes_nothing_tells_nothing() -> None:
    followed = FollowedPoses(Line([0.5, 0.9], proposed=[]))
    followed.begin(*seen(0.0, 0.5))
    assert followed.standing is None
