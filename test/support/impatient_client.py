#!/usr/bin/env python3
"""Asks tf for map -> base at the time that it is, and does not wait: as move_base and its costmaps do.

Started as a program, it asks until it is interrupted, then prints how often, and how often in vain.
"""

from __future__ import annotations

import threading
import time

import rospy
import tf2_ros

PERIOD_S = 0.2


class ImpatientClient:
    """Asks from a thread of its own, by the wall clock."""

    def __init__(self, tf: tf2_ros.Buffer, target: str = "map", source: str = "odom") -> None:
        self.asked = self.unanswered = 0
        self._tf, self._target, self._source = tf, target, source
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._ask, daemon=True)
        self._thread.start()

    def end(self) -> None:
        self._ending.set()
        self._thread.join()

    def _ask(self) -> None:
        while not self._ending.wait(PERIOD_S):
            answered = self._tf.can_transform(self._target, self._source, rospy.Time.now())
            if self.asked or answered:  # from the first answer on
                self.asked += 1
                self.unanswered += not answered


def main() -> None:
    rospy.init_node("impatient_client", anonymous=True)
    tf = tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(tf, tcp_nodelay=True)
    client = ImpatientClient(tf)
    while not rospy.is_shutdown():  # not rospy.spin(): /clock may stand still
        time.sleep(0.1)
    client.end()
    listener.unregister()
    print(client.asked, client.unanswered)


if __name__ == "__main__":
    main()
