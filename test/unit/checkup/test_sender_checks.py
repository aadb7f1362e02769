"""Two nodes that send one transform: named where their names are known, seen in the values where not."""

from __future__ import annotations

import math

import pytest

from glass_nav.checkup import sender_checks
from glass_nav.recording.observed import HeardTransform

MS = 1_000_000


def heard(stamp_ms, x=0.0, yaw=0.0, sender="", static=False, parent="odom", child="base_link"):
    turn = (0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
    return HeardTransform(stamp_ms * MS, stamp_ms * MS, parent, child, (x, 0.0, 0.0), turn, static, sender)


def driving(period_ms, offset_m=0.0, turned_rad=0.0, first_ms=0, until_ms=6000, **fields):
    """0.5 m/s ahead."""
    return [
        heard(at, 0.0005 * at + offset_m, turned_rad, **fields)
        for at in range(first_ms, until_ms + first_ms, period_ms)
    ]


def found(*senders):
    return [each.what for each in sender_checks.check(sorted(sum(senders, []), key=lambda each: each.heard_ns))]


@pytest.mark.parametrize(
    "ekf_ms, wheels_ms, offset_m, turned_rad",
    [
        pytest.param(20, 20, 0.3, 0.0, id="as often"),
        pytest.param(20, 50, 0.3, 0.0, id="more often"),
        pytest.param(100, 20, 0.3, 0.0, id="less often"),
        pytest.param(20, 20, 0.0, 0.2, id="another heading"),
        pytest.param(20, 33, 0.01, 0.0, id="1 cm"),
    ],
)
def test_two_nodes_beside_each_other_are_named(ekf_ms, wheels_ms, offset_m, turned_rad):
    ekf = driving(ekf_ms, offset_m, turned_rad, sender="/ekf")
    wheels = driving(wheels_ms, first_ms=7, sender="/base_driver")
    assert found(ekf, wheels) == ["odom -> base_link comes from /base_driver and /ekf: two nodes send this transform"]


@pytest.mark.parametrize("offset_m, turned_rad", [(0.3, 0.0), (0.0, 0.2), (2.0, -3.0)])
@pytest.mark.parametrize("wheels_ms", [20, 50, 100])
def test_without_names_the_values_show_it(offset_m, turned_rad, wheels_ms):
    both = found(driving(20, offset_m, turned_rad), driving(wheels_ms, first_ms=7))
    assert both == [
        "odom -> base_link jumps there and back between two interleaved values: two nodes send this transform"
    ]
    player = found(driving(20, offset_m, turned_rad, sender="/play"), driving(wheels_ms, first_ms=7, sender="/play"))
    assert player == both


def test_a_static_transform_beside_a_moving_one_is_found():
    names = dict(parent="map", child="odom")
    static = [heard(0, static=True, sender="/static_map_odom", **names)]
    moving = driving(100, first_ms=40, sender="/amcl", **names)
    assert found(static, moving) == ["map -> odom comes from /amcl and /static_map_odom: two nodes send this transform"]
    nameless = [heard(0, static=True, **names)], driving(100, first_ms=40, **names)
    assert found(*nameless) == ["map -> odom comes on /tf_static and on /tf: two nodes send this transform"]


@pytest.mark.parametrize(
    "senders",
    [
        pytest.param([driving(20)], id="one"),
        pytest.param(
            [driving(20, sender="/a"), driving(20, 3.0, first_ms=6100, sender="/b")], id="one after the other"
        ),
        pytest.param([driving(20, sender="/a"), driving(20, sender="/relay")], id="the same values"),
        pytest.param([[heard(0, 1.0, static=True, sender=name)] for name in ("/a", "/b")], id="the same fixed value"),
        pytest.param([[heard(0, 1.0, static=True)], [heard(at, 1.0) for at in range(50)]], id="fixed on both topics"),
        pytest.param([driving(20, sender="/a"), driving(20, child="laser", sender="/b")], id="of two links"),
        pytest.param([[*driving(20), *driving(20, 6.0, first_ms=6000)]], id="a jump"),
    ],
)
def test_nothing_is_found_where_nothing_contradicts(senders):
    assert found(*senders) == []
