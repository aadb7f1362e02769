"""Hints which programs to start, for users who launched the localization alone."""

from __future__ import annotations

from typing import Optional


def what_to_start(no_map: bool, no_scan_on: str, no_odometry: str) -> Optional[str]:
    """A line that names what is missing and how to start it; None if nothing is missing.

    Args:
        no_map: there is no map, and no service offers one.
        no_scan_on: topics without a publisher of scans; "" if there is one.
        no_odometry: the transform of the odometry that tf does not have, such as "odom <- base_link"; "" if it does.
    """
    missing = []
    if no_map:
        missing.append("a map (roslaunch glass_nav map.launch map:=FILE.yaml, or map_server)")
    if no_scan_on:
        missing.append(f"scans on {no_scan_on} (the driver of the lidar; scan_topic:=TOPIC if they have another name)")
    if no_odometry:
        missing.append(
            f"odometry, tf {no_odometry} (the driver of the base; odom_frame_id:= and base_frame_id:= for other frames)"
        )
    return "still to be started: " + "; ".join(missing) if missing else None
