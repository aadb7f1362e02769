"""What rviz gets of the beams: the cloud and the markers, as a subscriber reads them from the wire."""

from __future__ import annotations

import time
from io import BytesIO
from typing import Dict, List

import numpy as np
import pytest
from geometry_msgs.msg import Point
from visualization_msgs.msg import Marker, MarkerArray

from glass_nav.localization.beam_classification.case_votes import BeamCases
from glass_nav.localization.beam_classification.surface_scan import SurfaceScan
from glass_nav.ros.localization import beam_displays
from glass_nav.sensing.scan import Scan
from glass_nav.vocabulary import BeamCase, LocalizationState

HEIGHT_M = 0.4


def beams(cases: List[int], ranges_m: List[float], cut_m: List[float]) -> "tuple[Scan, BeamCases, SurfaceScan]":
    """A scan with beams to the front, the left and so on by 90 degrees; the laser is 0.2 m ahead and turned by 90."""
    count = len(cases)
    scan = Scan(
        9_000_000_001, np.array(ranges_m), np.arange(count) * np.pi / 2, 0.1, 10.0, np.array([0.2, 0.0, np.pi / 2])
    )
    numbers = np.linspace(0.1, 0.9, count)
    cut = np.array(cut_m)
    return (
        scan,
        BeamCases(np.array(cases, np.uint8), 10.0 + numbers, 20.0 + numbers, numbers),
        SurfaceScan(np.where(np.isnan(cut), ranges_m, cut), ~np.isnan(cut), True),
    )


def received(msg: MarkerArray) -> Dict[str, List[Marker]]:
    """The markers a subscriber gets, by namespace."""
    raw = BytesIO()
    msg.serialize(raw)
    markers: Dict[str, List[Marker]] = {}
    for marker in MarkerArray().deserialize(raw.getvalue()).markers:
        markers.setdefault(marker.ns, []).append(marker)
    return markers


def points(marker: Marker) -> np.ndarray:
    return np.array([(point.x, point.y, point.z) for point in marker.points]).reshape(-1, 3)


