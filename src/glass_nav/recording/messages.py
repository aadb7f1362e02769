"""Definitions of the messages that bags of ROS 2 may not bring along, for rosbags 0.9.23 and later."""

from __future__ import annotations

from typing import Any

TRUE_BEAMS = "std_msgs/Header header\nuint8[] cases\nfloat32[] exact\nfloat32[] crossing\n"  # msg/*.msg, bare
BEAM_CASES = "std_msgs/Header header\nuint8[] cases\nfloat32[] expected\nfloat32[] residual\nfloat32[] weight\n"


def ros2_store() -> Any:
    """Types of ROS 2 Humble and ours: older sqlite3 bags name types without defining them."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg(TRUE_BEAMS, "glass_nav/msg/TrueBeams"))
    store.register(get_types_from_msg(BEAM_CASES, "glass_nav/msg/BeamCases"))
    return store
