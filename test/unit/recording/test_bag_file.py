from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from glass_nav.geometry import se2
from glass_nav.recording.log_file import open_log
from glass_nav.recording.recording import LogOptions, RecordingError, Refusal, Step


def refusal(path, options=LogOptions()):
    """The line with which a bag is refused, without the folder it lies in."""
    with pytest.raises(RecordingError) as caught:
        list(open_log(path, options))
    text = str(caught.value)
    assert "\n" not in text
    return text.replace(f"{path.parent}/", "")


def steps(recording):
    entries = list(recording)
    assert all(isinstance(entry, Step) for entry in entries), entries
    return entries


@pytest.mark.parametrize("odometry", ["tf", "topic"])
@pytest.mark.parametrize("static_laser", [True, False])
@pytest.mark.parametrize("frame_prefix", ["", "/"])
def test_scans_come_with_the_odometry_at_their_stamps(room_bag, odometry, static_laser, frame_prefix):
    bag = room_bag(odometry=odometry, static_laser=static_laser, frame_prefix=frame_prefix)
    recording = open_log(bag.write())
    taken = steps(recording)
    true = bag.poses(bag.stamps_ns)
    assert [step.scan.stamp_ns for step in taken] == bag.stamps_ns.tolist()
    np.testing.assert_allclose([step.odom_from_base for step in taken], true - [*true[0, :2], 0.0], atol=1e-9)
    np.testing.assert_allclose(taken[3].scan.base_from_laser, bag.laser, atol=1e-9)
    assert len(recording) == bag.scans
    assert recording.name == "room.bag"
    assert recording.notes == [
        "scans from /scan",
        "odometry from tf odom <- base_link" if odometry == "tf" else "odometry from /odom",
        "ground truth from /ground_truth",
    ]


def test_odometry_is_interpolated_between_its_stamps(room_bag):
    def late(index, fields):
        return {**fields, "stamp_ns": fields["stamp_ns"] + 25_000_000}

    bag = room_bag(scan_fields=late)
    taken = steps(open_log(bag.write()))
    true = bag.poses(bag.stamps_ns + 25_000_000)
    np.testing.assert_allclose(
        [step.odom_from_base for step in taken], true - [*bag.poses(bag.stamps_ns[:1])[0, :2], 0.0], atol=2e-4
    )


@pytest.mark.parametrize("truth_type", ["PoseStamped", "PoseWithCovarianceStamped"])
def test_the_ground_truth_is_a_trajectory_in_the_map(room_bag, truth_type):
    bag = room_bag(truth_type=truth_type)
    truth = open_log(bag.write()).ground_truth
    np.testing.assert_array_equal(truth.stamps_ns, bag.stamps_ns)
    np.testing.assert_allclose(truth.poses, bag.poses(bag.stamps_ns), atol=1e-9)


@pytest.mark.parametrize("roll", [pytest.param(0.0, id="level"), pytest.param(np.pi, id="upside down")])
def test_scan_points_lie_on_the_walls_however_the_laser_is_mounted(room_bag, roll):
    bag = room_bag(laser=(0.1, -0.2, 0.7), laser_roll=roll)
    for step, true in zip(steps(open_log(bag.write())), bag.poses(bag.stamps_ns)):
        assert bag.distance_to_wall(se2.transform_points(true, step.scan.points_in_base())).max() < 1e-4


def turning(step_s):
    """Scans whose ranges are of one moment, and which say that their beams were step_s apart."""
    return lambda index, fields: {**fields, "time_increment": step_s}