def test_the_beam_cloud_holds_the_answers_with_colour_and_case():
    scan, cases, _ = beams([1, 0, 4], [1.0, np.inf, 2.0], [np.nan] * 3)
    msg = beam_displays.beam_cloud(scan, cases, HEIGHT_M, "base_link")
    assert (msg.header.frame_id, msg.width, msg.height) == ("base_link", 2, 1)
    assert len(msg.data) == msg.row_step == msg.width * msg.point_step
    cloud = np.frombuffer(msg.data, "<f4").reshape(2, -1)
    columns = {field.name: cloud[:, field.offset // 4] for field in msg.fields}
    assert columns["x"] == pytest.approx([0.2, 0.2], abs=1e-6)
    assert columns["y"] == pytest.approx([1.0, -2.0])
    assert columns["z"] == pytest.approx(HEIGHT_M)
    assert columns["case"].tolist() == [1.0, 4.0]
    assert columns["range"].tolist() == [1.0, 2.0]
    assert columns["weight"] == pytest.approx([0.1, 0.9])
    colour = int(np.ascontiguousarray(columns["rgb"]).view("<u4")[1])
    assert (colour >> 16, colour >> 8 & 255, colour & 255) == BeamCase(4).rgb


def test_a_scan_without_answers_is_an_empty_cloud():
    scan, cases, _ = beams([0, 0], [np.nan, np.inf], [np.nan] * 2)
    msg = beam_displays.beam_cloud(scan, cases, HEIGHT_M, "base_link")
    assert (msg.width, msg.data) == (0, b"")


def test_each_case_has_a_namespace_with_the_ends_of_its_beams():
    scan, cases, surface = beams([1, 3, 4, 1], [1.0, 2.0, 3.0, 4.0], [np.nan, 0.5, 1.5, np.nan])
    markers = received(beam_displays.beam_markers(scan, cases, surface, HEIGHT_M, "base_link"))
    assert sorted(markers) == [
        "0 uncertain",
        "1 first surface",
        "2 mirrored",
        "3 behind one pane",
        "4 behind two panes",
    ]
    ends = {name: both[1] for name, both in markers.items()}
    assert points(ends["1 first surface"]) == pytest.approx(np.array([[0.2, 1.0, 0.4], [4.2, 0.0, 0.4]]))
    assert points(ends["3 behind one pane"]) == pytest.approx(np.array([[-1.8, 0.0, 0.4]]))
    assert points(ends["4 behind two panes"]) == pytest.approx(np.array([[0.2, -3.0, 0.4]]))
    for case in BeamCase:
        end = ends[case.label]
        assert np.array([end.color.r, end.color.g, end.color.b]) * 255 == pytest.approx(case.rgb, abs=1e-3)


def test_a_beam_that_was_cut_has_a_line_from_the_surface_to_its_end():
    scan, cases, surface = beams([1, 3, 4], [1.0, 2.0, 3.0], [np.nan, 0.5, 1.5])
    markers = received(beam_displays.beam_markers(scan, cases, surface, HEIGHT_M, "base_link"))
    line = markers["3 behind one pane"][0]
    assert line.type == Marker.LINE_LIST and 0.0 < line.color.a < 1.0
    assert points(line) == pytest.approx(np.array([[-0.3, 0.0, 0.4], [-1.8, 0.0, 0.4]]))
    assert points(markers["4 behind two panes"][0])[:, 1] == pytest.approx([-1.5, -3.0])


def test_a_case_without_beams_still_shows_its_name_but_no_point():
    scan, cases, surface = beams([1], [1.0], [np.nan])
    line, ends, figures = received(beam_displays.beam_markers(scan, cases, surface, HEIGHT_M, "base_link"))[
        "2 mirrored"
    ]
    assert line.action == Marker.ADD
    assert points(line) == pytest.approx(np.array([[0.2, 0.0, 0.4]] * 2))  # in the laser, without length
    assert ends.action == figures.action == Marker.DELETE  # and what it had before goes away


def test_beams_without_an_answer_leave_no_nan_in_the_markers():
    scan, cases, surface = beams([0, 0, 0, 1], [np.nan, np.inf, -np.inf, 2.0], [np.nan, 1.0, np.nan, np.nan])
    markers = received(beam_displays.beam_markers(scan, cases, surface, HEIGHT_M, "base_link"))
    for both in markers.values():
        for marker in both:
            assert np.all(np.isfinite(points(marker)))
    assert markers["0 uncertain"][1].action == Marker.DELETE


def test_no_marker_that_rviz_would_call_wrong():
    scan, cases, surface = beams([0, 1, 2, 3], [1.0, 2.0, 3.0, 4.0], [np.nan, np.nan, 2.0, 3.0])
    for name, both in received(beam_displays.beam_markers(scan, cases, surface, HEIGHT_M, "base_link")).items():
        assert [marker.id for marker in both] == [0, 1, 2]
        for marker in both:
            assert (marker.header.frame_id, marker.header.stamp.to_nsec()) == ("base_link", 9_000_000_001)
            assert marker.pose.orientation.w == 1.0 and marker.color.a > 0.0 and marker.scale.x > 0.0
            assert marker.action == Marker.DELETE or len(marker.points) > 0, name
            assert marker.type != Marker.LINE_LIST or len(marker.points) % 2 == 0


def test_markers_are_sent_as_the_generated_code_would():
    scan, cases, surface = beams([1, 3, 4, 2], [1.0, 2.0, 3.0, 4.0], [np.nan, 0.5, 1.5, 3.0])
    packed = beam_displays.beam_markers(scan, cases, surface, HEIGHT_M, "base_link")
    packed.markers.append(beam_displays.status_marker(np.zeros(3), "map", "LOST", "for the test", 0.1))
    plain = MarkerArray()
    for marker in packed.markers:
        values = {name: getattr(marker, name) for name in Marker.__slots__}
        if hasattr(marker, "packed"):
            values["points"] = [Point(*point) for point in marker.packed]
        plain.markers.append(Marker(**values))
    written = [BytesIO(), BytesIO()]
    packed.serialize(written[0])
    plain.serialize(written[1])
    assert written[0].getvalue() == written[1].getvalue()


def test_the_markers_of_541_beams_take_no_3_ms():
    rng = np.random.default_rng(0)
    ranges = rng.uniform(1.0, 9.0, 541)
    scan, cases, surface = beams(rng.integers(0, 5, 541).tolist(), ranges.tolist(), (0.5 * ranges).tolist())
    seconds = []
    for _ in range(20):
        started = time.process_time()
        beam_displays.beam_markers(scan, cases, surface, HEIGHT_M, "base_link").serialize(BytesIO())
        seconds.append(time.process_time() - started)
    assert min(seconds) < 0.003


@pytest.mark.parametrize("state", sorted(LocalizationState))
def test_every_state_has_words_above_the_robot(state):
    marker = beam_displays.status_marker(np.array([3.0, 4.0, 1.0]), "map", state, "the reason", 0.87)
    assert (marker.ns, marker.type, marker.header.frame_id) == ("status", Marker.TEXT_VIEW_FACING, "map")
    assert marker.text.startswith(f"{state}, 87 % of the beams explained")
    assert (marker.pose.position.x, marker.scale.z > 0.0, marker.color.a) == (3.0, True, 1.0)
    assert marker.pose.position.y > 4.0
    assert ("the reason" in marker.text) == (state != "LOCALIZED")


def test_without_a_scan_the_status_has_no_share_and_without_a_pose_it_stands_at_the_origin():
    marker = beam_displays.status_marker(None, "map", "UNKNOWN", "no map yet", float("nan"))
    assert marker.text == "UNKNOWN\nno map yet"
    assert marker.pose.position.x == 0.0


def test_a_long_reason_is_broken_at_spaces():
    reason = "no transform odom <- base_link at the scan's stamp: " + "x" * 60 + " and some more words to the end"
    lines = beam_displays.status_marker(None, "map", "LOST", reason, 0.1).text.split("\n")
    assert " ".join(lines[1:]) == reason
    assert all(len(line) <= 48 or line == "x" * 60 for line in lines)
