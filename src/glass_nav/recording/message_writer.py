"""Writes messages of a planar robot to a ROS 1 bag, through rosbags: common to all bag writers.

Needs no ROS; works with rosbags 0.9.23 and later.
"""

from __future__ import annotations

import os
from pathlib import Path
from types import TracebackType
from typing import Any, Dict, Optional, Tuple, Type, TypeVar

import numpy as np

from glass_nav.recording.recording import RecordingError

TF_TYPE = "tf2_msgs/msg/TFMessage"
TF_MESSAGE = "geometry_msgs/TransformStamped[] transforms\n"
Self = TypeVar("Self", bound="MessageWriter")


class MessageWriter:
    """`with Writer(path) as bag:` write in order of time; the file appears when it is complete.

    It is written under a temporary name beside it, and an error leaves nothing behind. An older file is replaced.
    """

    KINDS: Dict[str, str] = {}  # topic -> message type
    LATCHED: Tuple[str, ...] = ()  # a player sends their last message to late subscribers, too
    OWN_TYPES: Dict[str, str] = {}  # definitions of the types that Noetic's message packages do not have

    def __init__(self, path: Path) -> None:
        self._path = path
        self._growing = path.with_name(f".{path.name}.{os.getpid()}.part")
        self._connections: Dict[str, Any] = {}
        self._writer: Any = None

    def __enter__(self: Self) -> Self:
        try:
            from rosbags.rosbag1 import Writer
            from rosbags.typesys import Stores, get_types_from_msg, get_typestore
        except ImportError as err:
            raise RecordingError(
                f"{self._path}: writing bags needs the Python package rosbags (pip install rosbags): {err}"
            ) from err
        self._store = get_typestore(Stores.ROS1_NOETIC)
        for name, definition in {TF_TYPE: TF_MESSAGE, **self.OWN_TYPES}.items():
            self._store.register(get_types_from_msg(definition, name))
        if self._path.is_dir():
            raise RecordingError(f"{self._path}: is a folder, a bag is a file")
        try:
            self._growing.unlink()
        except FileNotFoundError:
            pass
        self._writer = Writer(self._growing)
        try:
            self._writer.open()
        except OSError as err:
            raise RecordingError(f"{self._path}: cannot be written: {err.strerror}") from err
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        try:
            self._writer.close()
            if kind is None:
                os.replace(self._growing, self._path)
        finally:
            if self._growing.exists():
                self._growing.unlink()

    def _send(self, topic: str, stamp_ns: int, **fields: Any) -> None:
        kind = self.KINDS[topic]
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(
                topic, kind, typestore=self._store, latching=1 if topic in self.LATCHED else None
            )
        message = self._store.types[kind](**fields)
        self._writer.write(self._connections[topic], stamp_ns, self._store.serialize_ros1(message, kind))

    def _new(self, kind: str, **fields: Any) -> Any:
        return self._store.types[kind.replace("/", "/msg/")](**fields)

    def _time(self, stamp_ns: int) -> Any:
        return self._new("builtin_interfaces/Time", sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)

    def _header(self, stamp_ns: int, frame: str) -> Any:
        return self._new("std_msgs/Header", seq=0, stamp=self._time(stamp_ns), frame_id=frame)

    def _vector(self, kind: str, x: float, y: float) -> Any:
        return self._new(f"geometry_msgs/{kind}", x=float(x), y=float(y), z=0.0)

    def _rotation(self, yaw_rad: float) -> Any:
        return self._new(
            "geometry_msgs/Quaternion", x=0.0, y=0.0, z=float(np.sin(0.5 * yaw_rad)), w=float(np.cos(0.5 * yaw_rad))
        )

    def _pose(self, planar: np.ndarray) -> Any:
        return self._new(
            "geometry_msgs/Pose",
            position=self._vector("Point", planar[0], planar[1]),
            orientation=self._rotation(float(planar[2])),
        )

    def _transform(self, stamp_ns: int, parent: str, child: str, parent_from_child: np.ndarray) -> Any:
        x, y, yaw = (float(value) for value in parent_from_child)
        transform = self._new(
            "geometry_msgs/Transform", translation=self._vector("Vector3", x, y), rotation=self._rotation(yaw)
        )
        return self._new(
            "geometry_msgs/TransformStamped",
            header=self._header(stamp_ns, parent),
            child_frame_id=child,
            transform=transform,
        )