@pytest.mark.parametrize("odometry", ["tf", "topic"])
def test_a_scan_that_takes_a_while_is_deskewed_by_odometry(room_bag, odometry):
    step_s = 0.001
    bag = room_bag(scan_fields=turning(step_s), odometry=odometry)
    recording = open_log(bag.write())
    assert recording.notes[-1] == "ground truth from /ground_truth"
    assert "a sweep of the lidar takes 59 ms: scans are deskewed by odometry" in recording.notes
    raw = steps(open_log(bag.path, LogOptions(deskew=False)))[5].scan
    scan = steps(recording)[5].scan
    # As the bag was written, the robot turns by 0.4 rad/s and drives at 0.5 m/s.
    beam = 50
    np.testing.assert_allclose(scan.as_measured(scan.ranges_m), raw.ranges_m, atol=1e-6)
    then = bag.poses(np.array([bag.stamps_ns[5], bag.stamps_ns[5] + 50_000_000]))
    laser = se2.compose(then[1], np.array(bag.laser))
    bearing = raw.angles_rad[beam] + laser[2]
    end = laser[:2] + raw.ranges_m[beam] * np.array([np.cos(bearing), np.sin(bearing)])
    np.testing.assert_allclose(se2.transform_points(then[0], scan.points_in_base()[beam]), end, atol=1e-3)


def test_a_time_that_no_lidar_takes_is_said_and_not_used(room_bag):
    recording = open_log(room_bag(scan_fields=turning(1.0)).write())
    assert (
        "scans are taken as of one moment: time_increment 1 s times 60 beams is 59 s, allowed 0.15 s"
    ) in recording.notes
    assert all(step.scan.origins_m is None for step in steps(recording))


def test_two_lidars_on_one_topic_are_told_apart_by_frame(room_bag):
    def rear_is_late(index, fields):
        if index % 2 == 0:
            return fields
        return {**fields, "frame": "base_link", "stamp_ns": fields["stamp_ns"] - 150_000_000}

    taken = steps(open_log(room_bag(scan_fields=rear_is_late).write()))
    assert [step.scan.lidar for step in taken[:4]] == ["laser", "base_link", "laser", "base_link"]
    assert taken[3].scan.stamp_ns < taken[2].scan.stamp_ns  # each by its own clock
    np.testing.assert_allclose(taken[3].scan.base_from_laser, 0.0, atol=1e-12)


def test_a_laser_on_its_side_is_refused_scan_by_scan(room_bag):
    bag = room_bag(laser_roll=np.pi / 2)
    assert {entry.reason for entry in open_log(bag.write())} == {
        "the laser is tilted by 90 degrees; level within 20 degrees is needed, upright or upside down"
    }


@pytest.mark.parametrize("odom_child", ["base_link", "/base_link", ""])
def test_the_base_is_the_frame_that_odometry_places(room_bag, odom_child):
    bag = room_bag(odometry="topic", odom_child=odom_child)
    np.testing.assert_allclose(steps(open_log(bag.write()))[0].scan.base_from_laser, bag.laser)
    taken = steps(open_log(bag.path, LogOptions(base_frame="base_link", odom_topic="odom")))
    np.testing.assert_allclose(taken[0].scan.base_from_laser, bag.laser)


def test_of_two_odometries_the_usual_name_wins(room_bag):
    assert "odometry from /odom" in open_log(room_bag(odometry="topic", odom_topics=("/odom", "/vo")).write()).notes


def test_an_odometry_without_one_pose_is_refused(room_bag, monkeypatch):
    from glass_nav.recording import frames

    path = room_bag(odometry="topic", laser_tf=False).write()
    monkeypatch.setattr(frames, "normalised", lambda quaternion: None)
    assert refusal(path) == "room.bag: /odom holds no pose that can be used"


def test_a_given_laser_pose_replaces_tf(room_bag):
    bag = room_bag(laser_tf=False)
    taken = steps(open_log(bag.write(), LogOptions(laser_pose=(0.4, 0.5, 0.6))))
    np.testing.assert_array_equal(taken[0].scan.base_from_laser, [0.4, 0.5, 0.6])


def test_a_recording_can_be_read_again(room_bag):
    recording = open_log(room_bag().write())
    again = recording.in_memory()
    assert len(list(recording)) == len(list(recording)) == len(list(again)) == len(again) == 20
    assert again.ground_truth is recording.ground_truth


def test_a_compressed_bag_reads_the_same(room_bag):
    bag = room_bag(compressed=True)
    assert len(steps(open_log(bag.write()))) == bag.scans


