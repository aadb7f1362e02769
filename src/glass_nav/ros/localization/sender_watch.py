"""Warns if two nodes send one of the transforms that the localization depends on."""

from __future__ import annotations

from typing import Callable

import rospy
from tf2_msgs.msg import TFMessage

from glass_nav.ros.localization.params import LocalizationNodeParams
from glass_nav.ros.log_throttle import LogThrottle
from glass_nav.sensing.transform_senders import TransformSenders

_WARNING_PERIOD_S = 60.0


class SenderWatch:
    """Listens to /tf and /tf_static; rospy decodes a message once for all subscribers of a node."""

    def __init__(self, p: LocalizationNodeParams, log: LogThrottle) -> None:
        self._log = log
        self._senders = TransformSenders(p.odom_frame_id, p.base_frame_id)
        self._subscribers = [
            rospy.Subscriber(topic, TFMessage, self._hearer(static), queue_size=100, buff_size=2**20, tcp_nodelay=True)
            for topic, static in (("/tf", False), ("/tf_static", True))
        ]

    def _hearer(self, static: bool) -> Callable[[TFMessage], None]:
        def hear(msg: TFMessage) -> None:
            sender = str(msg._connection_header.get("callerid", ""))
            for each in msg.transforms:
                offset, turn = each.transform.translation, each.transform.rotation
                value = (offset.x, offset.y, offset.z, turn.x, turn.y, turn.z, turn.w)
                now_s = rospy.get_time()
                warning = self._senders.hear(each.header.frame_id, each.child_frame_id, value, sender, static, now_s)
                if warning is not None:
                    self._log.warn(warning, _WARNING_PERIOD_S)

        return hear
