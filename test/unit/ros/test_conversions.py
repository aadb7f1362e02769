"""Messages <-> the core's types: there and back, by hand, and refused when they mean nothing."""

from __future__ import annotations

import math
from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
import rospy
from geometry_msgs.msg import (
    Point,
    Point32,
    PolygonStamped,
    Pose,
    PoseArray,
    PoseWithCovarianceStamped,
    Quaternion,
    Transform,
    Vector3,
)
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header

from glass_nav.geometry import angles
from glass_nav.localization.beam_classification.surface_scan import SurfaceScan
from glass_nav.localization.beam_report import BeamReport
from glass_nav.localization.integrity.protection_level import ProtectionLevels
from glass_nav.localization.localizer import BeamCases, Estimate
from glass_nav.msg import BeamCases as BeamCasesMsg
from glass_nav.msg import LocalizationStatus
from glass_nav.ros import conversions
from glass_nav.sensing import scan_placement
from glass_nav.sensing.mounting import Mounting
from glass_nav.sensing.scan import ScanError
from glass_nav.sensing.scan_placement import PlacedScan
from glass_nav.world.grid_map import GridMap


def sent_and_received(msg, kind=None):
    """What a subscriber gets: through the bytes on the wire."""
    raw = BytesIO()
    msg.serialize(raw)
    return (kind or type(msg))().deserialize(raw.getvalue())


def quaternion(roll: float, pitch: float, yaw: float) -> Quaternion:
    """By composing half-angle quaternions about z, y, x."""

    def times(a, b):
        return (
            a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
        )

    half = np.array([roll, pitch, yaw]) / 2
    w, x, y, z = times(
        times((np.cos(half[2]), 0, 0, np.sin(half[2])), (np.cos(half[1]), 0, np.sin(half[1]), 0)),
        (np.cos(half[0]), np.sin(half[0]), 0, 0),
    )
    return Quaternion(x, y, z, w)


# -- time


@pytest.mark.parametrize("stamp_ns", [0, 1, 999_999_999, 1_000_000_000, 1_700_000_000_123_456_789])
def test_stamps_keep_every_nanosecond(stamp_ns):
    assert conversions.ns_from_stamp(conversions.stamp_from_ns(stamp_ns)) == stamp_ns


def test_numpy_integers_are_stamps_too():
    assert conversions.stamp_from_ns(np.int64(1_500_000_000)) == rospy.Time(1, 500_000_000)


# -- poses


@pytest.mark.parametrize("planar", [(0, 0, 0), (1.5, -2.0, 3.1), (-700.0, 525.0, -3.1), (0, 0, np.pi / 2)])
def test_planar_poses_survive_the_way_there_and_back(planar):
    back = conversions.planar_from_pose(conversions.pose_from_planar(np.array(planar)))
    assert back == pytest.approx(np.array(planar, float))


@pytest.mark.parametrize("seed", range(5))
def test_yaw_is_the_direction_of_the_x_axis_seen_from_above(seed):
    roll, pitch, yaw = np.random.default_rng(seed).uniform(-0.5, 0.5, 3)
    pose = Pose(orientation=quaternion(roll, pitch, yaw))
    assert conversions.planar_from_pose(pose)[2] == pytest.approx(yaw)


def test_a_quaternion_need_not_have_length_one():
    pose = Pose(orientation=Quaternion(0.0, 0.0, 3.0, 3.0))
    assert conversions.planar_from_pose(pose)[2] == pytest.approx(np.pi / 2)


@pytest.mark.parametrize("xyzw", [(0, 0, 0, 0), (0, 0, np.nan, 1), (0, 0, np.inf, 1)])
def test_a_quaternion_without_direction_is_refused(xyzw):
    with pytest.raises(ValueError, match="quaternion"):
        conversions.rotation_from_quaternion(Quaternion(*xyzw))


def test_frames_lose_the_slash_of_tf1():
    assert conversions.frame_id("/base_link") == conversions.frame_id("base_link") == "base_link"


# -- initialpose


def guess_message() -> PoseWithCovarianceStamped:
    msg = PoseWithCovarianceStamped(header=Header(stamp=rospy.Time(5, 7), frame_id="/map"))
    msg.pose.pose = conversions.pose_from_planar(np.array([1.0, 2.0, 0.5]))
    spatial = np.zeros((6, 6))
    spatial[np.ix_([0, 1, 5], [0, 1, 5])] = [[0.25, 0.1, 0.0], [0.1, 0.25, 0.0], [0.0, 0.0, 0.07]]
    msg.pose.covariance = spatial.ravel().tolist()
    return msg


