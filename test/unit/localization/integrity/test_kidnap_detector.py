"""A pose that is believed: when is it doubted, and when is another one believed instead?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from buildings import L_ROOM, SECOND_NS, Building, loop_drive, odometry, off

from glass_nav.geometry import se2
from glass_nav.hypotheses import global_search
from glass_nav.hypotheses.global_search import Candidates, SearchParams
from glass_nav.hypotheses.pose_tracker import same_place
from glass_nav.hypotheses.scan_matcher import ScanMatcher
from glass_nav.localization.integrity import kidnap_detector
from glass_nav.localization.integrity.dead_reckoning import DeadReckoning
from glass_nav.localization.integrity.kidnap_detector import KidnapDetector
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.known_area import KnownArea

CLOSE = np.diag([0.2, 0.2, 0.05]) ** 2
SQUARE = Building([(0, 0), (6, 0), (6, 6), (0, 6)])


class Watched:
    """A robot, the pose that is believed, and what the watch says of it after each step."""

    def __init__(self, building=L_ROOM, usual_fit=None, seed=0, given=False, edge=False, **values):
        """edge: the map ends somewhere."""
        self.building, self.rng = building, np.random.default_rng(seed)
        grid_map = building.grid_map()
        field = DistanceField(grid_map)
        area = KnownArea(grid_map) if edge else None
        matcher = ScanMatcher(grid_map, field)
        self.watch = KidnapDetector(field, matcher, SearchParams(**values), usual_fit, area, given)
        self.stamp_ns = 0
        self.searches, self._searching = 0, False

    def drive(self, true, believed=None, odom=None, blind=None, reckoned=None):
        """reckoned: where dead reckoning leads; None: no pose was sure yet."""
        odom = odometry(true, self.rng) if odom is None else odom
        believed = true if believed is None else believed
        reckoned = [None] * len(true) if reckoned is None else [DeadReckoning(pose, CLOSE) for pose in reckoned]
        verdicts = []
        for pose, told, moved, prior in zip(true, believed, odom, reckoned):
            self.stamp_ns += SECOND_NS
            scan = self.building.scan(pose, self.stamp_ns, self.rng)
            scan = scan if blind is None else replace(scan, ranges_m=blind(len(scan)))
            verdicts.append(self.watch.observe(scan, moved, np.asarray(told), prior))
            self.searches += not self._searching and verdicts[-1].candidates is not None
            self._searching = verdicts[-1].candidates is not None
        return verdicts


def carried(steps=30, offset=(1.2, 0.6, 0.8)):
    """Where a robot is and where it believes to be: it was kidnapped and drives on."""
    true = loop_drive(steps)
    wrong = [se2.compose(true[0] + np.array(offset), se2.compose(se2.inverse(true[0]), pose)) for pose in true]
    return true, wrong


def test_a_right_pose_is_never_doubted_and_costs_no_search():
    watched = Watched()
    verdicts = watched.drive(loop_drive(60))
    assert not any(verdict.doubted or verdict.poor or verdict.contested for verdict in verdicts)
    assert watched.searches == 0 and np.isnan(verdicts[-1].fit_there)
    assert verdicts[-1].usual == pytest.approx(verdicts[-1].fit, abs=0.05)  # it has learnt how scans fit


@pytest.mark.long_run
def test_a_wrong_pose_is_doubted_within_a_metre_and_the_right_one_is_found():
    watched = Watched()
    watched.drive(loop_drive(30))
    true, wrong = carried()
    verdicts = watched.drive(true, wrong)
    assert any(verdict.contested for verdict in verdicts[:6])
    found = next(index for index, verdict in enumerate(verdicts) if verdict.found is not None)
    assert off(verdicts[found].found, true[found])[0] < 0.1
    assert verdicts[found].fit_there > 0.8 > verdicts[found].fit
    assert watched.searches == 1


@pytest.mark.long_run
def test_a_pose_that_odometry_leads_to_is_no_poor_one_amid_visitors():
    """They hide three quarters of the room; nothing broke the way there."""
    true = loop_drive(30)

    def amid_visitors(reckoned):
        watched = Watched()
        watched.drive(true[:30], odom=true[:30], reckoned=reckoned and true[:30])
        near_m, verdicts = np.random.default_rng(0).uniform(0.3, 0.8, len(L_ROOM.scan(true[0]))), []
        stop, seen = true[29:30], L_ROOM.scan(true[29]).ranges_m
        for count in range(40):
            hidden = np.arange(len(seen)) % 100 < 5 * min(count, 15)  # they come nearer one by one
            blind = np.where(hidden, np.minimum(seen, near_m), seen)
            verdicts += watched.drive(stop, odom=stop, blind=lambda _, blind=blind: blind, reckoned=reckoned and stop)
        return verdicts

    assert any(verdict.poor for verdict in amid_visitors(None))
    kept = amid_visitors(true)
    assert all(verdict.kept for verdict in kept) and not any(verdict.poor or verdict.contested for verdict in kept)


def test_a_given_pose_is_compared_with_all_other_places_until_it_is_ahead():
    true = loop_drive(60)
    verdicts = Watched(given=True).drive(true, reckoned=true)
    given = [verdict.given for verdict in verdicts]
    assert given == sorted(given, reverse=True) and given[0] and not given[-1]
    assert verdicts[-1].candidates is None and verdicts[-1].kept and not verdicts[0].kept
    assert not any(verdict.contested or verdict.found is not None for verdict in verdicts)


def test_a_wrong_pose_that_was_given_is_contested_though_scans_always_fitted_so_badly_there():
    true, wrong = carried(30)
    verdicts = Watched(given=True, usual_fit=0.0).drive(true, wrong, reckoned=wrong)
    assert not any(verdict.doubted or verdict.kept for verdict in verdicts)
    first = next(index for index, verdict in enumerate(verdicts) if verdict.contested)
    assert first < 10 and verdicts[first].given
    assert any(verdict.found is not None for verdict in verdicts)


def test_twins_are_no_reason_to_search_for_ever():
    """In a square room a place fits as well on every side, however far the robot drives: the word of the operator counts."""
    verdicts = Watched(SQUARE, given=True).drive(loop_drive(60, (3.0, 3.0)))
    assert verdicts[0].given and not verdicts[-1].given and verdicts[-1].candidates is None
    assert not any(verdict.contested for verdict in verdicts)


@pytest.mark.parametrize("moved_m, lead, accepted", [(0.0, 9.0, True), (0.4, 9.0, False), (0.4, 17.0, True)])
def test_where_scans_fit_worse_than_they_did_a_place_needs_twice_the_margin(moved_m, lead, accepted):
    pose = loop_drive(1)[0]
    points = global_search.evidence_points(L_ROOM.scan(pose))
    best = Candidates(pose[None] + [moved_m, moved_m, 0.0], np.ones(1), 0.8, lead, True)
    assert Watched(usual_fit=0.95).watch.is_fit_for(best, points) == accepted


def test_a_robot_that_may_have_left_the_map_is_not_placed_where_scans_fit_worse_than_they_did():
    pose = loop_drive(1)[0]
    points = global_search.evidence_points(L_ROOM.scan(pose))
    poor, good = (Candidates(pose[None] + [off_m, off_m, 0.0], np.ones(1), 0.8, 99.0, True) for off_m in (0.4, 0.0))
    watch = Watched(usual_fit=0.95).watch
    assert not watch.is_fit_for(poor, points, on_map=False)
    assert watch.is_fit_for(good, points, on_map=False)


def test_a_search_goes_on_though_the_wrong_pose_leads_off_the_map():
    watched = Watched(edge=True)
    watched.drive(loop_drive(10))
    true, wrong = carried(30)
    odom = odometry(true, watched.rng)
    assert watched.drive(true[:4], wrong[:4], odom=odom[:4])[-1].candidates is not None
    outside = [pose + [100.0, 0.0, 0.0] for pose in wrong[4:]]
    verdicts = watched.drive(true[4:], outside, odom=odom[4:])
    found = next(index for index, verdict in enumerate(verdicts) if verdict.found is not None)
    assert off(verdicts[found].found, true[4 + found])[0] < 0.1


def found_while_away(leads_back):
    """What is found while the tracked pose leaves the map, and dead reckoning too, or it leads where the robot is."""
    watched = Watched(edge=True)
    watched.drive(loop_drive(10))
    true, wrong = carried(30)
    odom = odometry(true, watched.rng)
    assert watched.drive(true[:4], wrong[:4], odom=odom[:4], reckoned=wrong[:4])[-1].candidates is not None
    outside = [pose + [100.0, 0.0, 0.0] for pose in wrong[4:]]
    verdicts = watched.drive(true[4:], outside, odom=odom[4:], reckoned=true[4:] if leads_back else outside)
    return any(each.found is not None for each in verdicts)


@pytest.mark.parametrize("enough_m, believed", [(20.0, False), (1.0, True)])
def test_where_odometry_leads_off_the_map_another_place_is_not_believed_at_once(monkeypatch, enough_m, believed):
    monkeypatch.setattr(kidnap_detector, "_OFF_MAP_M", enough_m)
    assert found_while_away(leads_back=False) == believed


def test_a_robot_that_returns_to_the_map_where_odometry_leads_is_believed():
    assert found_while_away(leads_back=True)


def test_off_the_map_nothing_is_doubted_that_was_not_before():
    watched = Watched(edge=True)
    before = watched.drive(loop_drive(10))[-1]
    outside = [pose + [100.0, 0.0, 0.0] for pose in loop_drive(5)]
    assert watched.drive(loop_drive(5), outside)[-1] == before


def test_dead_reckoning_vouches_for_no_pose_away_from_it():
    watched = Watched()
    far = [pose + np.array([1.0, 0.0, 0.0]) for pose in loop_drive(3)]
    assert not any(verdict.kept for verdict in watched.drive(loop_drive(3), reckoned=far))


def test_told_not_to_it_does_not_look_elsewhere():
    watched = Watched(recover_when_lost=False)
    watched.drive(loop_drive(30))
    verdicts = watched.drive(*carried())
    assert watched.searches == 0 and verdicts[-1].found is None and not verdicts[-1].contested
    assert verdicts[-1].doubted and verdicts[-1].poor
    assert not any(verdict.given for verdict in Watched(given=True, recover_when_lost=False).drive(loop_drive(3)))


@pytest.mark.long_run
def test_people_all_round_make_a_pose_doubtful_but_move_nobody():
    watched = Watched()
    watched.drive(loop_drive(30))
    crowd = watched.drive(loop_drive(30), blind=lambda beams: watched.rng.uniform(0.3, 0.8, beams))
    assert crowd[-1].doubted and crowd[-1].poor
    assert not any(verdict.found is not None for verdict in crowd)
    after = watched.drive(loop_drive(60))
    assert not after[-1].doubted and not any(verdict.found is not None for verdict in after)


def test_of_places_that_look_alike_the_believed_one_stays():
    """In a square room a pose turned by half about the middle fits as well: nobody can tell, so nobody moves."""
    true = loop_drive(40, (3.0, 3.0))
    verdicts = Watched(SQUARE).drive(true, turned_by_half(true))
    assert not any(verdict.contested for verdict in verdicts)


def turned_by_half(true):
    """The same in the square room, turned by half about its middle: no scan can tell."""
    return [se2.compose(np.array([3.0, 3.0, np.pi]), np.array([*(pose[:2] - 3.0), pose[2]])) for pose in true]


@pytest.mark.long_run
def test_of_places_that_look_alike_odometry_leads_to_one():
    """The tracked pose was dragged away; four places fit, and odometry since the last sure pose knows which it is."""
    true = loop_drive(40, (3.0, 3.0))
    dragged = [se2.compose(np.array([0.4, 0.9, 0.5]), pose) for pose in true]
    watched = Watched(SQUARE)
    verdicts = watched.drive(true, dragged, reckoned=true)
    found = [(each.found, pose) for each, pose in zip(verdicts, true) if each.found is not None]
    assert found and all(same_place(place[None], pose)[0] for place, pose in found)
    without = Watched(SQUARE).drive(true, dragged)
    assert not any(each.found is not None for each in without)


def test_of_places_that_look_alike_none_is_found_after_a_kidnapping():
    """Odometry leads to where no scan fits; the twins remain, and nothing decides between them."""
    true = loop_drive(40, (3.0, 3.0))
    wrong = [se2.compose(np.array([0.9, 0.8, 0.6]), pose) for pose in true]
    verdicts = Watched(SQUARE).drive(true, wrong, reckoned=wrong)
    assert not any(each.found is not None for each in verdicts)
    assert verdicts[-1].contested


@pytest.mark.long_run
def test_odometry_does_not_hide_a_kidnapping_for_ever():
    watched = Watched()
    watched.drive(loop_drive(30), reckoned=loop_drive(30))
    true, wrong = carried(60)
    verdicts = watched.drive(true, wrong, reckoned=wrong)
    assert any(each.contested for each in verdicts[:6])
    found = next(index for index, each in enumerate(verdicts) if each.found is not None)
    assert off(verdicts[found].found, true[found])[0] < 0.1


def test_another_place_is_named_and_not_the_tracked_one():
    watched = Watched()
    watched.drive(loop_drive(30))
    true, wrong = carried()
    named = [(each, pose) for each, pose in zip(watched.drive(true, wrong), wrong) if each.elsewhere is not None]
    assert named and all(not same_place(each.elsewhere[None], pose)[0] for each, pose in named)


def test_without_answers_the_verdict_stays():
    watched = Watched()
    blind = watched.drive(loop_drive(2), blind=lambda beams: np.full(beams, np.nan))
    assert np.isnan(blind[-1].fit) and not blind[-1].doubted and not blind[-1].poor
    before = watched.drive(loop_drive(3))[-1]
    assert watched.drive(loop_drive(1), blind=lambda beams: np.full(beams, np.inf))[-1] == before


def test_how_scans_fit_somewhere_is_learnt_with_a_delay():
    """What was not doubted for 3 m is how scans fit here; a doubt forgets what came just before."""
    watched = Watched(usual_fit=0.8)
    first = watched.drive(loop_drive(5))[-1]
    assert first.usual == 0.8  # not yet
    later = watched.drive(loop_drive(80))[-1]
    assert later.usual > 0.9


def test_where_scans_always_fit_badly_that_becomes_usual():
    """A map that is wrong everywhere: the believed pose stays the best, and the search for another ends."""
    watched = Watched()
    true = loop_drive(80)
    odom, verdicts = odometry(true, watched.rng), []
    for pose, moved in zip(true, odom):
        exact = L_ROOM.scan(pose, 0, watched.rng).ranges_m
        verdicts += watched.drive(
            [pose], odom=[moved], blind=lambda beams, exact=exact: exact + watched.rng.normal(0.0, 0.2, beams)
        )
    assert verdicts[0].usual == pytest.approx(verdicts[0].fit, abs=0.01)  # at once: nowhere else do they fit better
    assert 1 <= watched.searches <= 2
    assert verdicts[-1].usual < 0.85 and verdicts[-1].candidates is None
    assert not any(verdict.found is not None or verdict.contested for verdict in verdicts)


@pytest.mark.long_run
def test_other_limits_hold_from_the_next_scan_on():
    watched = Watched(search_margin=1000.0)
    watched.drive(loop_drive(30))
    true, wrong = carried(60)
    assert not any(verdict.found is not None for verdict in watched.drive(true[:40], wrong[:40]))
    watched.watch.reconfigure(SearchParams(search_margin=2.0))
    odom = odometry(true, np.random.default_rng(0))
    last = watched.drive(true[40:], wrong[40:], odom[40:])
    assert any(verdict.found is not None for verdict in last) or last[-1].contested
