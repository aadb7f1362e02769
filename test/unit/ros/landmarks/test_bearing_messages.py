"""LandmarkBearings as messages, and what is shown of them."""

from __future__ import annotations

import numpy as np
import pytest
from visualization_msgs.msg import Marker

from glass_nav.localization.bearings import triangulation
from glass_nav.ros import conversions
from glass_nav.ros.conversions import Mounting
from glass_nav.ros.landmarks import bearing_messages, landmark_display
from glass_nav.sensing import bearings
from glass_nav.sensing.bearings import LandmarkBearing
from glass_nav.world.landmark_map import LandmarkMap

UPRIGHT, OVERHEAD = Mounting(np.zeros(3), 0.9, False), Mounting(np.zeros(3), 0.9, True)
TAKEN = [LandmarkBearing(3_000_000_000, "B", 0.5, 0.01), LandmarkBearing(2_500_000_000, "A", -1.0, 0.02)]


def message():
    return bearing_messages.msg_from_bearings(3_200_000_000, TAKEN, "emitter")


def test_what_is_sent_is_received_in_order_of_time():
    msg = message()
    assert msg.header.frame_id == "emitter" and conversions.ns_from_stamp(msg.header.stamp) == 3_200_000_000
    assert bearing_messages.bearings_from_msg(msg, UPRIGHT) == TAKEN[::-1]


def test_a_sensor_that_hangs_upside_down_turns_the_other_way():
    angles = [bearing.angle_rad for bearing in bearing_messages.bearings_from_msg(message(), OVERHEAD)]
    assert angles == [1.0, -0.5]


@pytest.mark.parametrize(
    "change, text",
    [
        (lambda msg: msg.angles.pop(), "ids, stamps, angles and sigmas must be as many, got 2, 2, 1 and 2"),
        (lambda msg: setattr(msg, "ids", ["A", "A"]), "each landmark may come once, got A, A"),
        (lambda msg: setattr(msg, "sigmas", [0.0, 0.1]), "bearing of 'B': sigma must be > 0 rad, got 0.0"),
        (lambda msg: setattr(msg, "angles", [float("nan"), 0.1]), "bearing of 'B': angle must be finite, got nan rad"),
        (
            lambda msg: msg.stamps.__setitem__(0, conversions.stamp_from_ns(3_300_000_000)),
            "bearing of 'B': its stamp must be > 0 and not after that of the message, 3.200 s, got 3.300 s",
        ),
        (
            lambda msg: msg.stamps.__setitem__(1, conversions.stamp_from_ns(0)),
            "bearing of 'A': its stamp must be > 0 and not after that of the message, 3.200 s, got 0.000 s",
        ),
    ],
)
def test_messages_that_make_no_sense_are_refused(change, text):
    msg = message()
    change(msg)
    with pytest.raises(ValueError) as caught:
        bearing_messages.bearings_from_msg(msg, UPRIGHT)
    assert str(caught.value) == text


def test_landmarks_are_shown_with_their_ids_and_lines_from_where_they_were_seen():
    landmarks = LandmarkMap(
        ("A", "B", "C"),
        np.array([[4.0, 0.0], [0.0, 3.0], [-5.0, 0.0]]),
        np.array([np.pi, np.nan, 0.0]),
        np.full(3, 2.0),
        np.full(3, 15.0),
    )
    taken = bearings.standing(landmarks.ids, np.radians([0.0, 90.0, 180.0]), 0.01)
    fix = triangulation.triangulate(taken, landmarks)
    markers = landmark_display.fix_markers(fix, taken, landmarks, "map").markers
    tags = [marker for marker in markers if marker.ns == "landmarks"]
    assert [marker.type for marker in tags] == [Marker.ARROW, Marker.SPHERE, Marker.ARROW]
    assert [marker.text for marker in markers if marker.ns == "landmark_ids"] == ["A", "B", "C"]
    (lines,) = [marker for marker in markers if marker.ns == "landmark_bearings"]
    ends = np.array([[point.x, point.y] for point in lines.points])
    np.testing.assert_allclose(ends[1::2], landmarks.positions_m)
    np.testing.assert_allclose(ends[::2], np.zeros((3, 2)), atol=1e-9)
    assert len(lines.colors) == 6 and len({(marker.ns, marker.id) for marker in markers}) == len(markers)
