"""The bag that a replay writes, read back message by message."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
import pytest

from glass_nav.cli import main as cli
from glass_nav.evaluation.plots import legend
from glass_nav.localization.beam_classification import beam_cloud
from glass_nav.localization.place_shapes import PLACES_NAMESPACE
from glass_nav.localization.status_text import STATUS_NAMESPACE
from glass_nav.vocabulary import BeamCase

STARTS_AT = 10**12
NODE = "/glass_localization"


@pytest.fixture
def messages(room_map, room_bag, tmp_path):
    """topic -> messages of the bag of a replay; checks that none lies before the one ahead of it."""
    from rosbags.highlevel import AnyReader

    def written(*options):
        code = cli.main(
            [
                "replay",
                str(room_bag().write()),
                "--map",
                str(room_map),
                "--out",
                str(tmp_path / "out"),
                "--no-picture",
                "--bag",
                str(tmp_path / "bags" / "out.bag"),
                *options,
            ]
        )
        assert code == 0
        found = defaultdict(list)
        with AnyReader([tmp_path / "bags" / "out.bag"]) as reader:
            for connection, _, raw in reader.messages():
                found[connection.topic].append(reader.deserialize(raw, connection.msgtype))
        return found

    return written


def stamps(found):
    return [message.header.stamp.sec * 10**9 + message.header.stamp.nanosec for message in found]


def test_every_scan_has_its_pose_cases_cloud_status_and_transforms(messages, room_bag, tmp_path):
    found = messages()
    scans_ns = room_bag().stamps_ns.tolist()
    for topic in (
        "/scan",
        "/scan_surfaces",
        "/ground_truth",
        NODE + "/status",
        NODE + "/beam_cases",
        NODE + "/beam_cloud",
    ):
        assert stamps(found[topic]) == scans_ns, topic
    assert set(stamps(found["/amcl_pose"])) <= set(scans_ns)
    assert len(found["/map"]) == len(found["/tf_static"]) == 1
    assert {status.state_name for status in found[NODE + "/status"]} == {"LOCALIZED"}
    way = np.loadtxt(tmp_path / "out" / "trajectory.tum")
    for message, row in zip(found["/tf"], way):
        there = []
        for stamped in message.transforms:
            rotation, offset = stamped.transform.rotation, stamped.transform.translation
            there.append([offset.x, offset.y, 2.0 * np.arctan2(rotation.z, rotation.w)])
        (x, y, yaw), (dx, dy, turn) = there
        base = [x + np.cos(yaw) * dx - np.sin(yaw) * dy, y + np.sin(yaw) * dx + np.cos(yaw) * dy]
        np.testing.assert_allclose(base, row[1:3], atol=1e-6)
        assert np.cos(yaw + turn) == pytest.approx(row[7] ** 2 - row[6] ** 2, abs=1e-6)


def test_the_cloud_has_the_ranges_that_the_lidar_measured(messages):
    found = messages()
    for cloud, scan, cases in zip(found[NODE + "/beam_cloud"], found["/scan"], found[NODE + "/beam_cases"]):
        assert [field.name for field in cloud.fields] == list(beam_cloud.FIELDS)
        points = cloud.data.view("<f4").reshape(cloud.width, -1)
        np.testing.assert_array_equal(points[:, 5], scan.ranges[np.isfinite(scan.ranges)])
        np.testing.assert_array_equal(points[:, 4], cases.cases)


@pytest.mark.long_run
def test_the_glass_map_of_the_end_is_the_one_that_was_saved(messages, tmp_path):
    found = messages()
    (glass,) = found[NODE + "/glass_map"]
    assert (glass.info.width, glass.info.height) == (122, 82)
    assert glass.info.resolution == pytest.approx(0.05)
    assert glass.data.max() >= 0


def test_a_bag_that_cannot_be_written_is_refused_and_a_run_that_fails_leaves_none(room_map, room_bag, tmp_path, capsys):
    path = room_bag().write()
    (tmp_path / "folder.bag").mkdir()
    arguments = ["replay", str(path), "--map", str(room_map), "--out", str(tmp_path / "out"), "--bag"]
    assert cli.main([*arguments, str(tmp_path / "folder.bag")]) == 3
    assert capsys.readouterr().err.splitlines()[-1] == (
        f"glass_nav replay: {tmp_path / 'folder.bag'}: is a folder, a bag is a file"
    )
    assert cli.main([*arguments, str(tmp_path / "no.bag"), "--start", "1000"]) == 3
    assert not list(tmp_path.glob("*no.bag*"))


def test_markers_and_legend_are_in_it_as_the_node_sends_them(messages):
    found = messages()
    markers = {marker.ns: marker for marker in found[NODE + "/beam_markers"][-1].markers}
    assert {*(case.label for case in BeamCase), PLACES_NAMESPACE, STATUS_NAMESPACE} == set(markers)
    first = markers[BeamCase.DIFFUSE.label]
    assert first.header.frame_id == "base_link" and markers[STATUS_NAMESPACE].header.frame_id == "map"
    assert markers[STATUS_NAMESPACE].text.startswith("LOCALIZED")
    assert [first.color.r, first.color.g, first.color.b] == pytest.approx([v / 255 for v in BeamCase.DIFFUSE.rgb])
    squares = [each for each in found[NODE + "/beam_markers"][-1].markers if each.type == 8 and each.action == 0]
    assert squares and all(len(each.points) for each in squares)
    assert {marker.ns for marker in found[NODE + "/wall_markers"][-1].markers} >= {"solid", "undecided", "glass"}
    (picture,) = found["/legend"]
    pixels = picture.data.reshape(picture.height, picture.width, 3)
    assert (picture.encoding, picture.step) == ("rgb8", 3 * picture.width)
    np.testing.assert_array_equal(pixels, legend.draw())
