"""How well each particle explains a scan: better where the robot is than beside it."""

from __future__ import annotations

import numpy as np
import pytest
from buildings import BASE_FROM_LASER, GLASS_ROOM, L_ROOM, RANGE_MAX_M

from glass_nav.geometry import se2
from glass_nav.localization.beam_classification.range_residuals import RangeResiduals
from glass_nav.localization.particle_filter import importance_weights
from glass_nav.localization.particle_filter.importance_weights import BeamMixture
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.raycast import RayCaster
from glass_nav.sensing.wall_thickness import wall_thickness

MID_WALL = RangeResiduals(depth_share=0.5, sigma_m=0.04)
MIXTURE = BeamMixture(
    laser_z_hit=0.95, laser_z_rand=0.05, laser_sigma_hit=0.04, laser_sigma_hit_max=0.2, laser_independent_beams=30.0
)


class Map:
    def __init__(self, building):
        self.grid_map = building.grid_map()
        self.caster = RayCaster(self.grid_map)
        self.thickness_m = wall_thickness(self.grid_map)

    def log_weights(self, poses, angles_rad, measured_m, case, residuals=MID_WALL, mixture=MIXTURE):
        from_laser = se2.compose(np.atleast_2d(poses), BASE_FROM_LASER)
        return importance_weights.by_ranges(
            self.caster,
            self.thickness_m,
            from_laser,
            angles_rad,
            measured_m,
            np.asarray(case, np.uint8),
            residuals,
            mixture,
            RANGE_MAX_M,
            0.2,
            0.9,
        )


@pytest.fixture(scope="module")
def l_room():
    return Map(L_ROOM)


@pytest.fixture(scope="module")
def glass_room():
    return Map(GLASS_ROOM)


ANGLES = np.linspace(-np.pi, np.pi, 60, endpoint=False)


def poses_around(true, rng, count=40, least_m=0.15):
    """Poses moved by 0.15 to 0.5 m and turned by up to 0.1 rad."""
    bearing, way = rng.uniform(-np.pi, np.pi, count), rng.uniform(least_m, 0.5, count)
    return true + np.column_stack([way * np.cos(bearing), way * np.sin(bearing), rng.uniform(-0.1, 0.1, count)])


@pytest.mark.parametrize("seed", range(8))
def test_where_the_robot_is_explains_more_than_anywhere_beside_it(l_room, seed):
    rng = np.random.default_rng(seed)
    true = np.array([rng.uniform(1.5, 4.0), rng.uniform(1.0, 2.5), rng.uniform(-3.0, 3.0)])
    scan = L_ROOM.scan(true, rng=rng, beams=60)
    log_w = l_room.log_weights(np.vstack([true, poses_around(true, rng)]), scan.angles_rad, scan.ranges_m, np.ones(60))
    assert np.all(log_w[0] > log_w[1:] + 1.0)


@pytest.mark.parametrize("seed", range(8))
def test_the_order_of_particles_carries_no_information(glass_room, seed):
    rng = np.random.default_rng(seed)
    poses = poses_around(np.array([3.0, 1.5, 0.5]), rng)
    measured_m, case = GLASS_ROOM.measured(se2.compose(poses[0], BASE_FROM_LASER), ANGLES, rng.random(60) < 0.5)
    order = rng.permutation(len(poses))
    straight = glass_room.log_weights(poses, ANGLES, measured_m, case)
    np.testing.assert_allclose(
        glass_room.log_weights(poses[order], ANGLES, measured_m, case), straight[order], rtol=1e-9
    )


@pytest.mark.parametrize("seed", range(4))
def test_the_order_of_beams_carries_no_information(glass_room, seed):
    rng = np.random.default_rng(seed)
    poses = poses_around(np.array([3.0, 1.5, 0.5]), rng)
    measured_m, case = GLASS_ROOM.measured(se2.compose(poses[0], BASE_FROM_LASER), ANGLES, rng.random(60) < 0.5)
    order = rng.permutation(60)
    np.testing.assert_allclose(
        glass_room.log_weights(poses, ANGLES[order], measured_m[order], case[order]),
        glass_room.log_weights(poses, ANGLES, measured_m, case),
        rtol=1e-9,
    )


@pytest.mark.parametrize("seed", range(4))
def test_beams_through_glass_tell_the_pose_by_the_wall_behind(glass_room, seed):
    """Only beams of case 3: the true pose still outweighs, and under case 1 it explains nothing."""
    rng = np.random.default_rng(seed)
    true = np.array([4.0, 1.8, 0.3 * seed])
    angles_rad = np.linspace(-0.6, 0.6, 80) - true[2]
    laser = se2.compose(true, BASE_FROM_LASER)
    measured_m, case = GLASS_ROOM.measured(laser, angles_rad, np.ones(80, bool))
    through = case == 3
    assert np.count_nonzero(through) > 40
    angles_rad, measured_m = angles_rad[through], measured_m[through] + rng.normal(0.0, 0.01, through.sum())
    poses = np.vstack([true, true + [[0.2, 0, 0], [-0.2, 0, 0], [0, 0, 0.2], [0, 0, -0.2]]])
    log_w = glass_room.log_weights(poses, angles_rad, measured_m, np.full(len(angles_rad), 3))
    assert np.all(log_w[0] > log_w[1:] + 1.0)
    assert glass_room.log_weights(poses, angles_rad, measured_m, np.ones(len(angles_rad)))[0] < log_w[0] - 10.0


