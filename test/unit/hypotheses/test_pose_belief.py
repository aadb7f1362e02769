"""Poses and their evidence in a map that is worked by hand (made_scans.py): 80 pieces of wall in each view."""

from __future__ import annotations

import made_scans
import numpy as np
import pytest
from made_scans import MadeScans

from glass_nav.hypotheses.pose_belief import PoseBelief
from glass_nav.hypotheses.pose_evidence import NEW
from glass_nav.sensing.scan import Scan

TRUTH = np.array([5.0, 0.0, 0.0])
WRONG = np.array([100.0, 0.0, 0.0])


def near(poses: np.ndarray, x: float) -> np.ndarray:
    """(K,) bool: on the robot's path, if it began at x."""
    return np.abs(poses[:, 0] - x) < 40.0


def world(truth: float = 0.95, wrong: float = 0.65, proposed: "list[np.ndarray] | None" = None) -> MadeScans:
    return MadeScans(
        lambda poses: np.where(near(poses, TRUTH[0]), truth, wrong), [TRUTH, WRONG] if proposed is None else proposed
    )


def seen(belief: PoseBelief, x: float, stamp_ns: int = 0) -> bool:
    """A scan x metres after the first one."""
    return belief.see(made_scans.scan(stamp_ns), np.array([x, 0.0, 0.0]))


def begun(scans: MadeScans) -> PoseBelief:
    belief = PoseBelief(scans)
    for _ in range(3):  # the search is begun, complete, its poses are judged
        seen(belief, 0.0)
    return belief


def test_a_pose_gains_by_the_walls_that_the_map_explains_and_elsewhere_by_the_others() -> None:
    belief = begun(world())
    assert belief.searches == 1
    np.testing.assert_allclose(belief.poses, [TRUTH, WRONG])
    # Elsewhere the map explains 0.7 of a scan that poses are chosen by; half a nat for each of the 80 pieces.
    np.testing.assert_allclose(belief.evidence.nats, [40.0 * (0.95 - 0.7), 40.0 * (0.65 - 0.7)])
    np.testing.assert_allclose(belief.evidence.checked_nats, [0.0, 0.0])  # it chose the poses
    np.testing.assert_allclose(belief.evidence.share, [0.95, 0.65])
    assert belief.evidence.label.tolist() == [NEW, NEW]


def test_a_wall_counts_once_however_often_it_is_seen() -> None:
    belief = begun(world())
    before = belief.evidence.nats.copy()
    for turn in range(8):
        belief.see(made_scans.scan(), np.array([0.0, 0.0, 0.0 if turn % 2 else 2.0 * np.pi / 3]))
        belief.see(made_scans.scan(), np.zeros(3))
    turned = belief.evidence.nats[0]  # the walls of the turned scans were new, twice 80 at most
    assert turned <= before[0] + 40.0 * 0.3 + 1e-9
    for _ in range(5):
        belief.see(made_scans.scan(), np.array([0.0, 0.0, 2.0 * np.pi / 3]))
        belief.see(made_scans.scan(), np.zeros(3))
    assert belief.evidence.nats[0] == turned


def test_new_walls_decide_as_the_robot_drives_on() -> None:
    belief = begun(world(wrong=0.8))
    leads, chosen_by = [belief.evidence.nats[0] - belief.evidence.nats[1]], belief.evidence.nats[0]
    for x in (2.5, 5.0, 7.5):
        assert seen(belief, x)
        seen(belief, x)  # a search may have been complete with the first one
        np.testing.assert_allclose(belief.poses[0], TRUTH + [x, 0.0, 0.0])
        leads.append(belief.evidence.nats[0] - belief.evidence.nats[1])
    assert (np.diff(leads) > 0.2).all()
    assert belief.evidence.checked_nats[0] == pytest.approx(belief.evidence.nats[0] - chosen_by)
    assert not seen(belief, 7.6)  # it did not move


@pytest.mark.parametrize("copies, chance", [(3, 0.7), (9, 0.7), (10, 0.9)])
def test_what_is_explained_at_many_places_speaks_for_none(copies: int, chance: float) -> None:
    places = [TRUTH + [0.0, 2.0 * k, 0.0] for k in range(copies)]
    belief = begun(world(proposed=[*places, WRONG]))
    np.testing.assert_allclose(belief.evidence.nats[0], 40.0 * (0.95 - chance))


