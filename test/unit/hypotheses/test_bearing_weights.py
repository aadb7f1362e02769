"""Bearings as evidence: which particles do they speak for?"""

from __future__ import annotations

import numpy as np
import pytest
from made_bearings import FIELD, VIEWERS, seen

from glass_nav.hypotheses import bearing_weights
from glass_nav.hypotheses.bearing_weights import BearingMixture
from glass_nav.world import landmark_map
from glass_nav.world.landmark_map import UnknownLandmark


def around(pose: np.ndarray, spread: float, count: int, seed: int = 0) -> np.ndarray:
    return pose + np.random.default_rng(seed).normal(0.0, 1.0, (count, 3)) * [spread, spread, 0.3 * spread]


def test_the_weight_is_the_density_of_the_mixture():
    # one landmark straight ahead at 2 m, the particle turned by 0.02 rad; sigma of the angle and of 2 cm at 2 m
    ahead = landmark_map.seen_from_all_sides("A", np.array([[2.0, 0.0]]), sigma_m=0.02)
    read = seen(ahead, np.zeros(3), 0.01)
    found = bearing_weights.log_weights(np.array([[0.0, 0.0, 0.02]]), read, ahead, BearingMixture(0.1, 0.0))
    variance = 0.01**2 + (0.02 / 2.0) ** 2
    normal = np.exp(-0.5 * 0.02**2 / variance) / np.sqrt(2.0 * np.pi * variance)
    np.testing.assert_allclose(found, [np.log(0.9 * normal + 0.1 / (2.0 * np.pi))])


@pytest.mark.parametrize("number", range(4))
def test_the_true_pose_explains_the_bearings_best(number):
    particles = around(VIEWERS[number], 1.0, 2000)
    particles[137] = VIEWERS[number]
    read = seen(FIELD, VIEWERS[number], 0.005, base_from_sensor=(0.4, 0.1, 1.0))
    assert np.argmax(bearing_weights.log_weights(particles, read, FIELD)) == 137


@pytest.mark.parametrize("seed", range(5))
def test_weights_go_with_their_particles(seed):
    """Property: the order of particles and of bearings carries no information."""
    rng = np.random.default_rng(seed)
    particles, read = around(VIEWERS[0], 0.5, 50, seed), seen(FIELD, VIEWERS[0], 0.01, rng)
    order, turn = rng.permutation(50), rng.permutation(4)
    np.testing.assert_allclose(
        bearing_weights.log_weights(particles[order], read.subset(turn), FIELD),
        bearing_weights.log_weights(particles, read, FIELD)[order],
    )


def test_one_wrong_bearing_does_not_outweigh_three_right_ones():
    particles = around(VIEWERS[0], 0.5, 3000)
    particles[0] = VIEWERS[0]
    read = seen(FIELD, VIEWERS[0], 0.01)
    read.angles_rad[1] += 1.5
    best = particles[np.argmax(bearing_weights.log_weights(particles, read, FIELD))]
    assert np.hypot(*(best - VIEWERS[0])[:2]) < 0.15


def test_where_a_tag_answers_by_a_full_turn_more_is_the_same():
    read = seen(FIELD, VIEWERS[0], 0.01)
    turned = seen(FIELD, VIEWERS[0], 0.01)
    turned.angles_rad[:] += 2.0 * np.pi
    particles = around(VIEWERS[0], 0.5, 20)
    np.testing.assert_allclose(
        bearing_weights.log_weights(particles, turned, FIELD), bearing_weights.log_weights(particles, read, FIELD)
    )


def test_weighted_particles_have_the_mean_and_spread_of_the_least_squares_fix():
    """Second implementation: a dense cloud weighted by exact normals against Gauss and Newton."""
    from glass_nav.localization.bearings import triangulation

    read = seen(FIELD, VIEWERS[0], 0.01, np.random.default_rng(1))
    fix = triangulation.triangulate(read, FIELD)
    particles = np.random.default_rng(2).multivariate_normal(fix.map_from_base, 9.0 * fix.covariance, 200000)
    log_w = bearing_weights.log_weights(particles, read, FIELD, BearingMixture(1e-9, 0.0))
    drawn_from = np.einsum(
        "pi,ij,pj->p", particles - fix.map_from_base, np.linalg.inv(9.0 * fix.covariance), particles - fix.map_from_base
    )
    weights = np.exp(log_w - log_w.max() + 0.5 * drawn_from)
    mean = np.average(particles, axis=0, weights=weights)
    deviation = np.sqrt(np.average((particles - mean) ** 2, axis=0, weights=weights))
    sigma = np.sqrt(np.diag(fix.covariance))
    assert (np.abs(mean - fix.map_from_base) < 0.1 * sigma).all()
    np.testing.assert_allclose(deviation, sigma, rtol=0.05)


def test_a_floor_keeps_a_sharp_sensor_from_killing_all_particles_but_one():
    particles, read = around(VIEWERS[0], 0.2, 200), seen(FIELD, VIEWERS[0], 1e-5)

    def alive(mixture):
        weights = np.exp(bearing_weights.log_weights(particles, read, FIELD, mixture))
        return weights.sum() ** 2 / (weights**2).sum()

    assert alive(BearingMixture(bearing_sigma_floor=0.02)) > 3.0 * alive(BearingMixture(bearing_sigma_floor=0.001))


def test_no_bearings_say_nothing_and_unknown_ones_are_refused():
    particles = around(VIEWERS[0], 0.5, 3)
    assert bearing_weights.log_weights(particles, seen(FIELD, VIEWERS[0], ids=()), FIELD).tolist() == [0.0, 0.0, 0.0]
    other = landmark_map.seen_from_all_sides("AB", FIELD.positions_m[:2])
    with pytest.raises(UnknownLandmark, match="^landmark 'C' is not on the map, which has A, B$"):
        bearing_weights.log_weights(particles, seen(FIELD, VIEWERS[0]), other)


@pytest.mark.parametrize(
    "arguments, text",
    [
        ({"bearing_wrong_share": 0.0}, "~bearing_wrong_share must be > 0 and < 1, got 0.0"),
        ({"bearing_sigma_floor": -0.1}, "~bearing_sigma_floor must be >= 0 rad, got -0.1"),
    ],
)
def test_a_mixture_that_means_nothing_is_refused(arguments, text):
    with pytest.raises(ValueError) as caught:
        BearingMixture(**arguments)
    assert str(caught.value) == text
