"""The service ~locate, and the topic ~segment_quality while it has subscribers."""

from __future__ import annotations

from typing import Callable, Tuple

import numpy as np
import rospy
from geometry_msgs.msg import PoseStamped

from glass_nav.localization.localizer import Estimate
from glass_nav.localization.segments.pose_locator import LocateAnswer, PoseLocator
from glass_nav.localization.segments.segment_correction import SegmentQuality
from glass_nav.msg import SegmentQuality as SegmentQualityMsg
from glass_nav.ros import conversions
from glass_nav.sensing.scan import Scan
from glass_nav.srv import Locate, LocateRequest, LocateResponse
from glass_nav.world.grid_map import GridMap


class SegmentService:
    """Corrects rough poses by the wall segments of the map in use."""

    def __init__(self, frame: str, scan_and_map: Callable[[LocateRequest], Tuple[Scan, GridMap]]) -> None:
        """
        Args:
            frame: of the map.
            scan_and_map: the scan of a request, or the last one, and the map; ValueError if there is none.
        """
        self._frame, self._scan_and_map = frame, scan_and_map
        self._locator = PoseLocator()
        self._quality = rospy.Publisher("~segment_quality", SegmentQualityMsg, queue_size=2)
        rospy.Service("~locate", Locate, self._serve)

    def send_quality(self, grid_map: GridMap, scan: Scan, estimate: Estimate) -> None:
        """The measures of one scan at the pose of the filter."""
        if not self._quality.get_num_connections():
            return
        quality = self._locator.quality(grid_map, scan, estimate.cases.case, estimate.map_from_base)
        if quality is not None:
            self._quality.publish(_quality_msg(quality, estimate.stamp_ns, self._frame))

    def _serve(self, request: LocateRequest) -> LocateResponse:
        try:
            rough = _rough_pose(request, self._frame)
            scan, grid_map = self._scan_and_map(request)
            answer = self._locator.locate(grid_map, scan, rough)
        except (ValueError, TimeoutError) as err:
            rospy.logwarn(f"locate refused: {err}")
            raise rospy.ServiceException(str(err)) from err
        return _response(answer, scan.stamp_ns, self._frame)


def _rough_pose(request: LocateRequest, frame: str) -> np.ndarray:
    if conversions.frame_id(request.pose.header.frame_id) != frame:
        raise ValueError(f"the pose must be given in frame {frame!r}, got {request.pose.header.frame_id!r}")
    return conversions.planar_from_pose(request.pose.pose)


def _response(answer: LocateAnswer, stamp_ns: int, frame: str) -> LocateResponse:
    found = answer.correction
    heading = found.free_heading_rad
    return LocateResponse(
        answer.refusal is None,
        answer.text,
        PoseStamped(conversions.header(stamp_ns, frame), conversions.pose_from_planar(answer.map_from_base)),
        _quality_msg(found.before, stamp_ns, frame),
        _quality_msg(found.after, stamp_ns, frame),
        np.nan if heading is None else heading,
    )


def _quality_msg(quality: SegmentQuality, stamp_ns: int, frame: str) -> SegmentQualityMsg:
    return SegmentQualityMsg(
        conversions.header(stamp_ns, frame),
        quality.points,
        quality.mse_m2,
        quality.mse_inliers_m2,
        quality.inlier_share,
        quality.classification_factor,
        quality.combined,
    )