def test_a_truth_that_the_first_search_missed_is_found_later_and_judged_by_all_that_was_seen() -> None:
    scans = world(proposed=[WRONG])
    belief = begun(scans)
    seen(belief, 2.0)
    scans.proposed = np.array([TRUTH, TRUTH + [0.0, 50.0, 0.0]])
    for _ in range(4):
        seen(belief, 4.0)
    assert belief.searches == 2
    np.testing.assert_allclose(belief.poses[0], TRUTH + [4.0, 0.0, 0.0])
    scans.proposed = np.array([TRUTH, WRONG])
    straight = begun(scans)
    for x in (2.0, 4.0, 4.0, 4.0, 4.0):
        seen(straight, x)
    assert belief.evidence.nats[0] == pytest.approx(straight.evidence.nats[0], abs=0.5)


def test_poses_are_proposed_by_others_and_weighed_by_what_is_no_scan() -> None:
    belief = PoseBelief(world(proposed=[WRONG]))
    assert not len(belief.propose(TRUTH[None]))  # nothing to judge it by
    belief = begun(world(proposed=[WRONG]))
    assert belief.propose(np.array([WRONG, TRUTH])).tolist() == [1]
    assert belief.propose(TRUTH[None]).tolist() == []  # it is followed
    belief.weigh(np.array([5.0, 0.0]), np.array([3, 4]))
    np.testing.assert_allclose(belief.evidence.other_nats, [0.0, 5.0])
    np.testing.assert_allclose(belief.poses, [TRUTH, WRONG])  # the best first
    assert belief.evidence.label.tolist() == [4, 3]


def test_what_is_no_scan_drops_no_pose_that_scans_hold() -> None:
    belief = begun(world(proposed=[WRONG], wrong=0.9))
    belief.propose(np.array([TRUTH, WRONG]))
    behind = belief.evidence.nats.max() - belief.evidence.nats.min()
    assert len(belief.poses) == 2 and behind < 7.0
    belief.weigh(np.array([0.0, -100.0]), np.array([3, 4]))
    assert len(belief.poses) == 2


def test_copies_of_a_room_are_told_apart_by_what_stands_beside_walls_seen_before() -> None:
    scans = world(truth=0.9, wrong=0.9)
    belief = begun(scans)
    assert not seen(belief, 0.3)  # 80 pieces, all seen
    scans.share = lambda poses: np.where(near(poses, TRUTH[0]), 0.9, 0.85)  # from here four of them differ
    assert belief.evidence.nats[0] == belief.evidence.nats[1]
    assert seen(belief, 0.6)
    lead = belief.evidence.nats[0] - belief.evidence.nats[1]
    assert lead == pytest.approx(0.5 * 4.0)
    seen(belief, 0.9)
    seen(belief, 0.6)
    assert belief.evidence.nats[0] - belief.evidence.nats[1] == pytest.approx(lead)  # once


def test_who_would_have_driven_through_walls_is_hardly_there() -> None:
    scans = world(wrong=0.9)
    scans.free = lambda points_m: np.abs(points_m[..., 0] - WRONG[0] - 2.0) > 1.0  # a wall in the way of the wrong one
    plain, belief = begun(world(wrong=0.9)), begun(scans)
    for x in np.arange(0.25, 4.1, 0.25):
        seen(plain, x)
        seen(belief, x)
    lost = plain.evidence.nats - belief.evidence.nats
    assert lost[0] == 0.0 and 4.0 <= lost[1] < 5.1  # 2 m, in pieces of 0.5 m


def test_a_scan_without_returns_moves_the_poses_and_tells_nothing() -> None:
    nothing = Scan(0, np.full(3, np.inf), np.zeros(3), 0.1, 10.0, np.zeros(3))
    belief = PoseBelief(world())
    assert not belief.see(nothing, np.zeros(3)) and belief.searches == 0
    belief = begun(world())
    before = belief.evidence.nats.copy()
    assert not belief.see(nothing, np.array([3.0, 0.0, 0.0]))
    np.testing.assert_allclose(belief.poses[0], TRUTH + [3.0, 0.0, 0.0])
    np.testing.assert_array_equal(belief.evidence.nats, before)


def test_poses_far_behind_are_dropped_and_all_can_be_forgotten() -> None:
    belief = begun(world(wrong=0.4))
    for x in (5.0, 10.0):
        seen(belief, x)
    np.testing.assert_allclose(belief.poses, [TRUTH + [10.0, 0.0, 0.0]])
    belief.forget()
    assert not len(belief.poses) and belief.searches == 0 and belief.odom_from_base is None
