"""The turning emitter: what it reads, when, and what hides a tag."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.geometry import angles, se2
from glass_nav.localization.bearings import triangulation
from glass_nav.sensing import bearings
from glass_nav.simulation import building_file, landmark_scanner, shipped_buildings
from glass_nav.simulation.building import Building, Mirror, Pane, Person, Thing, Wall, box
from glass_nav.simulation.landmark_scanner import LandmarkScanner, ScannerModel
from glass_nav.simulation.lidar import LidarModel
from glass_nav.simulation.simulation import START_NS, Simulation
from glass_nav.world import landmark_file, landmark_map
from glass_nav.world.landmark_map import LandmarkMap

STEP_NS = 20_000_000
HALL = Wall(np.array([[-20.0, -20.0], [20.0, -20.0], [20.0, 20.0], [-20.0, 20.0], [-20.0, -20.0]]))
FOUR = landmark_map.seen_from_all_sides("ABCD", np.array([[6.0, 0.3], [4.0, 5.0], [-3.0, 6.0], [2.0, -7.0]]), 15.0)


def hall(tags: LandmarkMap = FOUR, **parts) -> Building:
    return Building((HALL,), tags=tags, **parts)


def one_tag(at=(6.0, 0.3), facing_deg=np.nan, range_m=15.0) -> LandmarkMap:
    return LandmarkMap(
        ("A",), np.array([at], float), np.radians([facing_deg]), np.array([np.pi / 2.0]), np.array([range_m])
    )


def turns(building: Building, poses, model: ScannerModel = ScannerModel(), count: int = 1):
    """The first turns of a sensor at poses(time in s)."""
    scanner, found, now_ns = LandmarkScanner(model, building), [], 0
    while len(found) < count:
        now_ns += STEP_NS
        scanner.step(now_ns, poses(now_ns * 1e-9))
        found += scanner.take_turns()
    return found


def still(pose=(0.0, 0.0, 0.0)):
    return lambda _: np.array(pose)


def true_angles(tags: LandmarkMap, pose: np.ndarray) -> dict:
    way = tags.positions_m - pose[:2]
    return dict(zip(tags.ids, angles.wrap(np.arctan2(way[:, 1], way[:, 0]) - pose[2])))


@pytest.mark.parametrize("reading_deg", [0.5, 1.0])
@pytest.mark.parametrize("seed", range(3))
def test_bearings_are_read_in_steps_around_the_true_ones(reading_deg, seed):
    pose = np.append(np.random.default_rng(seed).uniform(-1.0, 1.0, 2), 0.2 * seed)
    (turn,) = turns(hall(), still(pose), ScannerModel(reading_rad=np.radians(reading_deg)))
    true = true_angles(FOUR, pose)
    assert {bearing.landmark_id for bearing in turn.bearings} == set("ABCD")
    for bearing in turn.bearings:
        off_deg = np.degrees(angles.wrap(bearing.angle_rad - true[bearing.landmark_id]))
        assert abs(off_deg) <= 0.5 * reading_deg + 0.09 + 1e-9  # half a step of reading, and of the motor
        steps = np.degrees(bearing.angle_rad) / reading_deg  # the middle of a step
        assert abs(steps - np.floor(steps) - 0.5) < 1e-6


@pytest.mark.long_run
def test_the_told_sigma_is_that_of_what_is_read():
    model, off = ScannerModel(), []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        pose = np.append(rng.uniform(-1.0, 1.0, 2), rng.uniform(-0.3, 0.3))
        (turn,) = turns(hall(), still(pose), model)
        true = true_angles(FOUR, pose)
        off += [angles.wrap(bearing.angle_rad - true[bearing.landmark_id]) for bearing in turn.bearings]
    assert np.std(off) == pytest.approx(model.sigma_rad, rel=0.12)
    assert abs(np.mean(off)) < 3.0 * model.sigma_rad / np.sqrt(len(off))


def test_a_turn_with_four_tags_takes_a_minute_and_goes_coarse_to_fine():
    first, second = turns(hall(), still(), count=2)
    # 30 coarse moves; for each of 4 tags one back and 10 fine ones
    assert first.stamp_ns == pytest.approx((30 + 4 * 11) * 0.8e9)
    assert second.stamp_ns == pytest.approx(2 * first.stamp_ns)
    stamps = [bearing.stamp_ns for bearing in first.bearings]
    assert stamps == sorted(stamps) and 0 < stamps[0] and stamps[-1] <= first.stamp_ns
    assert [bearing.landmark_id for bearing in first.bearings] == list("DABC")  # from right to left, then back
    assert [bearing.landmark_id for bearing in second.bearings] == list("CBAD")


def test_an_empty_hall_is_searched_in_coarse_moves_only():
    (turn,) = turns(hall(one_tag(at=(-6.0, 0.0))), still())  # in the gap behind the robot
    assert turn.bearings == () and turn.stamp_ns == pytest.approx(30 * 0.8e9)


@pytest.mark.parametrize(
    "parts, tag, seen",
    [
        pytest.param({}, one_tag(), True, id="nothing between"),
        pytest.param({"walls": (Wall(np.array([[3.0, -1.0], [3.0, 1.0]])),)}, one_tag(), False, id="wall"),
        pytest.param({"things": (Thing(box(3.0, 0.1, 0.5, 0.5)),)}, one_tag(), False, id="furniture"),
        pytest.param(
            {"things": (Thing(box(3.0, 0.1, 0.5, 0.5), present=False),)}, one_tag(), True, id="gone furniture"
        ),
        pytest.param(
            {"people": (Person(np.array([[3.0, 0.1], [3.0, 0.2]]), speed_m_s=1e-6),)},
            one_tag(),
            False,
            id="somebody in the way",
        ),
        pytest.param({"mirrors": (Mirror(np.array([[3.0, -1.0], [3.0, 1.0]])),)}, one_tag(), False, id="mirror"),
        pytest.param({"panes": (Pane(np.array([[3.0, -1.0], [3.0, 1.0]])),)}, one_tag(), True, id="pane"),
        pytest.param(
            {"panes": (Pane(np.array([[3.0, -1.0], [3.0, 1.0]])),)},
            one_tag(range_m=6.2),
            False,
            id="pane, light is used up",
        ),
        pytest.param({}, one_tag(range_m=6.2), True, id="the same range without the pane"),
        pytest.param({}, one_tag(range_m=5.9), False, id="out of range"),
        pytest.param({}, one_tag(facing_deg=180.0), True, id="looks at the robot"),
        pytest.param({}, one_tag(facing_deg=140.0), True, id="40 degrees off"),
        pytest.param({}, one_tag(facing_deg=130.0), False, id="50 degrees off"),
        pytest.param({}, one_tag(at=(19.9, 0.0), facing_deg=180.0, range_m=25.0), True, id="on a wall"),
    ],
)
def test_what_hides_a_tag(parts, tag, seen):
    walls = (HALL, *parts.pop("walls", ()))
    (turn,) = turns(Building(walls, tags=tag, **parts), still())
    assert [bearing.landmark_id for bearing in turn.bearings] == (["A"] if seen else [])


def test_a_driving_robot_takes_each_bearing_from_where_it_is_then():
    def pose(time_s):
        return np.array([-1.0 + 0.03 * time_s, 0.01 * time_s, 0.01 * time_s])

    (turn,) = turns(hall(), pose)
    assert len(turn.bearings) >= 3
    for bearing in turn.bearings:
        true = true_angles(FOUR, pose(bearing.stamp_ns * 1e-9))
        assert abs(np.degrees(angles.wrap(bearing.angle_rad - true[bearing.landmark_id]))) < 0.5 + 0.09 + 0.02


def test_the_simulation_tells_turns_once_in_its_own_time():
    building = hall(start=np.zeros(3))
    simulation = Simulation(
        building, LidarModel(beams=3), scanner=ScannerModel(move_s=0.1), base_from_emitter=(0.2, 0.1, 0.3)
    )
    for _ in range(80):
        simulation.move(0.1, np.zeros(3))
    (turn,) = simulation.take_turns()
    assert simulation.take_turns() == []
    assert START_NS < turn.bearings[0].stamp_ns <= turn.stamp_ns <= simulation.stamp_ns
    true = true_angles(FOUR, se2.compose(simulation.map_from_base, simulation.base_from_emitter))
    for bearing in turn.bearings:
        assert abs(np.degrees(angles.wrap(bearing.angle_rad - true[bearing.landmark_id]))) < 0.6
    assert Simulation(building, LidarModel(beams=3)).take_turns() == []


def test_a_scanner_does_not_change_what_else_is_random():
    def last(scanner):
        simulation = Simulation(hall(start=np.zeros(3)), LidarModel(beams=9), seed=4, scanner=scanner)
        return simulation.step(3.0, np.array([0.3, 0.0, 0.1]))

    one, other = last(None), last(ScannerModel())
    np.testing.assert_array_equal(one.scan.ranges_m, other.scan.ranges_m)
    np.testing.assert_array_equal(one.odom_from_base, other.odom_from_base)


def test_light_through_two_panes_is_the_product():
    panes = (Pane(np.array([[2.0, -1.0], [2.0, 1.0]])), Pane(np.array([[3.0, -1.0], [3.0, 1.0]])))
    origin, ahead = np.zeros(2), np.array([5.0, 0.0])
    one = landmark_scanner.light_between(hall(panes=panes[:1]).surfaces, origin, ahead)
    # Fresnel, face on: r = ((n - 1) / (n + 1))^2 of each surface, R = 2 r / (1 + r), and 8 mm of glass
    r = (0.51 / 2.51) ** 2
    assert one == pytest.approx((1.0 - 2.0 * r / (1.0 + r)) * np.exp(-4.0 * 0.008), rel=1e-6)
    assert landmark_scanner.light_between(hall(panes=panes).surfaces, origin, ahead) == pytest.approx(one**2)


@pytest.mark.parametrize(
    "fields, text",
    [
        (
            {"reading_rad": np.radians(0.1)},
            "a landmark scanner needs 0 < motor step <= reading step <= coarse move <= span "
            "<= 360 degrees, got 0.18, 0.1, 10, 300",
        ),
        ({"move_s": 0.0}, "a move of a landmark scanner must take > 0 s, got 0.0"),
    ],
)
def test_a_scanner_that_cannot_be_is_refused(fields, text):
    with pytest.raises(ValueError) as caught:
        ScannerModel(**fields)
    assert str(caught.value) == text


@pytest.mark.long_run
@pytest.mark.parametrize("hidden", ["A2", "A4", "A5"])  # without A3 the rest is far ahead: sigma 0.6 m, refused
def test_three_tags_of_the_glass_office_tell_a_robot_at_the_start_where_it_is(hidden):
    building = building_file.load(shipped_buildings.find("glass_office"))
    simulation = Simulation(building, LidarModel(beams=3), scanner=ScannerModel())
    while not (turns_made := simulation.take_turns()):
        simulation.move(1.0, np.zeros(3))
    taken = [bearing for bearing in turns_made[0].bearings if bearing.landmark_id != hidden]
    assert len(taken) == 3
    landmarks = landmark_file.load(shipped_buildings.find("glass_office").parent / "landmarks.yaml")
    fix = triangulation.triangulate(bearings.collected(taken, np.zeros((3, 3)), np.zeros(3)), landmarks)
    off = fix.map_from_base - simulation.map_from_base
    off[2] = angles.wrap(off[2])
    assert np.hypot(*off[:2]) < 0.3 and abs(off[2]) < 0.03
    assert off @ np.linalg.solve(fix.covariance, off) < 16.3  # chi-square of 3 degrees of freedom at 0.999