def one_beam(room, shift_m, case=1, residuals=MID_WALL, mixture=MIXTURE):
    """Log weight of one beam that looks along x to the wall x = 6 (glass in the glass room) from 2 m away."""
    laser = se2.compose(np.array([4.0, 1.5, 0.0]), se2.inverse(BASE_FROM_LASER))
    return room.log_weights(laser, np.zeros(1), np.array([2.0 + shift_m]), [case], residuals, mixture)[0]


def test_one_beam_weighs_as_the_mixture_says(l_room):
    # One residual of 0.06 m at sigma 0.04: 0.95 exp(-1.125) + 0.05; a single beam is not weighed down.
    assert one_beam(l_room, 0.06) == pytest.approx(np.log(0.95 * np.exp(-1.125) + 0.05), abs=1e-4)
    assert one_beam(l_room, 0.0) == pytest.approx(0.0, abs=1e-4)
    assert one_beam(l_room, -1.0) == pytest.approx(np.log(0.05), abs=1e-4)


def test_each_case_has_its_own_wall(glass_room):
    # At y = 1.5 m: the pane at 2 m, the wall behind it (x = 9) at 5 m; nothing behind that.
    assert one_beam(glass_room, 0.0, case=1) == pytest.approx(0.0, abs=1e-4)
    assert one_beam(glass_room, 3.0, case=3) == pytest.approx(0.0, abs=1e-4)
    assert one_beam(glass_room, 3.0, case=1) == pytest.approx(np.log(0.05), abs=1e-4)
    assert one_beam(glass_room, 0.0, case=3) == pytest.approx(np.log(0.05), abs=1e-4)
    assert one_beam(glass_room, 3.0, case=4) == pytest.approx(np.log(0.05), abs=1e-4)


def test_a_mirrored_beam_is_held_against_the_mirrored_path(glass_room):
    # Head-on the mirror shows the wall behind the robot: 2 m to the pane and 6 m back to x = 0 m.
    log_w = [one_beam(glass_room, shift_m, case=2) for shift_m in (5.8, 6.0, 6.2, 0.0, 3.0)]
    assert np.argmax(log_w) == 1
    np.testing.assert_allclose(log_w[3:], np.log(0.05), atol=1e-3)


def test_a_beam_is_expected_as_deep_in_the_wall_as_was_learnt(l_room):
    at_the_boundary = RangeResiduals(depth_share=0.0, sigma_m=0.04)
    assert one_beam(l_room, -0.025, residuals=at_the_boundary) == pytest.approx(0.0, abs=1e-4)
    assert one_beam(l_room, 0.0, residuals=at_the_boundary) < -0.1


def test_a_residual_counts_across_the_wall(l_room):
    # 60 degrees to the wall's normal: 0.12 m along the beam are 0.06 m across.
    laser = se2.compose(np.array([2.0, 1.0, 0.0]), se2.inverse(BASE_FROM_LASER))
    along_m = 1.0 / np.cos(np.radians(60.0))
    log_w = l_room.log_weights(laser, np.radians([-30.0]), np.array([along_m + 0.12]), [1])
    assert log_w[0] == pytest.approx(np.log(0.95 * np.exp(-1.125) + 0.05), abs=0.01)


def test_many_beams_weigh_as_the_independent_ones_among_them(l_room):
    """30 times the same beam counts 30 times, and 120 times the same beam too."""
    laser = se2.compose(np.array([4.0, 1.5, 0.0]), se2.inverse(BASE_FROM_LASER))

    def log_w(count):
        return l_room.log_weights(laser, np.zeros(count), np.full(count, 2.06), np.ones(count))[0]

    single = one_beam(l_room, 0.06)
    assert log_w(10) == pytest.approx(10.0 * single)
    assert log_w(30) == pytest.approx(30.0 * single)
    assert log_w(120) == pytest.approx(30.0 * single)


def test_where_the_map_fits_badly_fewer_beams_are_independent():
    assert importance_weights.independent_beams(RangeResiduals(0.5, 0.04), MIXTURE) == 30.0
    assert importance_weights.independent_beams(RangeResiduals(0.5, 0.01), MIXTURE) == 30.0
    fewer = [
        importance_weights.independent_beams(RangeResiduals(0.5, sigma_m), MIXTURE) for sigma_m in (0.05, 0.08, 0.12)
    ]
    assert 30.0 > fewer[0] > fewer[1] > fewer[2] > 0.0
    assert fewer[2] <= 10.0 + 1e-9  # three times the spread: at most a third


def test_without_beams_all_particles_are_alike(l_room):
    np.testing.assert_array_equal(
        l_room.log_weights(np.zeros((5, 3)), np.zeros(0), np.zeros(0), np.zeros(0)), np.zeros(5)
    )


