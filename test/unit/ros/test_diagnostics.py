"""/diagnostics: the names that rqt_robot_monitor sorts by, and what the entries say."""

from __future__ import annotations

import diagnostic_updater
import pytest
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from glass_nav.health import Health, Level
from glass_nav.ros.diagnostics import Diagnostics


class Topic:
    """Stands for the publisher, which needs a ROS master; everything else is the real thing."""

    def __init__(self, *_: object, **__: object) -> None:
        self.sent = []

    def publish(self, msg) -> None:
        self.sent.append(msg)


@pytest.fixture
def topic(monkeypatch):
    rospy = diagnostic_updater._diagnostic_updater.rospy
    topic = Topic()
    monkeypatch.setattr(rospy, "Publisher", lambda *_, **__: topic)
    monkeypatch.setattr(rospy, "get_name", lambda: "/robot/glass_driver")
    monkeypatch.setattr(rospy.Time, "now", staticmethod(lambda: rospy.Time(5)))
    return topic


def test_an_entry_is_published_at_once_under_the_name_of_the_node(topic):
    diagnostics = Diagnostics("driver", "scans")
    diagnostics.publish({"driver": Health(Level.WARN, "waits", {"task": 3}), "scans": Health(Level.OK, "10 used")})
    assert topic.sent[-1].header.stamp.secs == 5
    driver, scans = topic.sent[-1].status
    assert (driver.name, driver.level, driver.message, driver.hardware_id, driver.values) == (
        "robot/glass_driver: driver",
        DiagnosticStatus.WARN,
        "waits",
        "none",
        [KeyValue("task", "3")],
    )
    assert (scans.name, scans.level) == ("robot/glass_driver: scans", DiagnosticStatus.OK)


def test_every_level_has_the_number_of_the_message():
    assert {level.name: level.value for level in Level} == {
        name: getattr(DiagnosticStatus, name) for name in ("OK", "WARN", "ERROR")
    }
