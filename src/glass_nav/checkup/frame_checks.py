"""Checks the tree of frames: exactly one path from odom over the base to the lidar, at every scan."""

from __future__ import annotations

import math
from typing import Dict, Iterator, List, Sequence, Set, Tuple

import numpy as np

from glass_nav.checkup import sender_checks
from glass_nav.checkup.finding import Finding
from glass_nav.recording import frames
from glass_nav.recording.observed import HeardScan, HeardTransform

_UNIT_TOLERANCE = 0.01  # tf2 refuses quaternions that are longer or shorter by more
_TILT = math.cos(math.radians(3.0))  # a plane tilted further meets floor or ceiling, or shortens what it sees
_SAME_M, _SAME_TURN = 1e-3, 1e-3
_GAP_S, _GAP_M, _GAP_RAD = 0.5, 0.2, 0.1  # of odometry during which the robot moved
_IN_GAPS, _LONG_GAP_S = 0.01, 10.0  # share of the scans that may fall into such gaps, if none is that long
_JUMP_M, _JUMP_M_S = 0.5, 8.0
_FASTEST_M_S, _FASTEST_RAD_S = 10.0, 15.0  # in the mean over the log
_UNCOVERED = 0.02  # share of the scans that may have no odometry: before it started, after it ended


def check_links(transforms: Sequence[HeardTransform]) -> Iterator[Finding]:
    """Findings on links that are wrong for any user."""
    slashed = sorted({name for each in transforms for name in (each.parent, each.child) if name.startswith("/")})
    if slashed:
        yield Finding(
            "frame-slash",
            f"tf names frames with a slash in front: {', '.join(slashed)}",
            "write them without: tf2 refuses such names in a lookup",
        )
    bad = [each for each in transforms if not _is_valid(each)]
    if bad:
        yield Finding(
            "tf-invalid",
            f"{len(bad)} transforms {bad[0].parent} -> {bad[0].child} are not finite or have a quaternion "
            f"that is none, such as {_figures(bad[0].rotation_xyzw)}",
            "normalise the quaternion where it is made; tf2 drops such transforms",
        )
    yield from _parents(transforms)
    contradictions = [*_contradictions(transforms)]
    yield from contradictions
    yield from () if contradictions else sender_checks.check(transforms)


def _is_valid(each: HeardTransform) -> bool:
    values = (*each.translation_m, *each.rotation_xyzw)
    return (
        all(map(math.isfinite, values))
        and abs(math.sqrt(sum(value * value for value in each.rotation_xyzw)) - 1.0) < _UNIT_TOLERANCE
    )


def _figures(values: Sequence[float]) -> str:
    return " ".join(f"{value:g}" for value in values)


def _parents(transforms: Sequence[HeardTransform]) -> Iterator[Finding]:
    parents: Dict[str, Set[str]] = {}
    for each in transforms:
        parents.setdefault(each.child.lstrip("/"), set()).add(each.parent.lstrip("/"))
    for child, names in sorted(parents.items()):
        if len(names) > 1:
            yield Finding(
                "frame-two-parents",
                f"frame {child} hangs on {' and on '.join(sorted(names))}",
                "a frame has one parent: find who sends the other (rosrun tf view_frames) and stop it",
            )


def _contradictions(transforms: Sequence[HeardTransform]) -> Iterator[Finding]:
    """Report links with two different values at one stamp: two nodes send them."""
    by_stamp: Dict[Tuple[str, str, int], HeardTransform] = {}
    odd: Dict[Tuple[str, str], List[HeardTransform]] = {}
    for each in transforms:
        other = by_stamp.setdefault((each.parent, each.child, each.stamp_ns if not each.static else -1), each)
        if math.dist(each.translation_m, other.translation_m) > _SAME_M or not _same_turn(each, other):
            odd.setdefault((each.parent, each.child), []).append(each)
    for (parent, child), found in odd.items():
        yield Finding(
            "tf-contradiction",
            f"{parent} -> {child} has two values at one time, {len(found)} times",
            "two nodes send this transform (rosrun tf tf_monitor lists them): stop one, such as publish_tf "
            "of the wheels where an EKF sends it",
        )


