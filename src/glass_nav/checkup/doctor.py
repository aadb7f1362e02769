"""Runs all checks on the recorded messages of a robot and its map: faults, with remedies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, Iterator, List, Optional, Sequence, Tuple

import numpy as np

from glass_nav.checkup import (
    frame_checks,
    glass_checks,
    map_checks,
    motion_checks,
    scan_checks,
    time_checks,
    wheel_checks,
)
from glass_nav.checkup.finding import Finding
from glass_nav.checkup.map_checks import ScansOnMap
from glass_nav.checkup.scan_motion import FARTHEST_M
from glass_nav.geometry import se2
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.recording import frames
from glass_nav.recording.frames import FrameError, FrameTree
from glass_nav.recording.observed import HeardScan, Observed
from glass_nav.sensing.range_limits import RangeLimits
from glass_nav.sensing.scan import Scan, ScanError, scan_from_fields
from glass_nav.world.grid_map import GridMap

BASE_FRAMES = ("base_link", "base_footprint")  # tried in this order
_MAX_SCANS = 3000  # that motion is looked for in
# Ranges mean nothing then.
_SPOILS = {"scan-units", "scan-angles-no-radians", "scan-limits", "scan-blind", "scan-empty"}


@dataclass(frozen=True)
class FrameNames:
    """Frames of the robot; None: detected."""

    odom: str = "odom"
    base: Optional[str] = None


@dataclass(frozen=True)
class Report:
    """The result of an examination: a line for each thing seen, and the findings."""

    seen: List[str]
    findings: List[Finding]

    @property
    def text(self) -> str:
        """The report as text: what was seen, then each finding with its remedy."""
        lines = [f"seen     {line}" for line in self.seen]
        for finding in self.findings:
            lines += ["", f"finding  {finding.name}: {finding.what}", f"  to do  {finding.advice}"]
        count = len(self.findings)
        return "\n".join([*lines, "", f"{count} finding{'' if count == 1 else 's'}" if count else "no fault found"])


def examine(seen: Observed, grid_map: Optional[GridMap] = None, names: FrameNames = FrameNames()) -> Report:
    """Runs all checks.

    Args:
        seen: what the robot says.
        grid_map: where it is said to be; None: no check against a map.
        names: of its frames.
    """
    lines = [scan_checks.describe(topic, scans) for topic, scans in seen.scans.items()]
    findings: List[Finding] = []
    if seen.damage:
        findings.append(Finding("bag-damaged", seen.damage, "`rosbag check` and `rosbag reindex` may save the rest"))
    if not seen.scans:
        holds = ", ".join(seen.topics) or "nothing"
        findings.append(
            Finding(
                "no-scans",
                f"no topic of sensor_msgs/LaserScan; there is {holds}",
                "record the lidar's topic; a PointCloud2 becomes one with pointcloud_to_laserscan",
            )
        )
    findings += frame_checks.check_links(seen.transforms)
    robot = _Robot(seen, names)
    lines.append(robot.describe())
    findings += robot.findings
    if grid_map is not None:
        height, width = grid_map.occupancy.shape
        lines.append(f"map: {width} x {height} cells of {grid_map.resolution_m:g} m")
        of_map = [*map_checks.check_map(grid_map)]
        findings += of_map
        grid_map = None if of_map else grid_map
    for topic, scans in seen.scans.items():
        findings += _check_lidar(topic, scans, robot, grid_map)
    if grid_map is not None and all(finding.name == map_checks.MISMATCH for finding in findings):
        findings = [*_check_glass(grid_map, robot)] or findings  # where glass is missing, scans do not fit for it
    unique = {(each.name, each.what): each for each in findings}
    return Report(lines, list(unique.values()))


class _Robot:
    """Frames and odometry of the robot, as far as they exist."""

    def __init__(self, seen: Observed, names: FrameNames) -> None:
        self.findings: List[Finding] = []
        self.placed: Dict[str, List[Tuple[Scan, np.ndarray]]] = {}  # by lidar: its scans and odom_from_laser
        self.tree = FrameTree()
        stamps: List[Tuple[int, int]] = []
        for each in seen.transforms:
            unit = frames.normalised(each.rotation_xyzw)
            if unit is not None and np.isfinite(each.translation_m).all():
                self.tree.add(each.parent, each.child, each.stamp_ns, (each.translation_m, unit), each.static)
        bases = BASE_FRAMES if names.base is None else (names.base,)
        self.odom = names.odom
        self.base = next((base for base in bases if self.tree.connected(self.odom, base) and base != self.odom), "")
        self.link = f"tf {self.odom} -> {self.base or bases[0]}"
        self.trajectory: Optional[Trajectory] = None
        if self.base:
            moving = self._moving_child()
            stamps = [
                (each.stamp_ns, each.heard_ns)
                for each in seen.transforms
                if each.child.lstrip("/") == moving and not each.static
            ]
            self._follow(stamps)
        else:
            self.base = next((base for base in bases if base in self.tree.frames), bases[0])
            self.findings.append(self._no_odometry(seen))
        self.delays_s = np.array([heard - stamp for stamp, heard in stamps], float) * 1e-9

    def describe(self) -> str:
        if self.trajectory is None or len(self.trajectory) < 2:
            return f"frames: {', '.join(self.tree.frames) or 'none'}"
        span_s = float(self.trajectory.stamps_ns[-1] - self.trajectory.stamps_ns[0]) * 1e-9
        way_m = float(np.hypot(*np.diff(self.trajectory.poses[:, :2], axis=0).T).sum())
        return (
            f"{self.link}: {(len(self.trajectory) - 1) / span_s:.3g} Hz for {span_s:.0f} s, {way_m:.1f} m; frames: "
            f"{', '.join(self.tree.frames)}"
        )

    def _moving_child(self) -> str:
        """The first frame between odom and base that has a parent."""
        return next((child for child in self.tree.way(self.base, self.odom)), self.base)

    def _follow(self, stamps: Sequence[Tuple[int, int]]) -> None:
        stamps_ns = np.unique(np.array([stamp for stamp, _ in stamps], np.int64))
        poses = []
        for stamp_ns in stamps_ns.tolist():
            try:
                poses.append(frames.planar(self.tree.lookup(self.odom, self.base, stamp_ns)))
            except FrameError:
                poses.append((np.nan, np.nan, np.nan))
        known = np.isfinite(np.array(poses, float).reshape(-1, 3)).all(axis=1)
        self.trajectory = Trajectory(stamps_ns[known], np.array(poses, float).reshape(-1, 3)[known])

    def _no_odometry(self, seen: Observed) -> Finding:
        said = f"no transform {self.odom} <- {self.base} in tf; frames: {', '.join(self.tree.frames) or 'none'}"
        if any(seen.odometry.values()):
            return Finding(
                "odometry-not-in-tf",
                f"{said}; {', '.join(seen.odometry)} has odometry",
                "set publish_tf in the base's driver, or name the frames with --odom-frame and "
                "--base-frame: the node needs tf; glass_nav replay takes the topic",
            )
        return Finding(
            "no-odometry",
            said,
            "start the base's driver, record /tf, or name the frames with --odom-frame and --base-frame",
        )


def _check_lidar(
    topic: str, scans: Sequence[HeardScan], robot: _Robot, grid_map: Optional[GridMap]
) -> Iterator[Finding]:
    of_scans = [*scan_checks.check(topic, scans)]
    yield from of_scans
    yield from time_checks.check_scans(topic, scans)
    yield from time_checks.check_clocks(
        np.array([scan.heard_ns - scan.stamp_ns for scan in scans if scan.stamp_ns], float) * 1e-9, robot.delays_s
    )
    if any(not scan.frame for scan in scans):
        yield Finding("scan-without-frame", f"{topic}: scans without frame_id", "set frame_id in the driver")
    if robot.trajectory is not None:
        yield from frame_checks.check_coverage(scans, robot.trajectory.stamps_ns, robot.trajectory.poses, robot.link)
    for lidar in sorted({scan.frame.lstrip("/") for scan in scans if scan.frame}):
        own = [scan for scan in scans if scan.frame.lstrip("/") == lidar]
        if lidar != robot.base and not robot.tree.connected(robot.base, lidar):
            yield Finding(
                "lidar-not-in-tf",
                f"no transform {robot.base} <- {lidar}, the frame of {topic}; frames: "
                f"{', '.join(robot.tree.frames) or 'none'}",
                "add the lidar to the URDF, run static_transform_publisher, or correct frame_id in the driver",
            )
        elif not _SPOILS.intersection(finding.name for finding in of_scans):
            yield from _check_motion_and_map(lidar, own, robot, grid_map)


def _check_motion_and_map(
    lidar: str, scans: Sequence[HeardScan], robot: _Robot, grid_map: Optional[GridMap]
) -> Iterator[Finding]:
    mounted, limits = False, RangeLimits()
    placed: List[Tuple[Scan, np.ndarray]] = []
    for heard in scans[:: max(1, -(-len(scans) // _MAX_SCANS))]:
        try:
            transform = robot.tree.lookup(robot.base, lidar, heard.stamp_ns)
            if not mounted:
                mounted = True
                yield from frame_checks.check_mounting(lidar, robot.base, transform)
            scan = scan_from_fields(
                heard.stamp_ns,
                heard.ranges_m,
                heard.angle_min_rad,
                heard.angle_increment_rad,
                heard.range_min_m,
                limits.range_max_m(lidar, heard.range_max_m, heard.range_min_m, heard.ranges_m),
                np.array(frames.planar(transform)),
                frames.upwardness(transform) < 0.0,
            )
        except (FrameError, ScanError):
            continue
        at = robot.trajectory
        if at is not None and len(at) and bool(at.covers(heard.stamp_ns, frames.EXTRAPOLATION_NS)):
            placed.append((scan, se2.compose(at.at(np.int64(heard.stamp_ns)), scan.base_from_laser)))
        elif at is None or not len(at):
            placed.append((scan, np.full(3, np.nan)))
    in_order = [placed[index] for index in np.argsort([scan.stamp_ns for scan, _ in placed], kind="stable")]
    robot.placed[lidar] = in_order
    opposite = False
    if in_order and np.isfinite(in_order[0][1]).all():
        moves = motion_checks.measure([_points(scan) for scan, _ in in_order], np.array([pose for _, pose in in_order]))
        opposite = motion_checks.turns_are_opposite(moves)
        of_motion = [*motion_checks.check(moves, lidar, robot.link, opposite)]
        yield from of_motion
        if not (opposite or moves.idle or of_motion):
            yield from wheel_checks.check(moves, robot.link)
    found: List[Finding] = []
    if grid_map is not None:
        found = [*map_checks.check(ScansOnMap(grid_map, [_in_base(scan) for scan, _ in in_order]), opposite)]
        yield from found
    if opposite and not any(finding.name == "lidar-mirrored" for finding in found):
        yield _opposite(grid_map is not None, lidar, robot.link)


def _check_glass(grid_map: GridMap, robot: _Robot) -> Iterator[Finding]:
    """Look for panes that the map lacks, and for walls that are gone, with each lidar."""
    for placed in robot.placed.values():
        known = [(scan, odom_from_laser) for scan, odom_from_laser in placed if np.isfinite(odom_from_laser).all()]
        if known:
            scans = [scan for scan, _ in known]
            odom_from_base = [se2.compose(pose, se2.inverse(scan.base_from_laser)) for scan, pose in known]
            yield from glass_checks.check(grid_map, scans, np.array(odom_from_base))


def _opposite(with_map: bool, lidar: str, link: str) -> Finding:
    if with_map:
        return Finding(
            "odometry-turns-opposite",
            f"{link} turns the other way than the scans, which fit the map as they are",
            "the yaw of odometry has the wrong sign: swap left and right wheel, or invert the axis of the gyro",
        )
    return Finding(
        "turns-opposite",
        f"{link} turns the other way than the scans",
        f"either {lidar} is mounted upside down and tf does not say so (add roll 180 deg), or odometry's "
        "yaw has the wrong sign; with --map the doctor finds out which",
    )


def _points(scan: Scan) -> np.ndarray:
    """(B, 2) end points of the finite ranges up to a limit, in the lidar's frame."""
    near = scan.answered & (np.where(scan.answered, scan.ranges_m, np.inf) < FARTHEST_M)
    ranges_m, bearing = scan.ranges_m[near], scan.angles_rad[near]
    return np.stack([ranges_m * np.cos(bearing), ranges_m * np.sin(bearing)], axis=-1)


def _in_base(scan: Scan) -> np.ndarray:
    points = scan.points_in_base()
    return points[np.isfinite(points).all(axis=1)]
