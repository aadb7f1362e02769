"""Definitions of our messages, and of those that bags of ROS 2 may lack; for rosbags 0.9.23 and later."""

from __future__ import annotations

import functools
from typing import Any, Dict, Optional

from glass_nav.recording.message_writer import TF_MESSAGE, TF_TYPE

TRUE_BEAMS = "Header header\nuint8[] cases\nfloat32[] exact\nfloat32[] crossing\n"  # msg/*.msg, bare
BEAM_CASES = "Header header\nuint8[] cases\nfloat32[] expected\nfloat32[] residual\nfloat32[] weight\n"
STATUS = (
    "uint8 UNKNOWN=0\nuint8 GLOBAL_SEARCH=1\nuint8 LOCALIZED=2\nuint8 UNCERTAIN=3\nuint8 LOST=4\n"
    "Header header\nuint8 state\nstring state_name\nstring reason\nfloat32 used_share\nfloat32 reliability\n"
    "float32 level_95_along_m\nfloat32 level_95_across_m\nfloat32 level_95_heading_deg\n"
    "float32 level_999_along_m\nfloat32 level_999_across_m\nfloat32 level_999_heading_deg\n"
)


@functools.lru_cache(maxsize=1)
def noetic_store() -> Any:
    """Types of ROS Noetic and ours: some bags name standard types without defining them."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    for name, definition in (
        (TF_TYPE, TF_MESSAGE),
        ("tf/msg/tfMessage", TF_MESSAGE),
        ("glass_nav/msg/TrueBeams", TRUE_BEAMS),
        ("glass_nav/msg/BeamCases", BEAM_CASES),
    ):
        store.register(get_types_from_msg(definition, name))
    return store


def text_of(connection: Any) -> str:
    """The message definition that a bag brings along for a connection of rosbags; "" if it brings none."""
    return str(getattr(connection.msgdef, "data", connection.msgdef) or "").strip()


def noetic_md5(kind: str) -> Optional[str]:
    """The md5 of a type written by rosbags; None if Noetic does not have the type."""
    store = noetic_store()
    return str(store.generate_msgdef(kind)[1]) if kind in definitions_of(store) else None


def ros2_store() -> Any:
    """Types of ROS 2 Humble and ours: older sqlite3 bags name types without defining them."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg(TRUE_BEAMS, "glass_nav/msg/TrueBeams"))
    store.register(get_types_from_msg(BEAM_CASES, "glass_nav/msg/BeamCases"))
    return store


def definitions_of(store: Any) -> Dict[str, Any]:
    """The message definitions that a typestore knows, by type; older rosbags write the name in capitals."""
    return dict(store.fielddefs if hasattr(store, "fielddefs") else store.FIELDDEFS)
