"""One classifier in a room with a pane: what it tells apart, what it learns, and what it cuts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from buildings import BASE_FROM_LASER, GLASS_ROOM

from glass_nav.geometry import se2
from glass_nav.localization.beam_classification.beam_classifier import BeamClassifier
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.vocabulary import BeamCase
from glass_nav.world.grid_map import UNKNOWN

PARAMS = LocalizerParams().classifier
MAP = GLASS_ROOM.grid_map()
POSE = np.array([4.0, 1.8, 0.3])
NARROW = np.diag([0.02, 0.02, 0.01]) ** 2


def seen(passes, pose=POSE, beams=120):
    """A scan in which all beams pass the pane or none does, and the true cases."""
    scan = GLASS_ROOM.scan(pose, beams=beams)
    ranges_m, case = GLASS_ROOM.measured(se2.compose(pose, BASE_FROM_LASER), scan.angles_rad, np.full(beams, passes))
    return replace(scan, ranges_m=ranges_m), case


@pytest.mark.parametrize("passes", [False, True])
def test_beams_that_pass_a_pane_are_told_from_those_that_end_at_it(passes):
    scan, case = seen(passes)
    cases, _ = BeamClassifier(PARAMS, MAP).classify(scan, POSE, NARROW)
    told = cases.case != BeamCase.UNCERTAIN
    assert told.mean() > 0.85 and (cases.case == case)[told].mean() > 0.95


def test_fewer_samples_vote_where_the_pose_is_known_well_or_no_particle_is_weighed():
    scan, _ = seen(False)
    classifier = BeamClassifier(PARAMS, MAP)

    def voters(covariance, for_weights):
        return classifier.classify(scan, POSE, covariance, for_weights)[1].range_m.shape[1]

    assert [voters(NARROW, True), voters(NARROW, False), voters(0.2 * NARROW, True)] == [37, 13, 13]
    paper = BeamClassifier(replace(PARAMS, vote=replace(PARAMS.vote, vote_mode="paper")), MAP)
    assert paper.classify(scan, POSE, NARROW, False)[1].range_m.shape[1] == 37


def learnt(passes=True):
    classifier = BeamClassifier(PARAMS, MAP)
    for x in np.linspace(3.0, 5.0, 10):
        pose = np.array([x, 1.8, 0.0])
        scan, _ = seen(passes, pose)
        classifier.learn(scan, classifier.classify(scan, pose, NARROW)[1], pose)
    return classifier


def test_a_pane_that_beams_pass_is_learnt_as_seen_through_and_a_wall_as_not():
    def seen_through(classifier, point):
        rows, columns = MAP.cells(np.array([point]))
        return float(classifier.glass_map.chances(rows * MAP.occupancy.shape[1] + columns)[0, 0])

    classifier = learnt()
    assert seen_through(classifier, [6.0, 1.8]) > 0.8
    assert seen_through(classifier, [3.5, 4.0]) < 0.1


def test_parameters_change_from_the_next_scan_on_and_what_was_learnt_stays():
    classifier = learnt()
    residuals, percent = classifier.residuals, classifier.glass_map.occupancy()
    caster = classifier.caster
    classifier.reconfigure(replace(PARAMS, vote=replace(PARAMS.vote, case_min_share=1.0)))
    assert classifier.residuals is residuals and classifier.caster is caster
    np.testing.assert_array_equal(classifier.glass_map.occupancy(), percent)
    scan, _ = seen(True)
    assert (classifier.classify(scan, POSE, NARROW)[0].case == BeamCase.UNCERTAIN).mean() > 0.5
    for other in (replace(PARAMS, raycast_threads=2), replace(PARAMS, raycast_backend="mrpt")):
        caster = classifier.caster
        classifier.reconfigure(other)
        assert classifier.caster is not caster


def test_how_thick_glass_may_be_can_change_at_run_time():
    """A box of 0.3 m that was carried out: beams that pass prove that it is gone, unless it may be glass."""
    cells = MAP.occupancy.copy()
    rows, columns = MAP.cells(np.array([[4.8, 1.8], [5.05, 2.3]]))
    cells[rows[0] : rows[1] + 1, columns[0] : columns[1] + 1] = 100
    with_box = replace(MAP, occupancy=cells)
    thick = replace(PARAMS, vote=replace(PARAMS.vote, glass_max_thickness_m=1.0))

    def surfaces(params, then):
        classifier = BeamClassifier(params, with_box)
        classifier.reconfigure(then)
        for x in np.linspace(3.0, 4.0, 5):
            pose = np.array([x, 2.0, 0.0])
            scan, _ = seen(True, pose)
            cases, expected = classifier.classify(scan, pose, NARROW)
            classifier.learn(scan, expected, pose)
        return classifier.surfaces(scan, cases, expected, True).ranges_m

    thin_ranges, thick_ranges = surfaces(PARAMS, PARAMS), surfaces(thick, thick)
    assert not np.array_equal(thin_ranges, thick_ranges)
    np.testing.assert_array_equal(surfaces(thick, PARAMS), thin_ranges)
    np.testing.assert_array_equal(surfaces(PARAMS, thick), thick_ranges)


@pytest.mark.parametrize("trusted", [True, False])
def test_beams_behind_the_pane_are_cut_at_it_when_the_pose_is_trusted(trusted):
    scan, case = seen(True)
    classifier = BeamClassifier(PARAMS, MAP)
    cases, _ = classifier.classify(scan, POSE, NARROW)
    expected = classifier.expected_at(scan, POSE)
    surfaces = classifier.surfaces(scan, classifier.seen_from(cases, scan, expected), expected, trusted)
    behind = case == BeamCase.FIRST_PENETRATION
    assert surfaces.cut[behind].mean() > 0.8 if trusted else not surfaces.cut.any()
    assert not surfaces.cut[~behind].any()


@pytest.mark.parametrize("mapped", [pytest.param(True, id="a pane"), pytest.param(False, id="an opening")])
def test_a_beam_leaves_the_map_through_a_surface_or_where_there_is_none(mapped):
    """The room behind x = 6 m is not mapped."""
    x_m = MAP.centres(*np.indices(MAP.occupancy.shape))[..., 0]
    occupancy = MAP.occupancy.copy()
    occupancy[x_m > 6.1] = UNKNOWN
    if not mapped:
        occupancy[(np.abs(x_m - 6.0) < 0.2) & MAP.occupied] = 0
    scan, case = seen(passes=True)
    beams = np.flatnonzero(scan.answered)
    left = BeamClassifier(PARAMS, replace(MAP, occupancy=occupancy)).left_through_surfaces(scan, beams, POSE)
    far = se2.transform_points(POSE, scan.points_in_base()[beams])[:, 0] > 7.0
    assert far.any() and not far.all()
    assert left[far].mean() > 0.95 if mapped else left[far].mean() < 0.2
    assert not left[~far & (case[beams] == BeamCase.DIFFUSE)].any()