@pytest.mark.parametrize(
    "options, note",
    [
        (LogOptions(scan_topic="/rear"), "ground truth from /ground_truth"),
        (LogOptions(scan_topic="rear"), "ground truth from /ground_truth"),  # relative names, as in a launch file
        (LogOptions(), "scans from /scan"),
    ],
)
def test_of_several_lasers_one_is_chosen(room_bag, options, note):
    recording = open_log(room_bag(scan_topics=("/scan", "/rear")).write(), options)
    assert note in recording.notes
    assert len(recording) == 20


def test_no_ground_truth_is_looked_for_when_told_so(room_bag):
    assert open_log(room_bag().write(), LogOptions(ground_truth="none")).ground_truth is None
    bag = room_bag(ground_truth=False)
    bag.path.unlink()
    assert open_log(bag.write()).ground_truth is None


def test_an_odometry_topic_can_be_the_ground_truth(room_bag):
    bag = room_bag(odometry="topic")
    assert len(open_log(bag.write(), LogOptions(odom_topic="/odom", ground_truth="/odom")).ground_truth) == 42


def test_a_file_can_be_the_ground_truth(room_bag, tmp_path):
    (tmp_path / "true.txt").write_text("1000.0 1 2 0 0 0 0 1\n1001.0 2 2 0 0 0 0 1\n")
    recording = open_log(room_bag().write(), LogOptions(ground_truth=str(tmp_path / "true.txt")))
    np.testing.assert_allclose(recording.ground_truth.at(np.int64(1_000_500_000_000)), [1.5, 2.0, 0.0])


TOPICS = (
    "/ground_truth (geometry_msgs/PoseStamped), /scan (sensor_msgs/LaserScan), /tf (tf2_msgs/TFMessage), "
    "/tf_static (tf2_msgs/TFMessage)"
)


@pytest.mark.parametrize(
    "fields, options, text",
    [
        ({}, LogOptions(scan_topic="/front"), f"room.bag: no topic /front; it has {TOPICS}"),
        ({}, LogOptions(scan_topic="/tf"), "room.bag: /tf is tf2_msgs/TFMessage, expected sensor_msgs/LaserScan"),
        ({}, LogOptions(odom_topic="odom"), f"room.bag: no topic odom; it has {TOPICS}"),
        ({}, LogOptions(ground_truth="/truth"), f"room.bag: no topic /truth; it has {TOPICS}"),
        (
            {},
            LogOptions(ground_truth="/scan"),
            "room.bag: /scan is sensor_msgs/LaserScan, expected geometry_msgs/PoseStamped or "
            "geometry_msgs/PoseWithCovarianceStamped or nav_msgs/Odometry",
        ),
        ({}, LogOptions(ground_truth="true.txt"), "true.txt: no such file of poses, and no topic of room.bag"),
        (
            {"scan_topics": ("/front", "/rear")},
            LogOptions(),
            "room.bag: 2 topics of sensor_msgs/LaserScan (/front, /rear), choose one with --scan-topic",
        ),
        (
            {"scan_topics": ()},
            LogOptions(),
            "room.bag: no topic of sensor_msgs/LaserScan; it has "
            "/ground_truth (geometry_msgs/PoseStamped), /tf (tf2_msgs/TFMessage), /tf_static (tf2_msgs/TFMessage)",
        ),
        (
            {"odometry": "none", "ground_truth": False},
            LogOptions(),
            "room.bag: no odometry: no transform odom <- base_link or base_footprint in tf and no topic of "
            "nav_msgs/Odometry; it has /scan (sensor_msgs/LaserScan), /tf_static (tf2_msgs/TFMessage)",
        ),
        (
            {"odometry": "topic", "odom_topics": ("/left", "/right")},
            LogOptions(),
            "room.bag: 2 topics of nav_msgs/Odometry (/left, /right), choose one with --odom-topic",
        ),
        (
            {"odometry": "topic", "odom_topics": ("/true",)},
            LogOptions(ground_truth="/true"),
            "room.bag: no odometry: no transform odom <- base_link or base_footprint in tf and no topic of "
            "nav_msgs/Odometry; it has /ground_truth (geometry_msgs/PoseStamped), /scan (sensor_msgs/LaserScan), "
            "/tf_static (tf2_msgs/TFMessage), /true (nav_msgs/Odometry)",
        ),
        (
            {"laser": (float("nan"), 0.0, 0.0)},
            LogOptions(),
            "room.bag: no transform base_link <- laser for the laser on /scan; frames in tf: base_link, odom; "
            "say where it is with --laser-pose X Y YAW",
        ),
        (
            {},
            LogOptions(odom_frame="wheels"),
            "room.bag: no transform wheels <- base_link or base_footprint; frames in tf: base_link, laser, odom",
        ),
        (
            {"laser_tf": False},
            LogOptions(),
            "room.bag: no transform base_link <- laser for the laser on /scan; frames in tf: base_link, odom; "
            "say where it is with --laser-pose X Y YAW",
        ),
        (
            {"scan_fields": lambda index, fields: {**fields, "frame": ""}},
            LogOptions(),
            "room.bag: the scans on /scan have no frame_id; say where the laser is with --laser-pose X Y YAW",
        ),
    ],
)
def test_a_bag_that_lacks_something_is_refused_in_one_line(room_bag, fields, options, text):
    assert refusal(room_bag(**fields).write(), options) == text


