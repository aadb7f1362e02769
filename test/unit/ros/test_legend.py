"""The legend as a subscriber gets it."""

from __future__ import annotations

from io import BytesIO

import numpy as np
from sensor_msgs.msg import Image

from glass_nav.evaluation.plots.legend import draw
from glass_nav.ros import legend


def test_the_message_is_an_image_of_its_size():
    raw = BytesIO()
    legend.image_msg("map").serialize(raw)
    msg = Image().deserialize(raw.getvalue())
    assert (msg.encoding, msg.header.frame_id, msg.step) == ("rgb8", "map", 3 * msg.width)
    assert len(msg.data) == msg.step * msg.height
    pixels = np.frombuffer(msg.data, np.uint8).reshape(msg.height, msg.width, 3)
    assert np.array_equal(pixels, draw())