# -- by how far beams end from walls


def ends_on_walls(building, true, rng, glass_share=0.0, beams=120):
    """(B, 2) end points in the robot's frame of the beams that ended at a mapped surface."""
    scan = building.scan(true, rng=rng, beams=beams, glass_share=glass_share)
    return scan.points_in_base()


@pytest.mark.parametrize("seed", range(8))
def test_by_the_field_too_the_robot_is_where_beams_end_on_walls(l_room, seed):
    rng = np.random.default_rng(seed)
    true = np.array([rng.uniform(1.5, 4.0), rng.uniform(1.0, 2.5), rng.uniform(-3.0, 3.0)])
    ends_m = ends_on_walls(L_ROOM, true, rng)
    log_w = importance_weights.by_field(
        DistanceField(l_room.grid_map), np.vstack([true, poses_around(true, rng)]), ends_m, MID_WALL, MIXTURE
    )
    assert np.all(log_w[0] > log_w[1:] + 1.0)


@pytest.mark.parametrize("seed", range(4))
def test_by_the_field_beams_through_glass_count_by_the_wall_behind(glass_room, seed):
    rng = np.random.default_rng(seed)
    true = np.array([rng.uniform(2.0, 5.0), rng.uniform(0.8, 2.2), rng.uniform(-0.5, 0.5)])
    ends_m = ends_on_walls(GLASS_ROOM, true, rng, glass_share=1.0)
    log_w = importance_weights.by_field(
        DistanceField(glass_room.grid_map), np.vstack([true, poses_around(true, rng)]), ends_m, MID_WALL, MIXTURE
    )
    assert np.all(log_w[0] > log_w[1:] + 1.0)


def test_by_the_field_one_end_weighs_as_the_mixture_says(l_room):
    """The wall x = 6 runs along the centres of its cells: an end 0.05 m before it is 0.05 m away."""

    def log_w(x_m):
        return importance_weights.by_field(
            DistanceField(l_room.grid_map), np.array([[4.0, 1.5, 0.0]]), np.array([[x_m - 4.0, 0.0]]), MID_WALL, MIXTURE
        )[0]

    assert log_w(6.0) == pytest.approx(0.0, abs=1e-4)
    assert log_w(5.95) == pytest.approx(np.log(0.95 * np.exp(-0.5 * 1.25**2) + 0.05), abs=1e-3)
    assert log_w(5.0) == pytest.approx(np.log(0.05), abs=1e-3)


def test_by_the_field_particles_and_ends_have_no_order_and_ends_no_weight_beyond_their_number(l_room):
    rng = np.random.default_rng(0)
    true = np.array([2.5, 1.5, 0.3])
    ends_m, poses = ends_on_walls(L_ROOM, true, rng, beams=20), poses_around(true, rng)
    field = DistanceField(l_room.grid_map)
    log_w = importance_weights.by_field(field, poses, ends_m, MID_WALL, MIXTURE)
    order, ends_order = rng.permutation(len(poses)), rng.permutation(len(ends_m))
    np.testing.assert_allclose(
        importance_weights.by_field(field, poses[order], ends_m[ends_order], MID_WALL, MIXTURE), log_w[order], rtol=1e-5
    )
    thrice = importance_weights.by_field(field, poses, np.tile(ends_m, (3, 1)), MID_WALL, MIXTURE)
    np.testing.assert_allclose(thrice, log_w * 30.0 / 20.0, rtol=1e-5)  # MIXTURE: 30 of the 60 are independent


def test_by_the_field_without_ends_all_particles_are_alike(l_room):
    np.testing.assert_array_equal(
        importance_weights.by_field(
            DistanceField(l_room.grid_map), np.zeros((5, 3)), np.zeros((0, 2)), MID_WALL, MIXTURE
        ),
        np.zeros(5),
    )


def test_ends_on_walls_are_those_of_cases_one_three_and_four():
    """What was mirrored ends where nothing is, what is not understood anywhere."""
    assert importance_weights.known_ends(np.arange(5, dtype=np.uint8)).tolist() == [False, True, False, True, True]


# -- which beams


@pytest.mark.parametrize(
    "values, text",
    [
        (dict(weight_mode="rays"), "~weight_mode must be one of field, ranges, got 'rays'"),
        (dict(laser_max_beams=1), "~laser_max_beams must be >= 2, got 1"),
        (dict(laser_z_hit=0.0), "~laser_z_hit must be > 0, got 0.0"),
        (dict(laser_z_rand=0.0), "~laser_z_rand must be > 0, got 0.0"),
        (dict(laser_sigma_hit=-0.1), "~laser_sigma_hit must be > 0, got -0.1"),
        (dict(laser_independent_beams=float("nan")), "~laser_independent_beams must be > 0, got nan"),
    ],
)
def test_wrong_values_are_refused_in_one_line(values, text):
    with pytest.raises(ValueError) as err:
        BeamMixture(**values)
    assert str(err.value) == text