@pytest.mark.parametrize(
    "keep, text",
    [
        (0, "room.bag: is empty"),
        (7, "room.bag: is no ROS 1 bag"),
        (
            3000,
            "room.bag: cut short or never closed (its index is missing); `rosbag reindex room.bag` may save what it "
            "holds",
        ),
        (
            -1,
            "room.bag: cut short or never closed (its index is missing); `rosbag reindex room.bag` may save what it "
            "holds",
        ),
    ],
)
def test_a_bag_cut_short_is_refused_in_one_line(room_bag, keep, text):
    path = room_bag().write()
    path.write_bytes(path.read_bytes()[:keep])
    assert refusal(path) == text


def test_files_that_are_no_bags_are_refused_in_one_line(tmp_path):
    (tmp_path / "notes.txt").write_text("not a bag")
    assert refusal(tmp_path / "notes.txt").startswith("notes.txt: cannot be read: ")
    assert refusal(tmp_path / "absent.bag") == "absent.bag: does not exist"
    assert refusal(tmp_path).startswith(f"{tmp_path.name}: is a folder without metadata.yaml")


def test_a_damaged_bag_gives_what_comes_before_the_damage(room_bag):
    path = room_bag(scans=400, beams=720).write()
    content = bytearray(path.read_bytes())
    middle = len(content) // 2
    content[middle : middle + 5000] = bytes(5000)
    path.write_bytes(content)
    entries = list(open_log(path))
    assert sum(isinstance(entry, Step) for entry in entries) > 50
    assert isinstance(entries[-1], Refusal)
    assert entries[-1].reason.startswith("the bag is damaged, /scan cannot be read after ")


def test_what_is_missing_because_of_damage_is_said_with_the_damage(room_bag):
    path = room_bag(static_laser=False, scans=400).write()
    content = bytearray(path.read_bytes())
    chunk = content.index(b"/tf")  # from the first message of tf on
    content[chunk + 3000 : chunk + 6000] = bytes(3000)
    path.write_bytes(content)
    entries = list(open_log(path))
    assert any(isinstance(entry, Refusal) for entry in entries)
    assert any(note.startswith("the bag is damaged, /tf cannot be read after ") for note in open_log(path).notes)
    assert ": no topic /nothing; it has " in refusal(path, LogOptions(ground_truth="/nothing"))
    assert "; the bag is damaged, /tf cannot be read after " in refusal(path, LogOptions(ground_truth="/nothing"))


def one_bad_scan(**changes):
    return lambda index, fields: {**fields, **changes} if index == 3 else fields


