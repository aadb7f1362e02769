"""The publishers of the localization node: tf, pose, particles, status, cases, surfaces, displays."""

from __future__ import annotations

import threading
from typing import Optional

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import LaserScan, PointCloud2
from visualization_msgs.msg import MarkerArray

from glass_nav.localization.localizer import Estimate
from glass_nav.localization.map_to_odom import MapToOdom, StampedTransform
from glass_nav.localization.method import PoseFilter
from glass_nav.msg import BeamCases, LocalizationStatus
from glass_nav.rate_limiter import RateLimiter, period_s
from glass_nav.ros import conversions, legend
from glass_nav.ros.localization import beam_displays, wall_display
from glass_nav.ros.localization.params import LocalizationNodeParams
from glass_nav.sensing.scan_placement import PlacedScan
from glass_nav.vocabulary import LocalizationState
from glass_nav.world.grid_map import GridMap

NOT_KNOWN = float("nan")
UNHEARD_STATUS_S = 1.0  # the latched status is renewed that often without subscribers


class Publishers:
    """The node's publishers."""

    def __init__(self, p: LocalizationNodeParams) -> None:
        self._p = p
        self._frame = p.global_frame_id
        self._was_localized = False
        self._map_to_odom, self._sending = MapToOdom(), threading.Lock()  # callbacks send too
        self._particles_pace, self._beams_pace, self._glass_pace = RateLimiter(), RateLimiter(), RateLimiter()
        self._status_pace = RateLimiter()
        self._glass_is_news = False  # changed since it was last sent
        self._broadcaster = tf2_ros.TransformBroadcaster()
        self._poses = rospy.Publisher("amcl_pose", PoseWithCovarianceStamped, queue_size=2, latch=True)
        self._particles = rospy.Publisher("particlecloud", PoseArray, queue_size=2, latch=True)
        self._status = rospy.Publisher("~status", LocalizationStatus, queue_size=5, latch=True)
        self._beam_cases = rospy.Publisher("~beam_cases", BeamCases, queue_size=5)
        self._surfaces = rospy.Publisher("scan_surfaces", LaserScan, queue_size=5)
        self._glass_map = rospy.Publisher("~glass_map", OccupancyGrid, queue_size=1, latch=True)
        self._beam_cloud = rospy.Publisher("~beam_cloud", PointCloud2, queue_size=2)
        self._beam_markers = rospy.Publisher("~beam_markers", MarkerArray, queue_size=2)
        self._wall_markers = rospy.Publisher("~wall_markers", MarkerArray, queue_size=1, latch=True)
        self._legends = legend.publish(self._frame, "~legend")

    def reconfigure(self, p: LocalizationNodeParams) -> None:
        """Change the parameters."""
        self._p = p

    def start_over(self) -> None:
        """The pose is no longer known: stamps may go back, and tf waits for LOCALIZED again if so configured."""
        with self._sending:
            self._was_localized = False
            self._map_to_odom.start_over()
        self.glass_is_news()

    def glass_is_news(self) -> None:
        """The glass map has changed since it was sent."""
        self._glass_is_news = True

    def send(self, placed: PlacedScan, estimate: Estimate, now_s: float, pose_is_news: bool) -> None:
        """Publish everything about one scan that was used: first what the robot drives by, last what people look at.

        A topic that is not latched costs nothing without subscribers, and a latched one little.

        Args:
            placed: the scan.
            estimate: of the filter, for this scan.
            now_s: ROS time.
            pose_is_news: publish the pose even if this scan did not move the particles.
        """
        self._was_localized = self._was_localized or estimate.state == LocalizationState.LOCALIZED
        self.send_transform(estimate.stamp_ns, estimate.map_from_odom)
        pose_goes_out = estimate.updated or pose_is_news
        if pose_goes_out:
            self._poses.publish(conversions.pose_msg(estimate, self._frame))
        if self._surfaces.get_num_connections():
            self._surfaces.publish(conversions.surface_scan_msg(placed, estimate.surface_scan))
        is_news = estimate.updated or self._status.get_num_connections() > 0
        if self._status_pace.is_due(now_s, 0.0 if is_news else UNHEARD_STATUS_S):
            self._status.publish(
                conversions.status_msg(
                    estimate.stamp_ns,
                    self._frame,
                    estimate.state,
                    estimate.reason,
                    estimate.inlier_ratio,
                    estimate.confidence,
                    estimate.levels,
                )
            )
        if pose_goes_out and (self._particles_pace.is_due(now_s, period_s(self._p.gui_publish_rate)) or pose_is_news):
            self._particles.publish(conversions.pose_array(estimate.stamp_ns, self._frame, estimate.particles))
        self._glass_is_news = self._glass_is_news or estimate.updated
        if self._beam_cases.get_num_connections():
            self._beam_cases.publish(conversions.beam_cases_msg(placed.scan, estimate.cases))
        self._show_beams(placed, estimate, now_s)

    def send_transform(self, stamp_ns: int, map_from_odom: np.ndarray) -> None:
        """tf map -> odom after a scan, if wanted."""
        with self._sending:
            if self._transform_is_wanted:
                self._send(self._map_to_odom.corrected(stamp_ns, map_from_odom, self._tolerance_ns))

    def send_transform_again(self, scan_ns: int, now_ns: int) -> None:
        """tf map -> odom as it was last, the moment a scan arrives. May be called by any thread."""
        with self._sending:
            if self._transform_is_wanted:
                self._send(self._map_to_odom.arrived(scan_ns, now_ns, self._tolerance_ns))

    @property
    def _transform_is_wanted(self) -> bool:
        return self._p.tf_broadcast and (self._was_localized or self._p.publish_tf_before_localized)

    @property
    def _tolerance_ns(self) -> int:
        return round(self._p.transform_tolerance * 1e9)

    def _send(self, transform: Optional[StampedTransform]) -> None:
        if transform is None:
            return
        message = conversions.transform_stamped(
            transform.stamp_ns, self._frame, self._p.odom_frame_id, transform.map_from_odom
        )
        try:
            self._broadcaster.sendTransform(message)
        except rospy.ROSException:
            # is_shutdown() is true only some time after the topic was closed
            if not rospy.core.is_shutdown_requested():
                raise

    def send_trouble(self, estimate: Optional[Estimate], state: LocalizationState, trouble: str) -> None:
        """~status, and its text in rviz, while no scan is being used.

        Args:
            estimate: the last one, None before the first.
            state: of the localization.
            trouble: why no scan is being used.
        """
        stamp_ns, where = (0, None) if estimate is None else (estimate.stamp_ns, estimate.map_from_base)
        self._status.publish(conversions.status_msg(stamp_ns, self._frame, state, trouble, NOT_KNOWN, NOT_KNOWN))
        if self._beam_markers.get_num_connections():
            self._beam_markers.publish(
                MarkerArray([beam_displays.status_marker(where, self._frame, state, trouble, NOT_KNOWN)])
            )

    def send_glass_map(self, localizer: PoseFilter, grid_map: GridMap, stamp_ns: int, now_s: float) -> None:
        """The glass map, if it has changed, has subscribers and is due."""
        listeners = self._glass_map.get_num_connections() + self._wall_markers.get_num_connections()
        if not (self._glass_is_news and listeners and self._glass_pace.is_due(now_s, self._p.glass_map_period_s)):
            return
        self._glass_is_news = False
        glass = localizer.glass_map.occupancy()
        self._glass_map.publish(conversions.glass_map_msg(stamp_ns, self._frame, grid_map, glass))
        self._wall_markers.publish(wall_display.wall_markers(self._frame, grid_map, glass, localizer.unmapped_panes))

    def _show_beams(self, placed: PlacedScan, estimate: Estimate, now_s: float) -> None:
        """Publish the beams for rviz, if it listens and they are due."""
        listeners = self._beam_cloud.get_num_connections(), self._beam_markers.get_num_connections()
        if not any(listeners) or not self._beams_pace.is_due(now_s, period_s(self._p.gui_publish_rate)):
            return
        base, height_m = self._p.base_frame_id, placed.mounting.height_m
        if listeners[0]:
            self._beam_cloud.publish(beam_displays.beam_cloud(placed.scan, estimate.cases, height_m, base))
        if listeners[1]:
            markers = beam_displays.beam_markers(placed.scan, estimate.cases, estimate.surface_scan, height_m, base)
            markers.markers += beam_displays.place_markers(estimate.state, estimate.particles, self._frame)
            markers.markers.append(
                beam_displays.status_marker(
                    estimate.map_from_base, self._frame, estimate.state, estimate.reason, estimate.inlier_ratio
                )
            )
            self._beam_markers.publish(markers)
