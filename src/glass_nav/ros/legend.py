"""The legend for rviz as a message; each node with markers publishes its own."""

from __future__ import annotations

from typing import Any, Callable, List

import rospy
from sensor_msgs.msg import Image as ImageMsg

from glass_nav.evaluation.plots import legend
from glass_nav.ros import conversions

TOPIC = "legend"  # of all nodes: the picture is the same, and rviz shows it whichever of them runs


def publish(map_frame: str, *topics: str) -> List[rospy.Publisher]:
    """Offer it, latched, on TOPIC and on further topics; the publishers are to be kept."""
    return [
        rospy.Publisher(topic, ImageMsg, subscriber_listener=_Drawing(map_frame), queue_size=1, latch=True)
        for topic in (TOPIC, *topics)
    ]


class _Drawing(rospy.SubscribeListener):
    """Draws the legend for the first subscriber: most robots run without rviz, and drawing loads matplotlib."""

    def __init__(self, map_frame: str) -> None:
        self._map_frame, self._is_drawn = map_frame, False

    def peer_subscribe(self, _topic: str, publish: Callable[[ImageMsg], Any], _publish_to_it: Any) -> None:
        if not self._is_drawn:
            self._is_drawn = True
            publish(image_msg(self._map_frame))


def image_msg(map_frame: str) -> ImageMsg:
    """The picture, rgb8."""
    pixels = legend.draw()
    height, width, _ = pixels.shape
    return ImageMsg(
        header=conversions.header(0, map_frame),
        height=height,
        width=width,
        encoding="rgb8",
        is_bigendian=0,
        step=3 * width,
        data=pixels.tobytes(),
    )