def test_a_guess_holds_stamp_pose_and_the_covariance_of_x_y_yaw():
    guess = conversions.guess_from_msg(guess_message(), "map")
    assert guess.stamp_ns == 5_000_000_007
    assert guess.map_from_base == pytest.approx([1.0, 2.0, 0.5])
    assert guess.covariance.tolist() == [[0.25, 0.1, 0.0], [0.1, 0.25, 0.0], [0.0, 0.0, 0.07]]


def test_a_guess_without_spread_is_a_guess():
    msg = guess_message()
    msg.pose.covariance = [0.0] * 36
    assert not conversions.guess_from_msg(msg, "map").covariance.any()


@pytest.mark.parametrize(
    "index, value, text",
    [
        pytest.param(0, np.nan, "finite", id="NaN"),
        pytest.param(14, np.inf, "finite", id="inf of z"),
        pytest.param(1, 0.2, "symmetric", id="asymmetric"),
        pytest.param(35, -0.1, "negative", id="negative yaw"),
        pytest.param(0, 0.01, "negative", id="correlation above 1"),
    ],
)
def test_a_covariance_that_is_none_is_refused(index, value, text):
    msg = guess_message()
    msg.pose.covariance[index] = value
    with pytest.raises(ValueError, match=text):
        conversions.guess_from_msg(msg, "map")


@pytest.mark.parametrize("frame", ["", "odom", "/world"])
def test_a_guess_in_another_frame_is_refused(frame):
    msg = guess_message()
    msg.header.frame_id = frame
    with pytest.raises(ValueError, match=f"frame 'map', got '{frame}'"):
        conversions.guess_from_msg(msg, "map")


# -- estimates


def estimate(particles: int = 3) -> Estimate:
    covariance = np.array([[0.04, 0.01, 0.002], [0.01, 0.09, 0.003], [0.002, 0.003, 0.01]])
    cases = BeamCases(
        np.array([1, 0, 4], np.uint8),
        np.array([1.0, np.nan, 3.0]),
        np.array([0.1, np.nan, 0.0]),
        np.array([0.9, 0.2, 0.6]),
    )
    poses = np.random.default_rng(0).uniform(-3, 3, (particles, 3))
    surface = SurfaceScan(np.array([1.1, np.inf, 2.0]), np.array([False, False, True]), True)
    return Estimate(
        1_000_000_001,
        np.array([1.0, 2.0, 0.5]),
        covariance,
        np.zeros(3),
        lambda: BeamReport(cases, 0.9, lambda: surface),
        poses,
        "LOCALIZED",
        "for the test",
        True,
        0.8,
    )


def test_the_pose_message_holds_the_covariance_at_x_y_and_yaw():
    msg = sent_and_received(conversions.pose_msg(estimate(), "map"))
    spatial = np.array(msg.pose.covariance).reshape(6, 6)
    assert spatial[np.ix_([0, 1, 5], [0, 1, 5])] == pytest.approx(estimate().covariance)
    assert not spatial[2:5].any() and not spatial[:, 2:5].any()
    guess = conversions.guess_from_msg(msg, "map")
    assert guess.map_from_base == pytest.approx([1.0, 2.0, 0.5])


@pytest.mark.parametrize("count", [0, 1, 500])
def test_the_packed_particles_arrive_as_poses(count):
    poses = estimate(count).particles
    msg = sent_and_received(conversions.pose_array(12, "map", poses), PoseArray)
    assert (msg.header.frame_id, conversions.ns_from_stamp(msg.header.stamp)) == ("map", 12)
    back = np.array([conversions.planar_from_pose(pose) for pose in msg.poses]).reshape(-1, 3)
    assert back[:, :2] == pytest.approx(poses[:, :2])
    assert angles.wrap(back[:, 2] - poses[:, 2]) == pytest.approx(0.0, abs=1e-9)


def test_the_status_says_the_state_as_number_and_word():
    msg = sent_and_received(conversions.status_msg(7, "map", "LOST", "nothing fits", 0.1, 0.25))
    assert (msg.state, msg.state_name, msg.reason) == (LocalizationStatus.LOST, "LOST", "nothing fits")
    assert (msg.used_share, msg.reliability) == pytest.approx((0.1, 0.25))
    assert np.isnan([msg.level_95_along_m, msg.level_999_heading_deg]).all()