@pytest.mark.parametrize(
    "changes, reason",
    [
        ({"angle_increment": 0.0}, "angle_increment must be finite and not 0 rad, got 0.0"),
        ({"angle_min": float("nan")}, "angle_min must be finite, got nan"),
        ({"range_max": 0.0}, "range_max must be finite and > 0 m, got 0.0"),
        ({"range_min": -1.0}, "range_min must be in [0, range_max = 10.0) m, got -1.0"),
        ({"ranges": []}, "no ranges, a scan needs at least 1"),
        ({"frame": "elsewhere"}, "no transform base_link <- elsewhere"),
        ({"stamp_ns": 1_000_000_000_000 - 10**12}, "time runs backwards"),
        ({"stamp_ns": 1_000_000_000_000 + 10**11}, "no transform odom <- base_link at that time"),
    ],
)
def test_a_bad_scan_is_refused_and_the_rest_is_used(room_bag, changes, reason):
    entries = list(open_log(room_bag(scan_fields=one_bad_scan(**changes)).write()))
    assert [entry.reason for entry in entries if isinstance(entry, Refusal)] == [reason]
    assert isinstance(entries[3], Refusal)
    assert len(entries) == 20


def test_no_odometry_at_the_time_of_a_scan_refuses_it(room_bag):
    bag = room_bag(odometry="topic", scan_fields=one_bad_scan(stamp_ns=1_000_000_000_000 + 10**11))
    assert [entry.reason for entry in open_log(bag.write()) if isinstance(entry, Refusal)] == [
        "no odometry at that time"
    ]


def test_ranges_that_are_no_numbers_are_taken_as_rep_117_says(room_bag):
    def odd(index, fields):
        ranges = fields["ranges"].copy()
        ranges[:4] = np.nan, np.inf, -np.inf, 0.0
        return {**fields, "ranges": ranges}

    ranges = steps(open_log(room_bag(scan_fields=odd).write()))[0].scan.ranges_m
    np.testing.assert_array_equal(ranges[:4], [np.nan, np.inf, -np.inf, np.nan])
    assert np.isfinite(ranges[4:]).all()


def test_rosbags_missing_is_said_in_one_line(room_bag, monkeypatch):
    path = room_bag().write()
    monkeypatch.setitem(__import__("sys").modules, "rosbags.highlevel", None)
    assert refusal(path).startswith("room.bag: reading bags needs the Python package rosbags (pip install rosbags): ")


def test_a_real_bag_gives_every_scan(data_dir: Path):
    recording = open_log(data_dir / "logs" / "olin_mac" / "olin_mac.bag")
    assert len(steps(recording)) == 357
    assert recording.ground_truth.covers(np.array([step.scan.stamp_ns for step in recording]), 10**6).all()


def half_glass(index, fields):
    """Beams 0 to 9 through a pane at 1.5 m, the others diffuse."""
    crossing = np.where(np.arange(60) < 10, 1.5, np.nan)
    return {**fields, "cases": np.where(np.arange(60) < 10, 3, 1), "crossing": crossing}


def test_the_truth_about_the_beams_is_read_scan_by_scan(room_bag):
    bag = room_bag(true_beams=(("/true_beams", "TrueBeams"),), true_fields=half_glass)
    recording = open_log(bag.write())
    assert recording.notes[-1] == "true cases from /true_beams"
    for _ in range(2):  # from the start, every time the same
        truth = list(recording.beam_truth)
        assert [each.stamp_ns for each in truth] == bag.stamps_ns.tolist()
        assert truth[7].case.dtype == np.uint8
        np.testing.assert_array_equal(truth[7].case, [3] * 10 + [1] * 50)
        np.testing.assert_array_equal(truth[7].crossing_m, [1.5] * 10 + [np.nan] * 50)
    assert recording.in_memory().beam_truth[7].stamp_ns == bag.stamps_ns[7]


