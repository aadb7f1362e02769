"""The particles of one filter: where they start, where a scan draws them, and how many stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from buildings import L_ROOM, Building, off

from glass_nav.geometry import se2
from glass_nav.localization.beam_classification.beam_classifier import BeamClassifier
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.localization.particle_filter.importance_weights import BeamMixture
from glass_nav.localization.particle_filter.particle_filter import ParticleFilter
from glass_nav.localization.particle_filter.resampling import ParticleCount
from glass_nav.sensing.distance_field import DistanceField

MAP = L_ROOM.grid_map()
FIELD = DistanceField(MAP)
PARAMS = LocalizerParams(count=ParticleCount(min_particles=200, max_particles=600))
TRUE = np.array([2.3, 1.7, 1.0])
SPREAD = np.array([0.1, 0.1, 0.05])


def started(at=TRUE, spread=SPREAD, params=PARAMS, **changes):
    particles = ParticleFilter(replace(params.particle_filter, **changes), FIELD, np.random.default_rng(0))
    particles.start_around(np.asarray(at, float), spread)
    return particles


def updated(particles, scan, classifier=None):
    classifier = classifier or BeamClassifier(PARAMS.classifier, MAP)
    registration = particles.register(scan, np.zeros(3), classifier)
    cases, _ = classifier.classify(scan, registration.map_from_base, registration.covariance)
    particles.weigh(scan, cases, registration, classifier)
    particles.estimate()
    return registration


def test_particles_start_as_widely_as_was_said():
    spread = started().particles - TRUE
    np.testing.assert_allclose(spread.std(axis=0), SPREAD, rtol=0.15)
    axes = np.array([[0.0, 0.3, 0.0], [0.1, 0.0, 0.0], [0.0, 0.0, 0.05]])  # the widest along x
    np.testing.assert_allclose((started(spread=axes).particles - TRUE).std(axis=0), [0.3, 0.1, 0.05], rtol=0.15)


def test_particles_start_everywhere_in_an_area_and_nowhere_else():
    area = MAP.free & (np.arange(MAP.occupancy.shape[1]) < MAP.occupancy.shape[1] // 2)
    particles = ParticleFilter(PARAMS.particle_filter, FIELD, np.random.default_rng(0))
    particles.start_in(MAP, area)
    rows, columns = MAP.cells(particles.particles[:, :2])
    assert area[rows, columns].all() and len(particles.particles) == 600
    assert np.ptp(particles.particles[:, 2]) > 6.0


@pytest.mark.parametrize("weight_mode", ["field", "ranges"])
def test_a_scan_draws_the_particles_to_where_it_was_taken(weight_mode):
    particles = started(TRUE + [0.15, -0.1, 0.05], params=replace(PARAMS, mixture=BeamMixture(weight_mode=weight_mode)))
    registration = updated(particles, L_ROOM.scan(TRUE, rng=np.random.default_rng(1)))
    assert registration.fits and registration.alignment is not None
    away_m, away_rad = off(particles.best.map_from_base, TRUE)
    assert away_m < 0.02 and away_rad < np.radians(0.5)


def test_a_cloud_over_the_room_is_weighed_but_not_drawn_anywhere():
    particles = started(spread=np.array([2.0, 2.0, 3.0]))
    before = particles.particles.copy()
    registration = updated(particles, L_ROOM.scan(TRUE))
    assert registration.alignment is None and not registration.fits
    np.testing.assert_array_equal(particles.particles, before)


def test_a_scan_without_answers_changes_nothing():
    particles = started()
    before, best = particles.particles.copy(), particles.best
    scan = replace(L_ROOM.scan(TRUE), ranges_m=np.full(180, np.inf))
    assert updated(particles, scan).alignment is None
    np.testing.assert_array_equal(particles.particles, before)
    np.testing.assert_array_equal(particles.best.map_from_base, best.map_from_base)


def test_fewer_particles_stay_when_the_cloud_is_narrow():
    particles = started()
    updated(particles, L_ROOM.scan(TRUE))
    particles.resample()
    assert len(particles.particles) == 200


def test_resampling_waits_for_its_interval_and_for_uneven_weights():
    every_other = started(resample_interval=2)
    every_other.resample()
    assert len(every_other.particles) == 600
    every_other.resample()
    assert len(every_other.particles) < 600
    selective = started(selective_resampling=True)  # all weights are equal
    selective.resample()
    assert len(selective.particles) == 600


def test_the_particles_may_stand_for_candidates_of_a_search():
    particles = started()
    poses = np.array([[1.0, 1.0, 0.0], [1.1, 1.0, 0.0], [4.0, 2.0, 1.0]])
    weights, here = np.array([0.5, 0.2, 0.3]), np.array([True, True, False])
    particles.stand_for(poses, weights, here, np.eye(3), 100)
    assert len(particles.particles) == 100 and set(map(tuple, particles.particles)) == set(map(tuple, poses))
    assert particles.best.share == pytest.approx(0.7)
    np.testing.assert_array_equal(particles.best.members, particles.particles[:, 0] < 2.0)


def test_another_map_and_other_parameters_leave_the_particles_where_they_are():
    particles = started()
    before = particles.particles.copy()
    particles.set_field(FIELD)
    particles.reconfigure(replace(PARAMS.particle_filter, count=ParticleCount(100, 100)))
    np.testing.assert_array_equal(particles.particles, before)
    particles.resample()
    assert len(particles.particles) == 100


def test_without_evidence_the_particles_move_as_one_and_keep_their_weights():
    particles = started()
    for _ in range(5):
        updated(particles, L_ROOM.scan(TRUE, rng=np.random.default_rng(1)))
        particles.resample()
    assert particles.has_evidence and particles.fits
    before, best = particles.particles.copy(), particles.best.map_from_base
    outside = replace(L_ROOM.scan(TRUE), ranges_m=np.full(180, 9.0))  # behind all walls
    assert updated(particles, outside).alignment is None
    assert not particles.has_evidence and not particles.fits
    particles.resample()
    step = np.array([0.3, 0.0, 0.2])
    particles.predict(step)
    np.testing.assert_allclose(particles.particles, se2.compose(before, step))
    particles.estimate()
    np.testing.assert_allclose(particles.best.map_from_base, se2.compose(best, step), atol=1e-3)


def test_the_particles_may_be_moved_elsewhere_as_one():
    particles = started()
    particles.estimate()
    covariance = particles.best.covariance
    particles.move_to(np.array([4.0, 1.0, -2.0]))
    np.testing.assert_allclose(particles.best.map_from_base, [4.0, 1.0, -2.0], atol=0.01)
    np.testing.assert_allclose(np.linalg.eigvalsh(particles.best.covariance), np.linalg.eigvalsh(covariance), rtol=0.05)


@pytest.mark.parametrize("behind_m", [0.15, 0.2, 0.25])
def test_a_cabinet_beside_the_robot_does_not_pull_a_pose_that_odometry_knows(behind_m):
    """It hides most of the near wall and looks like it, moved; most beams end there."""
    outline = [(0, 0), (8, 0), (8, 3), (0, 3)]
    grid_map = Building(outline).grid_map()
    true = np.array([3.0, 0.8, 0.0])
    scan = Building(outline, walls=[(1.0, behind_m, 7.0, behind_m)]).scan(true, rng=np.random.default_rng(0))
    particles = ParticleFilter(PARAMS.particle_filter, DistanceField(grid_map), np.random.default_rng(0))
    particles.start_around(true, np.array([0.02, 0.02, 0.01]))
    classifier = BeamClassifier(PARAMS.classifier, grid_map)
    registration = particles.register(scan, np.zeros(3), classifier, np.diag([0.01, 0.01, 0.0025]) ** 2)
    way_m, turn_rad = off(registration.map_from_base, true)
    assert way_m < 0.03 and turn_rad < np.radians(0.5)


@pytest.mark.parametrize(
    ("share", "is_worth"),
    [pytest.param(0.2, True, id="a few people"), pytest.param(0.7, False, id="most of what it sees")],
)
def test_a_scan_is_worth_nothing_where_the_map_lacks_most_of_what_it_sees(share, is_worth):
    scan = L_ROOM.scan(TRUE, rng=np.random.default_rng(0))
    shorter = np.random.default_rng(1).permutation(len(scan.ranges_m))[: int(share * len(scan.ranges_m))]
    ranges_m = scan.ranges_m.copy()
    ranges_m[shorter] *= np.linspace(0.3, 0.7, len(shorter))
    particles = started(spread=np.array([0.01, 0.01, 0.005]))
    registration = updated(particles, replace(scan, ranges_m=ranges_m))
    assert (registration.worth > 0.0) == registration.fits == particles.fits == is_worth


def test_a_pose_that_odometry_rules_out_and_the_scan_hardly_proves_is_not_taken():
    """Of a scan that shows mostly what the map lacks, the rest fits 0.3 m farther along."""
    scan = L_ROOM.scan(TRUE + [0.3, 0.0, 0.0], rng=np.random.default_rng(0))
    shorter = np.random.default_rng(1).permutation(len(scan.ranges_m))[: int(0.7 * len(scan.ranges_m))]
    ranges_m = scan.ranges_m.copy()
    ranges_m[shorter] *= np.linspace(0.3, 0.7, len(shorter))
    classifier, tight = BeamClassifier(PARAMS.classifier, MAP), np.diag([0.01, 0.01, 0.005]) ** 2
    odd = started(spread=np.array([0.01, 0.01, 0.005])).register(
        replace(scan, ranges_m=ranges_m), np.zeros(3), classifier, tight
    )
    clear = started(spread=np.array([0.01, 0.01, 0.005])).register(scan, np.zeros(3), classifier, tight)
    assert off(odd.map_from_base, TRUE)[0] < 0.1
    assert off(clear.map_from_base, TRUE)[0] > 0.25
