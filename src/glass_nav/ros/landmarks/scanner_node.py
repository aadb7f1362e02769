"""scanner_node: searches for tags with a rotating emitter on a serial port, and publishes landmark_bearings.

Wiring only; sensing/emitter_search.py is the procedure, sensing/serial_emitter.py the device. The emitter searches
its span again and again, in alternating directions.

Publishes: landmark_bearings (LandmarkBearings, at the end of each search, with the tags that were found), frame ~frame_id.
Parameters: ScannerNodeParams, read once; explained in config/scanner.yaml.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, field

import rospy

from glass_nav import params
from glass_nav.msg import LandmarkBearings
from glass_nav.params import number
from glass_nav.ros import command_line, conversions, shutdown
from glass_nav.ros.landmarks import bearing_messages
from glass_nav.sensing.emitter_search import EmitterSearch, EmitterSearchParams
from glass_nav.sensing.serial_emitter import EmitterError, SerialEmitter


@dataclass(frozen=True)
class PortParams:
    """The serial port of the device."""

    port: str = "/dev/ttyUSB0"
    baud: int = 9600
    move_timeout_s: float = number(10.0, 0.01, 1000.0)
    frame_id: str = "emitter"

    def __post_init__(self) -> None:
        if not self.frame_id:
            raise ValueError("~frame_id must name a frame, got ''")


@dataclass(frozen=True)
class ScannerNodeParams:
    """All parameters of the node."""

    port: PortParams = field(default_factory=PortParams)
    search: EmitterSearchParams = field(default_factory=EmitterSearchParams)


class ScannerNode:
    """Wiring only: one search after the other, a message for each."""

    def __init__(self, p: ScannerNodeParams) -> None:
        """
        Raises:
            EmitterError: the port cannot be used.
            ValueError: an invalid parameter.
        """
        self._p = p
        self._emitter = SerialEmitter(p.port.port, p.port.baud, p.port.move_timeout_s)
        self._bearings = rospy.Publisher("landmark_bearings", LandmarkBearings, queue_size=10)

    def run(self, ending: threading.Event) -> None:
        """Searches until ROS shuts down or ending is set. EmitterError if the device fails."""
        way = 1
        with self._emitter as emitter:
            while not (rospy.is_shutdown() or ending.is_set()):
                found = EmitterSearch(self._p.search, way).run(emitter, _now_ns, lambda: not ending.is_set())
                self._bearings.publish(bearing_messages.msg_from_bearings(_now_ns(), found, self._p.port.frame_id))
                way = -way


def _now_ns() -> int:
    return conversions.ns_from_stamp(rospy.Time.now())


def main() -> None:
    """Start the node; exit code 2 if a parameter cannot be used, 3 if the device cannot."""
    if command_line.answers_help(__doc__):
        return
    shutdown.run_node(
        "scanner",
        lambda given: ScannerNode(params.load(ScannerNodeParams, given, rospy.get_name())),
        (EmitterError,),
    )
