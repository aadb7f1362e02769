"""Scenes worked by hand: the laser at (2, 5) of a hall of 20 x 10 m looks along x, the wall ahead is at x = 19.9 m.

TRANSPARENT is a lidar to which panes send nothing back by themselves, WHITE one to which all of them do.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from glass_nav.simulation import glass, lidar
from glass_nav.simulation.building import Building, Door, Mirror, Pane, Person, Thing, Wall, box
from glass_nav.simulation.lidar import LidarModel

TRANSPARENT = LidarModel(
    beams=3,
    field_of_view_rad=0.002,
    noise_m=0.0,
    dropout=0.0,
    specular=0.0,
    dirty_share=0.0,
    half_rad=0.0,
    width_rad=1e-9,
)
WHITE = replace(TRANSPARENT, specular=1.0, dirty_share=1.0, half_rad=np.pi)
LASER = np.array([2.0, 5.0, 0.0])
AHEAD_M = 17.9
CLEAN = 1e-9


def pane(*ends, **how):
    return Pane(np.array(ends, float).reshape(2, 2), dirt=CLEAN, **how)


def across(x):
    """A pane across the hall."""
    return pane(x, 0.0, x, 10.0)


def hall(**parts):
    """The hall, all of it on the map, whatever panes divide it."""
    wall = Wall(np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 10.0], [0.0, 10.0], [0.0, 0.0]]), 0.2, reflectance=1.0)
    seen = np.stack([np.linspace(0.5, 19.5, 77), np.full(77, 0.7)], axis=-1)
    parts = {name: tuple(value) for name, value in parts.items()}
    return Building((wall,), start=np.array([1.0, 1.0, 0.0]), seen_m=np.concatenate([seen, seen + [0.0, 8.6]]), **parts)


def thing(x, y=5.0, size=1.0, **flags):
    return Thing(box(x, y, size, size), **{"reflectance": 1.0, **flags})


def ahead(building, model=TRANSPARENT, yaw_rad=0.0, time_s=0.0, seed=0):
    """Range, case, exact and crossing of the beam in the middle, rounded to 0.1 mm; None for NaN."""
    scan = lidar.scan(model, building, LASER + [0.0, 0.0, yaw_rad], time_s, np.random.default_rng(seed))
    values = (scan.ranges_m[1], int(scan.case[1]), scan.exact_m[1], scan.crossing_m[1])
    return tuple(
        None if np.isnan(value) else value if isinstance(value, int) else round(float(value), 4) for value in values
    )


NO_ANSWER = (np.inf, 0, None)


def test_a_wall_ends_a_beam():
    assert ahead(hall()) == (AHEAD_M, 1, AHEAD_M, None)


def test_the_intensity_is_the_power_of_the_echo():
    """Of a white wall face on 1000 / r^2; of a beam without an answer 0."""

    def intensity(building, model):
        return float(lidar.scan(model, building, LASER, 0.0, np.random.default_rng(0)).intensity[1])

    assert intensity(hall(), TRANSPARENT) == round(1000.0 / AHEAD_M**2)
    assert intensity(hall(), replace(TRANSPARENT, range_max_m=5.0)) == 0.0


def test_a_pane_answers_itself_or_lets_the_wall_behind_answer():
    assert ahead(hall(panes=[across(6.0)]), WHITE) == (4.0, 1, 4.0, None)
    assert ahead(hall(panes=[across(6.0)])) == (AHEAD_M, 3, AHEAD_M, 4.0)


def test_the_second_pane_and_the_wall_behind_it():
    panes = [across(6.0), across(9.0)]
    assert ahead(hall(panes=panes)) == (AHEAD_M, 4, AHEAD_M, 4.0)
    second = replace(WHITE, echo="last")
    assert ahead(hall(panes=[*panes, across(19.0)]), replace(second, range_max_m=10.0)) == (7.0, 3, 7.0, 4.0)


def test_three_panes_are_too_many():
    assert ahead(hall(panes=[across(6.0), across(9.0), across(12.0)])) == (AHEAD_M, 0, AHEAD_M, 4.0)


FLAT_RAD = np.deg2rad(10.0)  # 80 degrees from the normal of a pane along x
FLAT_PANE = pane(1.0, 5.5, 19.9, 5.5)
MET_M = round(0.5 / np.sin(FLAT_RAD), 4)  # 2.8794
TABLE_M = round(9.5 / np.cos(FLAT_RAD), 4)  # 9.6466: the image of the table face at x = 11.5, y = 4.33


def test_a_flat_beam_is_mirrored():
    assert ahead(hall(panes=[FLAT_PANE], things=[thing(12.0, 4.3)]), yaw_rad=FLAT_RAD) == (TABLE_M, 2, TABLE_M, MET_M)


def test_what_a_mirrored_beam_ends_at_must_be_on_the_map():
    def mirrored(**flags):
        return ahead(
            hall(panes=[FLAT_PANE], things=[thing(12.0, 4.3), thing(10.0, 4.55, 0.6, **flags)]), yaw_rad=FLAT_RAD
        )

    nearer_m = round(7.7 / np.cos(FLAT_RAD), 4)
    assert mirrored() == (nearer_m, 2, nearer_m, MET_M)
    assert mirrored(mapped=False) == (nearer_m, 0, nearer_m, MET_M)
    assert mirrored(present=False) == (TABLE_M, 0, TABLE_M, MET_M)


def test_a_beam_mirrored_behind_something_gone_is_uncertain():
    gone = thing(3.0, 5.18, 0.2, present=False)
    assert ahead(hall(panes=[FLAT_PANE], things=[thing(12.0, 4.3), gone]), yaw_rad=FLAT_RAD)[1] == 0


def test_mirrored_after_a_penetration_is_uncertain_and_crossed_at_the_penetration():
    """The pane across at x = 3 lets the beam through, the flat one mirrors it."""
    at_m = round(1.0 / np.cos(FLAT_RAD), 4)
    assert ahead(hall(panes=[across(3.0), FLAT_PANE], things=[thing(12.0, 4.3)]), yaw_rad=FLAT_RAD) == (
        TABLE_M,
        0,
        TABLE_M,
        at_m,
    )


def test_a_penetration_after_a_mirror_is_uncertain_and_crossed_at_the_mirror():
    assert ahead(hall(panes=[pane(7.0, 0.0, 7.0, 5.4), FLAT_PANE], things=[thing(12.0, 4.3)]), yaw_rad=FLAT_RAD) == (
        TABLE_M,
        0,
        TABLE_M,
        MET_M,
    )


def test_a_pane_seen_in_a_mirror_is_a_mirrored_surface():
    """A mirror at 45 degrees turns the beam down to a pane 2 m off."""
    building = hall(mirrors=[Mirror(np.array([[5.0, 6.0], [7.0, 4.0]]))], panes=[pane(5.0, 3.0, 7.0, 3.0)])
    assert ahead(building, WHITE)[1] == 1  # the mirror's own dust
    assert ahead(building, replace(WHITE, echo="last", range_max_m=7.0)) == (6.0, 2, 6.0, 4.0)


def test_a_mirror_lets_nothing_through():
    building = hall(mirrors=[Mirror(np.array([[5.0, 6.0], [7.0, 4.0]]))])
    assert ahead(building) == (8.9, 2, 8.9, 4.0)  # 4 m to the mirror, 4.9 m down to the wall at y = 0.1
    assert ahead(building, replace(TRANSPARENT, echo="last")) == (8.9, 2, 8.9, 4.0)


@pytest.mark.parametrize("ratio, case", [(4.5, 3), (6.5, 2)])
def test_at_60_degrees_the_mirrored_wall_wins_if_the_one_behind_is_5_and_a_half_times_as_far(ratio, case):
    """R = 0.154, T = 0.846: R^2 / d2^2 > T^2 / d3^2 from d3 / d2 = 5.5, both walls face on."""
    along = np.array([np.cos(np.pi / 6), np.sin(np.pi / 6)])  # the pane lies at 30 degrees to the beam
    met = np.array([4.0, 5.0])
    mirrored = np.array([0.5, np.sqrt(3.0) / 2.0])  # the beam turned by 60 degrees
    at = met + 0.4 * mirrored  # d2 = 2.4
    behind_m = 2.4 * ratio
    face = Thing(box(*(at + 0.5 * mirrored), 1.0, 0.6, np.pi / 3), reflectance=1.0)
    target = thing(2.0 + behind_m + 0.5)
    sheet = Pane(np.array([met - 0.9 * along, met + 0.9 * along]), thickness_m=1e-6, dirt=CLEAN)
    found = ahead(hall(panes=[sheet], things=[face, target]))
    assert found[1:] == (case, pytest.approx(2.4 if case == 2 else behind_m, abs=1e-3), pytest.approx(2.0, abs=1e-3))


def person(x):
    return Person(np.array([[x, 5.0], [x, 8.0]]), speed_m_s=1.0, radius_m=0.25)


def test_people_are_uncertain_before_and_behind_a_pane_and_walk_on():
    assert ahead(hall(people=[person(5.0)])) == (2.75, 0, 2.75, None)
    assert ahead(hall(people=[person(5.0)]), time_s=2.0) == (AHEAD_M, 1, AHEAD_M, None)
    assert ahead(hall(people=[person(9.0)], panes=[across(6.0)])) == (6.75, 0, 6.75, 4.0)
    assert ahead(hall(people=[person(5.0)], panes=[across(6.0)]))[1:] == (0, 2.75, None)


def test_what_stands_there_unmapped_is_uncertain():
    new = thing(9.5, mapped=False)
    assert ahead(hall(things=[new])) == (7.0, 0, 7.0, None)
    assert ahead(hall(things=[new], panes=[across(6.0)])) == (7.0, 0, 7.0, 4.0)
    assert ahead(hall(doors=[Door(np.array([[9.0, 4.0], [9.0, 6.0]]), "open", "closed", 0.1)]))[:2] == (6.95, 0)


def test_a_beam_through_the_place_of_something_gone_is_uncertain():
    gone = thing(9.5, present=False)
    assert ahead(hall(things=[gone])) == (AHEAD_M, 0, AHEAD_M, None)
    assert ahead(hall(things=[gone], panes=[across(6.0)])) == (AHEAD_M, 0, AHEAD_M, 4.0)
    assert ahead(hall(things=[gone], panes=[across(6.0)]), WHITE) == (4.0, 1, 4.0, None)  # it ended before
    assert ahead(hall(things=[gone, thing(8.0)])) == (5.5, 1, 5.5, None)
    assert ahead(hall(doors=[Door(np.array([[9.0, 4.0], [9.0, 6.0]]), "closed", "open")]))[:2] == (AHEAD_M, 0)


def test_a_mullion_is_opaque():
    assert ahead(hall(panes=[across(6.0)], things=[thing(6.0, size=0.08)])) == (3.96, 1, 3.96, None)


def test_a_double_glazing_is_one_surface():
    double = [pane(x, 0.0, x, 10.0, glazing="double", gap_m=0.06) for x in (6.0, 9.0)]
    assert ahead(hall(panes=double[:1])) == (AHEAD_M, 3, AHEAD_M, 3.97)
    assert ahead(hall(panes=double)) == (AHEAD_M, 4, AHEAD_M, 3.97)
    assert ahead(hall(panes=double[:1]), WHITE) == (3.97, 1, 3.97, None)
    assert ahead(hall(panes=double[:1]), replace(WHITE, echo="last", range_max_m=10.0)) == (4.03, 1, 4.03, None)


def test_a_flat_beam_into_double_glazing_is_mirrored_once():
    glazing = pane(1.0, 5.5, 19.9, 5.5, glazing="double", gap_m=0.06)
    found = ahead(hall(panes=[glazing], things=[thing(12.0, 4.3)]), yaw_rad=FLAT_RAD)
    assert found[1:] == (2, TABLE_M, round(0.47 / np.sin(FLAT_RAD), 4))


def outdoors(*parts):
    """A hall whose end is a pane; outside nothing is on the map."""
    wall = Wall(np.array([[16.0, 0.0], [0.0, 0.0], [0.0, 10.0], [16.0, 10.0]]), 0.2)
    return Building((wall,), panes=(across(16.0),), things=parts, start=np.array([1.0, 1.0, 0.0]))


def test_a_pane_with_nothing_behind_gives_no_answer_and_was_crossed():
    assert ahead(outdoors()) == (*NO_ANSWER, 14.0)


def test_what_is_outside_is_not_on_the_map_even_if_it_was_there():
    assert ahead(outdoors(thing(20.0))) == (17.5, 0, 17.5, 14.0)
    assert ahead(outdoors(thing(20.0, present=False))) == (*NO_ANSWER, 14.0)
    hidden = outdoors(thing(18.5, present=False), thing(22.0))  # nobody drew it, so nobody misses it
    assert ahead(hidden) == (19.5, 0, 19.5, 14.0)


def test_behind_an_unmapped_thing_no_pane_is_crossed():
    black = thing(9.0, mapped=False, reflectance=0.001)
    assert ahead(hall(panes=[across(16.0)], things=[black])) == (*NO_ANSWER, None)


def test_what_stands_at_a_pane_is_one_surface_with_it():
    for gap_m, found in ((0.06, (4.06, 1, 4.06, None)), (0.15, (4.15, 3, 4.15, 4.0))):
        assert ahead(hall(panes=[across(6.0)], things=[thing(6.5 + gap_m)])) == found
    beside = hall(panes=[across(6.0), across(6.06)])
    assert ahead(beside) == (AHEAD_M, 3, AHEAD_M, 4.0)


def test_what_a_beam_is_mirrored_into_at_once_is_one_surface_with_the_mirror():
    met_x = 2.0 + 0.5 / np.tan(FLAT_RAD)  # of the shelf the left face is 5 cm behind it
    shelf = Thing(np.array([[met_x + 0.05, 5.0], [met_x + 0.6, 5.0], [met_x + 0.6, 5.6], [met_x + 0.05, 5.6]]))
    _, case, exact_m, crossing_m = ahead(hall(panes=[FLAT_PANE], things=[shelf]), yaw_rad=FLAT_RAD)
    assert (case, crossing_m) == (1, None)
    assert exact_m == pytest.approx(MET_M + 0.05 / np.cos(FLAT_RAD), abs=1e-3)


def test_a_lost_beam_did_cross_the_pane_before_it():
    lossy = replace(TRANSPARENT, dropout=1.0)
    assert ahead(hall(panes=[across(6.0)]), lossy) == (*NO_ANSWER, 4.0)
    assert ahead(hall(), lossy) == (*NO_ANSWER, None)
    assert ahead(hall(panes=[across(6.0)]), replace(lossy, range_max_m=3.0)) == (*NO_ANSWER, None)


@pytest.mark.parametrize("echo, found", [("first", (4.0, 1)), ("strongest", (4.0, 1)), ("last", (AHEAD_M, 3))])
def test_the_lidar_reports_the_first_the_strongest_or_the_last_echo(echo, found):
    assert ahead(hall(panes=[across(6.0)]), replace(WHITE, echo=echo))[:2] == found


def test_a_weak_echo_of_the_pane_is_the_first_but_not_the_strongest():
    """Dirt of 2 percent at 4 m: 0.02 / 16; the wall: 0.81 / 17.9^2, twice as much; the floor: 0.1 / 25^2."""
    dirty = Pane(np.array([[6.0, 0.0], [6.0, 10.0]]), dirt=0.02)
    assert ahead(hall(panes=[dirty]))[1] == 3
    assert ahead(hall(panes=[dirty]), replace(TRANSPARENT, echo="first"))[1] == 1


@pytest.mark.parametrize(
    "reflectance, incidence_deg, answers",
    [(0.1, 0.0, True), (0.098, 0.0, False), (0.5, 77.0, True), (0.5, 79.0, False)],
)
def test_ten_percent_face_on_at_its_largest_range_is_what_a_lidar_just_sees(reflectance, incidence_deg, answers):
    """0.5 cos 78.5 degrees = 0.1."""
    model = replace(TRANSPARENT, range_max_m=12.01)
    turn = np.deg2rad(incidence_deg)
    target = Thing(
        np.array([14.0, 5.0])
        + (box(0.3, 0.0, 0.6, 4.0) @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])),
        reflectance=reflectance,
    )
    assert np.isfinite(ahead(hall(things=[target]), model)[0]) == answers


def test_ranges_outside_the_limits_are_told_by_rep_117():
    assert ahead(hall(things=[thing(2.58)]), replace(TRANSPARENT, range_min_m=0.1)) == (-np.inf, 0, None, None)
    assert ahead(hall(), replace(TRANSPARENT, range_max_m=17.8)) == (*NO_ANSWER, None)
    assert ahead(hall(), replace(TRANSPARENT, range_max_m=18.0))[0] == AHEAD_M


def test_ranges_scatter_by_the_noise_and_beams_are_lost_by_their_share():
    model = LidarModel(beams=4001, field_of_view_rad=0.004, noise_m=0.03, dropout=0.1)
    scan = lidar.scan(model, hall(), LASER, 0.0, np.random.default_rng(1))
    answered = np.isfinite(scan.ranges_m)
    assert (scan.case[answered] == 1).all() and (scan.case[~answered] == 0).all()
    assert np.isnan(scan.exact_m[~answered]).all()
    error_m = (scan.ranges_m - scan.exact_m)[answered]
    assert abs(error_m.mean()) < 0.002 and abs(error_m.std() - 0.03) < 0.0015
    assert abs((~answered).mean() - 0.1) < 0.015


def returned(model, incidence_deg, dirt=0.004):
    """Share of beams that a pane 4 m off sends back, of 4000 of about one incidence."""
    turn = np.deg2rad(incidence_deg)
    line = np.array([6.0, 5.0]) + np.array([[-1.0], [1.0]]) * 1.5 * np.array([-np.sin(turn), np.cos(turn)])
    building = hall(panes=[Pane(line, dirt=dirt)])
    wide = replace(model, beams=4001, field_of_view_rad=0.004, dropout=0.0)
    return (lidar.scan(wide, building, LASER, 0.0, np.random.default_rng(2)).case == 1).mean()


@pytest.mark.parametrize("incidence_deg", [0.0, 12.0, 18.0, 20.0, 25.0, 40.0])
def test_panes_return_a_logistic_share_of_beams_and_where_they_are_dirty_more(incidence_deg):
    model = LidarModel(half_rad=np.deg2rad(19.0), width_rad=np.deg2rad(2.0), dirty_share=0.1)
    clean = 1.0 / (1.0 + np.exp((incidence_deg - 19.0) / 2.0))
    for dirt, share in ((0.004, 0.1), (0.008, 0.2), (CLEAN, 0.0)):
        dirty = share * np.cos(np.deg2rad(incidence_deg))
        assert returned(model, incidence_deg, dirt) == pytest.approx(dirty + (1.0 - dirty) * clean, abs=0.025)


def test_by_lobe_a_pane_is_seen_where_its_lobe_beats_the_wall_behind():
    """A exp(-(theta / 5)^2) / 4^2 against 0.8 / 17.9^2: 1 against 0.04, which is 5 sqrt(ln 25) = 9 degrees."""
    model = replace(LidarModel(), visibility="lobe", lobe_rad=np.deg2rad(5.0))
    assert returned(model, 8.0, CLEAN) == 1.0
    assert returned(model, 10.0, CLEAN) == 0.0
    assert 0.0 < returned(replace(model, echo="first"), 40.0, 0.002) < 1.0  # speckle of the dirt near the floor


def slow_scan(building, model, laser):
    """Case, exact and crossing of each beam by a loop, for TRANSPARENT panes of one sheet, nothing gone or unmapped."""
    surfaces = building.surfaces

    def meets(origin, way, start):
        found = []
        for index in range(len(surfaces.kind)):
            a, b = surfaces.from_m[index], surfaces.to_m[index]
            matrix = np.array([way, a - b]).T
            if abs(np.linalg.det(matrix)) < 1e-12:
                continue
            distance, share = np.linalg.solve(matrix, a - origin)
            if distance > start and 0.0 <= share <= 1.0:
                normal = np.array([a[1] - b[1], b[0] - a[0]]) / np.hypot(*(b - a))
                found.append((distance, index, abs(normal @ way), (b - a) / np.hypot(*(b - a))))
        found.sort(key=lambda entry: entry[0])
        ends = [n for n, entry in enumerate(found) if surfaces.kind[entry[1]] == 0]
        return found[: ends[0]] if ends else found, found[ends[0]] if ends else None

    def through(panes):
        return np.prod([glass.sheet(c, model.coating, surfaces.thickness_m[i])[1] for _, i, c, _ in panes])

    rows = []
    for angle in model.angles_rad + laser[2]:
        way = np.array([np.cos(angle), np.sin(angle)])
        panes, end = meets(laser[:2], way, 0.0)
        echoes = []
        if end:
            passed = sum(end[0] - p[0] >= 0.1 for p in panes)
            crossing = panes[0][0] if passed else np.nan
            echoes.append(
                (
                    (surfaces.reflectance[end[1]] * end[2]) * through(panes) ** 2 / end[0] ** 2,
                    end[0],
                    [1, 3, 4, 0, 0][passed],
                    crossing,
                )
            )
        for n, (distance, _, cos, along) in enumerate(panes[:2]):
            mirrored = 2.0 * (way @ along) * along - way
            behind, image = meets(laser[:2] + distance * way, mirrored, 1e-6)
            if image:
                total = distance + image[0]
                light = through(panes[:n]) * glass.reflectance(cos, model.coating, 1) * through(behind)
                passed = sum(image[0] - p[0] >= 0.1 for p in behind)
                case = 0 if n or passed else 1 if image[0] < 0.1 else 2
                echoes.append(
                    (
                        surfaces.reflectance[image[1]] * image[2] * light**2 / total**2,
                        total,
                        case,
                        np.nan if case == 1 else panes[0][0],
                    )
                )
        echoes = [e for e in echoes if e[0] > 0.1 / model.range_max_m**2 and e[1] <= model.range_max_m]
        lost = (0.0, np.nan, 0, panes[0][0] if panes and panes[0][0] <= model.range_max_m else np.nan)
        rows.append(max(echoes, default=lost, key=lambda echo: echo[0])[1:])
    return np.array(rows).T


@pytest.mark.parametrize("seed", range(8))
def test_all_beams_at_once_are_what_a_loop_over_beams_finds(seed):
    rng = np.random.default_rng(seed)
    panes = []
    for _ in range(6):
        middle, turn, half = rng.uniform([3, 1.5], [18, 8.5]), rng.uniform(0, np.pi), rng.uniform(0.5, 3.0)
        way = half * np.array([np.cos(turn), np.sin(turn)])
        panes.append(Pane(np.clip(np.array([middle - way, middle + way]), 0.2, [19.8, 9.8]), dirt=CLEAN))
    things = [thing(*rng.uniform([3, 1], [19, 9]), rng.uniform(0.2, 1.0)) for _ in range(6)]
    building = replace(hall(panes=panes, things=things), seen_m=rng.uniform([0.2, 0.2], [19.8, 9.8], (400, 2)))
    model = replace(TRANSPARENT, beams=240, field_of_view_rad=2 * np.pi, coating=float(rng.choice([1.0, 4.0])))
    laser = np.array([2.0, 5.0, rng.uniform(-3, 3)])
    scan = lidar.scan(model, building, laser, 0.0, rng)
    case, exact_m, crossing_m = slow_scan(building, model, laser)[[1, 0, 2]]
    same = (scan.case == case) & np.isclose(scan.exact_m, exact_m, equal_nan=True)
    same &= np.isclose(scan.crossing_m, crossing_m, equal_nan=True)
    assert same.mean() > 0.98  # not all: two panes nearer than 0.1 m, ends in corners that nobody saw
    assert len(np.unique(case)) >= 3


def test_panes_at_every_bearing_are_met_by_every_beam():
    """No beam slips past the intervals by which crossings are looked up: panes and wall all round."""
    turn = np.linspace(0.0, 2.0 * np.pi, 14) + 0.123
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    panes = tuple(Pane(4.0 * np.array([a, b]), dirt=CLEAN) for a, b in zip(ring[:-1], ring[1:]))
    building = Building((Wall(8.0 * ring, 0.2),), panes=panes, seen_m=np.array([[6.0, 0.0]]))
    for yaw in (0.0, 1.0, 2.0, 3.0, -3.1):
        for field in (0.5 * np.pi, 1.5 * np.pi, 2.0 * np.pi):
            model = replace(TRANSPARENT, beams=360, field_of_view_rad=field)
            scan = lidar.scan(model, building, np.array([0.7, -0.4, yaw]), 0.0, np.random.default_rng(0))
            assert (scan.case == 3).mean() > 0.98
            assert np.isfinite(scan.crossing_m).all()


def test_the_same_seed_is_the_same_scan():
    building = hall(panes=[across(6.0)], people=[person(4.0)])
    first, second = (
        lidar.scan(lidar.preset("sensitive"), building, LASER, 0.5, np.random.default_rng(7)) for _ in range(2)
    )
    for name in ("ranges_m", "case", "exact_m", "crossing_m"):
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes()
    assert first.case.dtype == np.uint8
    assert first.ranges_m.shape == first.case.shape == first.exact_m.shape == first.crossing_m.shape == (541,)


def test_a_scan_of_a_building_takes_less_than_15_ms():
    """541 beams, 150 surfaces of which 30 are panes; measured 4 ms."""
    rng = np.random.default_rng(0)
    things = [thing(*rng.uniform([3, 1], [19, 9]), 0.4) for _ in range(29)]
    building = hall(panes=[pane(*rng.uniform([3, 1, 3, 1], [19, 9, 19, 9])) for _ in range(30)], things=things)
    model, times = lidar.preset("sensitive"), []
    for _ in range(12):
        before = time.process_time()
        lidar.scan(model, building, LASER, 0.0, rng)
        times.append(time.process_time() - before)
    assert len(building.surfaces.kind) >= 150
    assert np.median(times) < 0.015


def test_directions_go_round_counter_clockwise_with_the_middle_ahead():
    angles = LidarModel(beams=541).angles_rad
    assert np.rad2deg(angles[[0, 270, -1]]) == pytest.approx([-135.0, 0.0, 135.0])
    assert np.rad2deg(LidarModel(beams=4, field_of_view_rad=2 * np.pi).angles_rad) == pytest.approx([-180, -90, 0, 90])


def test_presets_are_known_by_name():
    assert lidar.preset("sensitive") == LidarModel()
    assert lidar.preset("weak").half_rad < np.deg2rad(5.0) < lidar.preset("sensitive").half_rad
    assert lidar.preset("coated").coating > 1.0
    with pytest.raises(
        ValueError,
        match="^unknown lidar preset 'sensitiv', known are sensitive, weak, coated; did you mean sensitive[?]$",
    ):
        lidar.preset("sensitiv")
    with pytest.raises(ValueError, match="^unknown lidar preset 'x', known are sensitive, weak, coated$"):
        lidar.preset("x")


@pytest.mark.parametrize(
    "field, text",
    [
        ({"beams": 1}, "lidar beams must be a whole number >= 2, got 1"),
        ({"beams": 2.5}, "lidar beams must be a whole number >= 2, got 2.5"),
        ({"echo": "loudest"}, "lidar echo must be one of first, strongest, last, got 'loudest'"),
        ({"visibility": "none"}, "lidar visibility must be one of logistic, lobe, got 'none'"),
        ({"field_of_view_rad": 7.0}, "lidar field_of_view_rad must be > 0 and <= 2 pi, got 7.0"),
        ({"range_min_m": 30.0}, "lidar ranges must be 0 <= range_min_m < range_max_m, finite, got 30.0 and 25.0"),
        ({"dropout": 1.1}, "lidar dropout must be 0 to 1, got 1.1"),
        ({"noise_m": -0.1}, "lidar noise_m must be >= 0, got -0.1"),
        ({"width_rad": 0.0}, "lidar width_rad must be > 0, got 0.0"),
    ],
)
def test_a_lidar_that_cannot_be_is_refused(field, text):
    with pytest.raises(ValueError) as caught:
        LidarModel(**field)
    assert str(caught.value) == text