def test_the_status_has_the_protection_levels_in_metres_and_degrees():
    levels = ProtectionLevels(np.array([0.1, 0.2, np.radians(3.0)]), np.array([0.4, 0.5, np.radians(6.0)]))
    msg = sent_and_received(conversions.status_msg(7, "map", "LOCALIZED", "fits", 0.9, 0.9, levels))
    assert (msg.level_95_along_m, msg.level_95_across_m, msg.level_95_heading_deg) == pytest.approx((0.1, 0.2, 3.0))
    assert (msg.level_999_along_m, msg.level_999_across_m, msg.level_999_heading_deg) == pytest.approx((0.4, 0.5, 6.0))


def area(*corners, frame="/map"):
    msg = PolygonStamped(header=Header(frame_id=frame))
    msg.polygon.points = [Point32(x, y, 0.0) for x, y in corners]
    return msg


def test_an_area_is_its_corners():
    corners = conversions.area_from_msg(area((0.0, 0.0), (2.0, 0.0), (2.0, 1.5)), "map")
    assert corners.tolist() == [[0.0, 0.0], [2.0, 0.0], [2.0, 1.5]]


@pytest.mark.parametrize(
    "msg, text",
    [
        (area((0.0, 0.0), (1.0, 0.0)), "an area needs at least 3 corners, got 2"),
        (area(), "an area needs at least 3 corners, got 0"),
        (
            area((0.0, 0.0), (1.0, 0.0), (math.nan, 1.0)),
            "the corners of an area must be finite, got [[0.0, 0.0], [1.0, 0.0], [nan, 1.0]]",
        ),
        (area((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), frame="odom"), "the area must be given in frame 'map', got 'odom'"),
    ],
)
def test_an_area_that_is_none_is_refused(msg, text):
    with pytest.raises(ValueError) as err:
        conversions.area_from_msg(msg, "map")
    assert str(err.value) == text


def test_beam_cases_arrive_beam_by_beam():
    msg = sent_and_received(
        conversions.beam_cases_msg(placed(scan_message(frame="/laser")).scan, estimate().cases), BeamCasesMsg
    )
    assert list(msg.cases) == [1, 0, 4]
    assert (msg.header.frame_id, msg.header.stamp) == ("laser", rospy.Time(9))
    assert np.array(msg.expected) == pytest.approx([1.0, np.nan, 3.0], nan_ok=True)
    assert np.array(msg.weight) == pytest.approx([0.9, 0.2, 0.6])


# -- scans


def scan_message(frame: str = "laser", **fields) -> LaserScan:
    values = dict(
        angle_min=-0.5, angle_max=0.5, angle_increment=0.5, range_min=0.1, range_max=10.0, ranges=[1.0, np.inf, 2.0]
    )
    return LaserScan(header=Header(stamp=rospy.Time(9), frame_id=frame), **{**values, **fields})


UPRIGHT = Mounting(np.array([0.2, 0.0, 0.0]), 0.4)


def placed(msg: LaserScan, mounting: Mounting = UPRIGHT) -> PlacedScan:
    raw = conversions.raw_scan_from_msg(msg)
    return PlacedScan(raw, scan_placement.mounted(raw, mounting), mounting, np.zeros(3))


def test_a_scan_keeps_ranges_angles_and_stamp():
    scan = placed(scan_message()).scan
    assert scan.stamp_ns == 9_000_000_000
    assert scan.angles_rad == pytest.approx([-0.5, 0.0, 0.5])
    assert scan.ranges_m.tolist() == [1.0, np.inf, 2.0]


@pytest.mark.parametrize("yaw", [0.0, 0.3, 2.5, -3.0])
def test_points_of_a_laser_upside_down_are_those_of_the_rotation_in_space(yaw):
    transform = Transform(Vector3(0.2, -0.1, 0.5), quaternion(np.pi, 0.0, yaw))
    mounting = conversions.mounting_from_transform(transform)
    assert mounting.upside_down and mounting.height_m == 0.5
    scan = placed(scan_message(ranges=[1.0, 3.0, 2.0]), mounting).scan
    in_laser = np.array([[np.cos(-0.5), np.sin(-0.5), 0], [3, 0, 0], [2 * np.cos(0.5), 2 * np.sin(0.5), 0]])
    in_base = in_laser @ conversions.rotation_from_quaternion(transform.rotation).T + [0.2, -0.1, 0.5]
    assert scan.points_in_base() == pytest.approx(in_base[:, :2])


