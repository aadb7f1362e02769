"""The truth that a bag knows: poses in the map, and what each beam met."""

from __future__ import annotations

import numpy as np
import pytest
from opened_bags import refusal

from glass_nav.recording.log_file import open_log
from glass_nav.recording.recording import LogOptions, RecordingError


@pytest.mark.parametrize("truth_type", ["PoseStamped", "PoseWithCovarianceStamped"])
def test_the_ground_truth_is_a_trajectory_in_the_map(room_bag, truth_type):
    bag = room_bag(truth_type=truth_type)
    truth = open_log(bag.write()).ground_truth
    np.testing.assert_array_equal(truth.stamps_ns, bag.stamps_ns)
    np.testing.assert_allclose(truth.poses, bag.poses(bag.stamps_ns), atol=1e-9)


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