def _same_turn(one: HeardTransform, other: HeardTransform) -> bool:
    dot = sum(a * b for a, b in zip(one.rotation_xyzw, other.rotation_xyzw))
    return not abs(dot) < 1.0 - _SAME_TURN  # NaN is another finding


def check_mounting(lidar: str, base: str, base_from_laser: frames.Transform) -> Iterator[Finding]:
    """How the lidar sits on the robot, by tf."""
    up = frames.upwardness(base_from_laser)
    if abs(up) < _TILT:
        yield Finding(
            "lidar-tilted",
            f"by tf {base} -> {lidar} the lidar is tilted by {math.degrees(math.acos(min(abs(up), 1.0))):.0f} deg",
            "mount it level, or correct its roll and pitch in the URDF: beyond 20 deg scans are rejected",
        )


def check_coverage(
    scans: Sequence[HeardScan], stamps_ns: np.ndarray, odom_from_base: np.ndarray, link: str
) -> Iterator[Finding]:
    """Odometry at the time of the scans.

    Args:
        scans: of one lidar.
        stamps_ns: (N,) of odometry, ascending.
        odom_from_base: (N, 3) its poses.
        link: names of its frames, for the text.
    """
    slack = frames.EXTRAPOLATION_NS
    scan_ns = np.array([scan.stamp_ns for scan in scans if scan.stamp_ns], np.int64)
    if len(stamps_ns) < 2 or not len(scan_ns):
        return
    outside = (scan_ns < stamps_ns[0] - slack) | (scan_ns > stamps_ns[-1] + slack)
    if outside.mean() > _UNCOVERED and outside.sum() > 3:
        off_s = float(np.median(scan_ns) - np.median(stamps_ns)) * 1e-9
        yield Finding(
            "odometry-missing",
            f"{outside.sum()} of {len(scan_ns)} scans have no {link} at their stamps; by their middles the "
            f"scans are {abs(off_s):.1f} s {'after' if off_s > 0 else 'before'} it",
            "record tf as long as scans; if both are there, their clocks differ (chrony, use_sim_time)",
        )
    apart_s = np.diff(stamps_ns) * 1e-9
    way_m = np.hypot(*np.diff(odom_from_base[:, :2], axis=0).T)
    turn = np.abs((np.diff(odom_from_base[:, 2]) + np.pi) % (2.0 * np.pi) - np.pi)
    usual_s = max(float(np.median(apart_s)), 0.6 * float(np.median(np.diff(np.sort(scan_ns)))) * 1e-9)
    gap = (apart_s > max(_GAP_S, 5.0 * usual_s)) & ((way_m > _GAP_M) | (turn > _GAP_RAD))
    inside = np.searchsorted(stamps_ns, scan_ns) - 1
    hit = gap[np.clip(inside, 0, len(gap) - 1)] & ~outside
    if hit.mean() > _IN_GAPS or (hit.any() and apart_s[gap].max() > _LONG_GAP_S):
        yield Finding(
            "tf-gaps",
            f"{link} is silent for up to {apart_s[gap].max():.1f} s while the robot moves; {hit.sum()} "
            "scans fall into the gaps",
            "look at the rate of the node that sends it (rosrun tf tf_monitor) and at the load of the "
            "computer: a live node drops these scans",
        )
    span_s = float(stamps_ns[-1] - stamps_ns[0]) * 1e-9
    if way_m.sum() > _FASTEST_M_S * max(span_s, 1.0) or turn.sum() > _FASTEST_RAD_S * max(span_s, 1.0):
        yield Finding(
            "odometry-speed",
            f"{link} drives {way_m.sum():.1f} m and turns {turn.sum():.1f} rad in {span_s:.1f} s: faster than any robot",
            "look for a second node that sends it (rosrun tf tf_monitor), and at the units of the base's driver",
        )
    jump = (way_m > _JUMP_M) & (way_m > _JUMP_M_S * np.maximum(apart_s, 1e-3))
    if jump.any():
        yield Finding(
            "odometry-jumps",
            f"{link} jumps by up to {way_m[jump].max():.1f} m from one message to the next, {jump.sum()} times",
            "odometry must be smooth: reset it only while nothing runs, and keep GPS or a localizer out of "
            "the odom frame",
        )