def test_true_cases_of_another_simulator_have_no_crossings(room_bag):
    recording = open_log(room_bag(true_beams=(("/sim/true_cases", "BeamCases"), ("/beam_cases", "BeamCases"))).write())
    assert recording.notes[-1] == "true cases from /sim/true_cases"  # the other one is what a localizer told
    truth = next(iter(recording.beam_truth))
    assert truth.crossing_m is None
    assert truth.case.tolist() == [1] * 60


@pytest.mark.parametrize(
    "topics, option", [((), None), ((("/beam_cases", "BeamCases"),), None), ((("/true_beams", "TrueBeams"),), "none")]
)
def test_without_truth_about_the_beams_there_is_none(room_bag, topics, option):
    recording = open_log(room_bag(true_beams=topics).write(), LogOptions(true_beams=option))
    assert recording.beam_truth is None
    assert recording.in_memory().beam_truth is None


def test_the_topic_of_the_truth_can_be_chosen(room_bag):
    topics = (("/a", "TrueBeams"), ("/b", "TrueBeams"))
    path = room_bag(true_beams=topics).write()
    assert refusal(path) == ("room.bag: 2 topics with the truth about beams (/a, /b), choose one with --true-beams")
    assert open_log(path, LogOptions(true_beams="b")).notes[-1] == "true cases from /b"
    assert refusal(path, LogOptions(true_beams="/scan")) == (
        "room.bag: /scan is sensor_msgs/LaserScan, expected glass_nav/TrueBeams or glass_nav/BeamCases"
    )
    path.unlink()
    assert open_log(room_bag(true_beams=(*topics, ("/true_beams", "TrueBeams"))).write()).notes[-1] == (
        "true cases from /true_beams"
    )


@pytest.mark.parametrize(
    "changes, text",
    [
        ({"cases": [1, 9, 2]}, "room.bag: /true_beams at 1000.300 s: cases must be 0 to 4, got 9"),
        ({"crossing": [1.0]}, "room.bag: /true_beams at 1000.300 s: 60 cases, but 1 crossings"),
    ],
)
def test_truth_that_is_none_is_refused(room_bag, changes, text):
    bag = room_bag(
        true_beams=(("/true_beams", "TrueBeams"),),
        true_fields=lambda index, fields: {**fields, **(changes if index == 3 else {})},
    )
    recording = open_log(bag.write())
    with pytest.raises(RecordingError) as caught:
        list(recording.beam_truth)
    assert str(caught.value).replace(f"{bag.path.parent}/", "") == text


@pytest.mark.parametrize("odometry", ["tf", "topic"])
def test_tf_tells_where_another_localization_took_the_robot_to_be(room_bag, odometry):
    bag = room_bag(odometry=odometry, amcl_error_m=0.1)
    recording = open_log(bag.write(), LogOptions(ground_truth="tf:map"))
    told = recording.ground_truth
    assert recording.notes[-1] == "ground truth from tf map <- base_link"
    # Known at the scans 5, 10 and 15 and between them; a transform may be 0.1 s old or new.
    assert told.stamps_ns.tolist() == bag.stamps_ns[4:17].tolist()
    error = 0.1 * np.clip(np.arange(4, 17) / 5.0, 1.0, 3.0)
    np.testing.assert_allclose(
        told.poses, bag.poses(told.stamps_ns) + np.stack([error, 0.0 * error, 0.0 * error], axis=1), atol=1e-9
    )


def test_a_frame_that_tf_does_not_place_the_robot_in_is_refused(room_bag):
    assert refusal(room_bag().write(), LogOptions(ground_truth="tf:map")) == (
        "room.bag: no transform map <- base_link; frames in tf: base_link, laser, odom"
    )
    room_bag().path.unlink()
    early = room_bag(
        amcl_error_m=0.1, scan_fields=lambda index, fields: {**fields, "stamp_ns": fields["stamp_ns"] - 10_000_000_000}
    )
    assert refusal(early.write(), LogOptions(ground_truth="tf:map")) == (
        "room.bag: no scan on /scan is in the time of the transforms map <- base_link"
    )