def test_a_laser_that_nods_is_refused_and_says_by_how_much():
    transform = Transform(Vector3(0.2, 0.0, 0.5), quaternion(0.0, np.radians(45), 0.0))
    with pytest.raises(ScanError, match="tilted by 45 degrees; level within 20 degrees"):
        conversions.mounting_from_transform(transform)


def test_a_laser_nowhere_is_refused():
    with pytest.raises(ScanError, match="the laser's place on the robot: a position must be finite"):
        conversions.mounting_from_transform(Transform(Vector3(np.nan, 0.0, 0.0), quaternion(0, 0, 0)))


def surface_scan(cut_m: "list[float]", trusted: bool = True) -> SurfaceScan:
    """Of a scan of three beams; NaN: not cut."""
    cut = np.array(cut_m)
    return SurfaceScan(np.where(np.isnan(cut), [1.0, np.inf, 2.0], cut), ~np.isnan(cut), trusted)


def cut(msg: LaserScan, surface: SurfaceScan) -> LaserScan:
    return conversions.surface_scan_msg(placed(msg), surface)


def test_beams_are_cut_in_the_order_of_the_message_and_flagged():
    msg = scan_message(ranges=[1.0, np.inf, 2.0], intensities=[7.0, 8.0, 9.0], time_increment=0.001, scan_time=0.1)
    out = sent_and_received(cut(msg, surface_scan([np.nan, 0.7, 1.5])))
    assert out.ranges == pytest.approx([1.0, 0.7, 1.5])
    assert list(out.intensities) == [0.0, 1.0, 1.0]
    assert out.header.stamp == msg.header.stamp and out.header.frame_id == "laser"
    for name in ("angle_min", "angle_max", "angle_increment", "time_increment", "scan_time", "range_min", "range_max"):
        assert getattr(out, name) == pytest.approx(getattr(msg, name))


def test_what_is_not_cut_stays_as_the_driver_wrote_it():
    wrote = [0.0, -np.inf, 11.0, np.nan, 0.05]  # no answer in old drivers' ways, too near
    surface = SurfaceScan(np.full(5, np.nan), np.zeros(5, bool), True)
    out = cut(scan_message(ranges=wrote), surface)
    assert np.array_equal(out.ranges, wrote, equal_nan=True)
    assert out.intensities == [0.0] * 5


def test_a_raw_scan_is_told_by_its_intensities():
    out = cut(scan_message(), surface_scan([np.nan] * 3, trusted=False))
    assert out.ranges == [1.0, np.inf, 2.0]
    assert out.intensities == [-1.0] * 3


def test_the_frame_of_a_cut_scan_has_no_slash():
    msg = scan_message(frame="/laser")
    assert cut(msg, surface_scan([np.nan] * 3)).header.frame_id == "laser"


def test_a_cut_of_a_deskewed_scan_is_told_from_where_its_beam_began():
    began = np.array([[0.0, 0.0], [0.3, 0.4], [0.0, 0.0]])  # the middle beam, straight ahead from beside its way
    there = placed(scan_message(ranges=[1.0, np.inf, 2.0]))
    there = replace(there, scan=replace(there.scan, origins_m=began))
    out = conversions.surface_scan_msg(there, surface_scan([np.nan, 1.1, np.nan]))
    assert out.ranges == pytest.approx([1.0, np.hypot(0.8, 0.4), 2.0])
    cases = replace(estimate().cases, expected_m=np.array([1.0, np.nan, 2.0]))
    told = conversions.beam_cases_msg(there.scan, cases)
    assert told.expected == pytest.approx([1.0, np.nan, 2.0], nan_ok=True)


# -- maps


def grid_message(**fields) -> OccupancyGrid:
    msg = OccupancyGrid()
    msg.info.width, msg.info.height, msg.info.resolution = 3, 2, 0.05
    msg.info.origin = conversions.pose_from_planar(np.array([-1.0, 2.0, 0.3]))
    msg.data = [0, 100, -1, 50, 0, 100]
    for name, value in fields.items():
        setattr(msg if name == "data" else msg.info, name, value)
    return msg


