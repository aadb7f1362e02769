"""What localization.launch says when nothing else runs."""

from __future__ import annotations

from glass_nav.localization.start_hints import what_to_start


def test_each_thing_that_is_missing_is_named_with_what_gives_it():
    line = what_to_start(True, "/scan", "odom <- base_link")
    assert line.startswith("still to be started: a map (roslaunch glass_nav map.launch map:=FILE.yaml, or map_server)")
    assert "scans on /scan (the driver of the lidar" in line
    assert "odometry, tf odom <- base_link (the driver of the base" in line


def test_missing_odometry_alone_is_named_too():
    assert what_to_start(False, "", "odom <- base") == (
        "still to be started: odometry, tf odom <- base (the driver of the base; odom_frame_id:= and base_frame_id:= "
        "for other frames)"
    )


def test_nothing_is_said_when_all_is_there():
    assert what_to_start(False, "", "") is None
