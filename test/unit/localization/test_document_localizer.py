"""The glass document alone: samples around the prediction, votes, and ranges cast for every particle."""

from __future__ import annotations

import numpy as np
import pytest
from buildings import GLASS_ROOM, SECOND_NS, loop_drive, odometry, off

from glass_nav import params
from glass_nav.geometry import se2
from glass_nav.localization import document_localizer
from glass_nav.localization.beam_classification import beam_classifier
from glass_nav.localization.document_localizer import DocumentLocalizer
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.localization.method import Method
from glass_nav.sensing import bearings
from glass_nav.world import landmark_map
from glass_nav.world.pane import Pane

COVARIANCE = np.diag([0.05, 0.05, 0.02]) ** 2
MAP = GLASS_ROOM.grid_map()
STEPS = 12


def started(seed=0, **values):
    given = params.load(LocalizerParams, {"min_particles": 150, "max_particles": 300, **values}, "test")
    localizer = Method("document").begin(given, MAP, np.random.default_rng(seed))
    assert isinstance(localizer, DocumentLocalizer)
    localizer.set_pose(loop_drive(1)[0], COVARIANCE)
    return localizer


@pytest.fixture(scope="module")
def drive():
    rng = np.random.default_rng(5)
    true = loop_drive(STEPS)
    scans = [GLASS_ROOM.scan(pose, n * SECOND_NS, rng, beams=90, glass_share=0.5) for n, pose in enumerate(true)]
    return true, odometry(true, rng), scans


def test_it_tracks_a_robot_and_tells_cases(drive):
    true, odom, scans = drive
    localizer = started()
    estimates = [localizer.update(scan, pose) for scan, pose in zip(scans, odom)]
    errors = np.array([off(estimate.map_from_base, pose) for estimate, pose in zip(estimates, true)])
    assert errors[:, 0].max() < 0.2 and np.degrees(errors[:, 1].max()) < 3.0
    assert all(estimate.updated for estimate in estimates)
    assert {1, 3} <= set(np.concatenate([estimate.cases.case for estimate in estimates]))


def test_samples_stand_around_the_pose_that_odometry_predicts(drive, monkeypatch):
    true, odom, scans = drive
    asked = []

    class Seen(beam_classifier.BeamClassifier):
        def classify(self, scan, map_from_base, covariance, for_weights=True):
            asked.append((map_from_base, covariance))
            return super().classify(scan, map_from_base, covariance, for_weights)

    monkeypatch.setattr(document_localizer, "BeamClassifier", Seen)
    localizer = started()
    first = localizer.update(scans[0], odom[0])
    localizer.update(scans[1], odom[1])
    step = se2.compose(se2.inverse(odom[0]), odom[1])
    predicted, covariance = asked[-1]
    np.testing.assert_allclose(predicted, se2.compose(first.map_from_base, step), atol=1e-9)
    assert np.all(np.linalg.eigvalsh(covariance) > 0.0)  # the spread of the particles, not none


def test_the_highest_vote_wins_however_low_and_ranges_are_cast_for_every_particle():
    plain = started(vote_mode="soft", weight_mode="field", case_min_share=0.9)._params
    assert (plain.vote.vote_mode, plain.vote.case_min_share, plain.mixture.weight_mode) == ("paper", 0.0, "ranges")


def test_it_learns_nothing_and_a_second_run_is_the_same_to_the_last_bit(drive):
    _, odom, scans = drive
    one, other = started(seed=3), started(seed=3)
    before = one.glass_map.arrays()
    for scan, pose in zip(scans[:4], odom[:4]):
        a, b = one.update(scan, pose), other.update(scan, pose)
        np.testing.assert_array_equal(a.particles, b.particles)
    for name, values in one.glass_map.arrays().items():
        np.testing.assert_array_equal(values, before[name])
    assert one.unmapped_panes == ()


def test_a_standing_robot_is_updated_when_asked(drive):
    _, odom, scans = drive
    localizer = started()
    assert localizer.update(scans[0], odom[0]).updated
    again = localizer.update(scans[0], odom[0])
    assert not again.updated and np.all(np.isfinite(again.covariance))
    localizer.request_update()
    assert localizer.update(scans[0], odom[0]).updated


def test_what_the_document_does_not_have_is_refused_or_kept_for_others(drive):
    _, odom, scans = drive
    localizer = Method("document").begin(LocalizerParams(), MAP, np.random.default_rng(0))
    with pytest.raises(RuntimeError, match="set_pose"):
        localizer.update(scans[0], odom[0])
    with pytest.raises(ValueError, match="only tracks a pose: give an initial pose"):
        localizer.scatter()
    pane = Pane(np.array([1.0, 1.0]), np.array([2.0, 1.0]), 0.9)
    localizer.remember([pane], localizer.glass_map.arrays())
    assert localizer.found_panes == (pane,) and localizer.unmapped_panes == ()
    localizer.add_bearings(bearings.LandmarkBearings.__new__(bearings.LandmarkBearings), landmark_map.NONE, odom[0])


def test_other_parameters_and_another_map_leave_the_particles(drive):
    _, odom, scans = drive
    localizer = started()
    before = localizer.update(scans[0], odom[0])
    localizer.reconfigure(params.load(LocalizerParams, {"min_particles": 100, "max_particles": 200}, "test"))
    localizer.set_map(MAP)
    after = localizer.update(scans[0], odom[0])
    assert after.updated and len(after.particles) <= 300
    assert off(after.map_from_base, before.map_from_base)[0] < 0.1


def test_the_default_is_the_package_s_own_filter():
    assert not isinstance(Method().begin(LocalizerParams(), MAP, np.random.default_rng(0)), DocumentLocalizer)
    with pytest.raises(params.ParamError, match="~method must be one of default, document, got 'paper'"):
        params.load(Method, {"method": "paper"}, "test")
