"""Debian 11 pairs Python 3.9 with a rospy that asks threads by a name that Python 3.9 took away."""

from __future__ import annotations

import threading

import glass_nav.ros  # noqa: F401  every node imports it first


def test_a_thread_may_be_asked_by_its_old_name_too() -> None:
    ending = threading.Event()
    thread = threading.Thread(target=ending.wait)
    thread.start()
    assert thread.isAlive()  # type: ignore[attr-defined]
    ending.set()
    thread.join()
    assert not thread.isAlive()  # type: ignore[attr-defined]