def test_a_map_keeps_its_cells_and_the_yaw_of_its_origin():
    grid_map = conversions.map_from_msg(sent_and_received(grid_message()))
    assert grid_map.occupancy.tolist() == [[0, 100, -1], [50, 0, 100]]
    assert grid_map.map_from_grid == pytest.approx([-1.0, 2.0, 0.3])
    assert grid_map.resolution_m == 0.05  # the message has float32


def test_maps_survive_the_way_there_and_back():
    rng = np.random.default_rng(1)
    grid_map = GridMap(rng.integers(-1, 101, (7, 4)).astype(np.int8), 0.0889, np.array([1.0, 2.0, -2.0]))
    back = conversions.map_from_msg(sent_and_received(conversions.msg_from_map(grid_map, rospy.Time(4), "map")))
    assert np.array_equal(back.occupancy, grid_map.occupancy)
    assert back.resolution_m == grid_map.resolution_m
    assert back.map_from_grid == pytest.approx(grid_map.map_from_grid)


@pytest.mark.parametrize(
    "quaternion, yaw_rad, warned",
    [
        ((0.0, 0.0, 0.0, 0.0), 0.0, True),
        ((0.0, 0.0, 0.0, 1.0), 0.0, False),
        ((0.0, 0.0, 3.0, 3.0), np.pi / 2, False),  # not of length 1
        ((0.0, 0.0, -0.0, -0.0), 0.0, True),
    ],
)
def test_an_origin_without_a_rotation_is_not_rotated(caplog, quaternion, yaw_rad, warned):
    origin = Pose(Point(1.0, 2.0, 0.0), Quaternion(*quaternion))
    with caplog.at_level("WARNING", "rosout"):
        grid_map = conversions.map_from_msg(grid_message(origin=origin))
    np.testing.assert_allclose(grid_map.map_from_grid, [1.0, 2.0, yaw_rad])
    assert ("the quaternion of the map's origin is 0 0 0 0: taken as no rotation" in caplog.text) is warned


@pytest.mark.parametrize(
    "fields, text",
    [
        ({"data": [0] * 5}, "3 x 2 cells needs 6 values, got 5"),
        ({"data": []}, "got 0"),
        ({"width": 0, "height": 0, "data": []}, "at least one cell, got 0 x 0"),
        ({"data": [0, 0, 0, 0, 0, 101]}, "0 to 100 or -1 for unknown, got 101 in 1 cell"),
        ({"data": [0, -2, -3, 0, 0, 0]}, "got -2 in 2 cell"),
        ({"resolution": 0.0}, "resolution > 0"),
        ({"resolution": np.nan}, "resolution > 0"),
        ({"origin": Pose(orientation=Quaternion(0.0, 0.0, 0.0, np.nan))}, "the origin of the map: a quaternion"),
        ({"origin": Pose(Point(np.inf, 0.0, 0.0), Quaternion())}, "the origin of the map: a position"),
    ],
)
def test_what_is_no_map_is_refused(fields, text):
    with pytest.raises(ValueError, match=text.replace("(", r"\(")):
        conversions.map_from_msg(grid_message(**fields))


def test_the_glass_map_has_the_geometry_of_the_map():
    grid_map = GridMap(np.zeros((2, 3), np.int8), 0.0889, np.array([1.0, 2.0, -2.0]))
    glass = np.array([[0, 100, -1], [-1, 15, 99]])
    msg = sent_and_received(conversions.glass_map_msg(5_000_000_007, "map", grid_map, glass), OccupancyGrid)
    drawn = conversions.msg_from_map(grid_map, rospy.Time(5, 7), "map")
    assert (msg.header.frame_id, msg.header.stamp) == ("map", rospy.Time(5, 7))
    assert msg.info == sent_and_received(drawn).info
    assert list(msg.data) == [0, 100, -1, -1, 15, 99]


def test_a_glass_map_is_sent_as_the_generated_code_would():
    grid_map = GridMap(np.zeros((2, 3), np.int8), 0.05, np.zeros(3))
    packed = conversions.glass_map_msg(7, "map", grid_map, np.arange(-1, 5).reshape(2, 3))
    plain = OccupancyGrid(packed.header, packed.info, list(range(-1, 5)))
    written = [BytesIO(), BytesIO()]
    packed.serialize(written[0])
    plain.serialize(written[1])
    assert written[0].getvalue() == written[1].getvalue()
