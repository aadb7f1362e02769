"""The legend of rviz as a message; each node that has marks of its own publishes it."""

from __future__ import annotations

from typing import List

import rospy
from sensor_msgs.msg import Image as ImageMsg

from glass_nav.evaluation.plots import legend
from glass_nav.ros import conversions

TOPIC = "legend"  # of all nodes: the picture is the same, and rviz shows it whichever of them runs


def publish(map_frame: str, *topics: str) -> List[rospy.Publisher]:
    """Publish it, latched, on TOPIC and on further topics; the publishers are to be kept."""
    picture = image_msg(map_frame)
    publishers = [rospy.Publisher(topic, ImageMsg, queue_size=1, latch=True) for topic in (TOPIC, *topics)]
    for publisher in publishers:
        publisher.publish(picture)
    return publishers


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
