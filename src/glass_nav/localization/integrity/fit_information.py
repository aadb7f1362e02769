"""The covariance of the fit of a scan to the map at one pose, and the directions that it does not constrain.

This is the covariance of the least-squares fit of the beams to the walls at which they ended. Beams that ended at one
wall share an error: where the map has drawn it, and how the lidar sees it. That error averages out neither over beams
nor over scans. So the variance is that of a fit with clustered errors (White, Econometrica 48, 1980; Liang and Zeger,
Biometrika 73, 1986) at two levels: each piece of wall has its own error, and all walls that face the same way have a
common one. The size of both is learnt from the residuals after each fit.

The residual of a beam is measured from a point before the wall. That point lies either on the beam, where it may be near
other things that the beam passed by, or square to the wall and close to it. The latter resolves errors of a millimetre.
Then one more error shows: walls that are all drawn off to one side move the pose with them, and no scan notices. It is
estimated from how far pieces of walls are drawn off from each other.

A linearized fit does not know other places where the scan would fit as well, such as farther along a corridor with
equal doors. So the loss is also evaluated along the axis that is constrained least, and along the direction in which a
robot that keeps its heading is. The sums over the beams are computed in the compiled module _integrity. B beams.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from glass_nav import _integrity
from glass_nav.sensing import wall_backs
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.known_area import KnownArea
from glass_nav.sensing.scan import Scan, spread_evenly

_MIN_BEAMS = 10  # of a scan
FREE_M = 2.0  # deviation in a direction that no wall constrains


@dataclass(frozen=True)
class FitInformation:
    """The information of one scan at one pose."""

    covariance: np.ndarray  # (3, 3) over x [m], y [m], yaw [rad], in map
    offset: (
        np.ndarray
    )  # (3,) the pose that was looked at, less the one at which the scan fits best: a Gauss-Newton step
    share: float  # of the beams, that ended at a wall


class ScanFit:
    """Learns how much map and lidar disagree, and says how well each scan determines its pose."""

    def __init__(self, field: DistanceField, resolution_m: float, square: bool = False) -> None:
        """
        Args:
            field: distances to the walls.
            resolution_m: of the map's cells.
            square: measure residuals of fitted scans square to the walls.
        """
        self._field = field
        self._compiled = _integrity.ScanFit(resolution_m, square)

    def of(
        self, points_m: np.ndarray, laser_m: np.ndarray, map_from_base: np.ndarray, beam_share: float, worth: float
    ) -> FitInformation:
        """How well a scan determines its pose.

        Args:
            points_m: (B, 2) finite end points of the beams in the robot's frame, by ascending angle; B > 0.
            laser_m: (2,) the lidar in the robot's frame.
            map_from_base: (3,) pose to look at.
            beam_share: of all beams that the pose was fitted to, how many these are; the noise of one beam averages out.
            worth: of the fit as evidence, up to 1; then what is left is learnt from, and other places where the scan
                fits are looked at. 0: the pose was not fitted to this scan.
        """
        return FitInformation(
            *self._compiled.of(self._field.compiled, points_m, laser_m, map_from_base, beam_share, worth)
        )

    def of_scan(
        self, scan: Scan, map_from_base: np.ndarray, worth: float, known_area: KnownArea, most_beams: int
    ) -> Optional[FitInformation]:
        """How well a scan determines a pose (3,), by so many of its beams; None: too few of them tell.

        Args:
            scan: one revolution of a lidar.
            map_from_base: (3,) pose to look at.
            worth: as of of().
            known_area: of the map; beams that end at the back of a wall do not count.
            most_beams: to look at.
        """
        chosen = spread_evenly(scan.answered, most_beams)
        beam_share = len(chosen) / max(int(np.count_nonzero(scan.answered)), 1)
        beams = wall_backs.without(scan, chosen, map_from_base, self._field, known_area)
        if len(beams) < _MIN_BEAMS:
            return None
        return self.of(scan.points_in_base()[beams], scan.base_from_laser[:2], map_from_base, beam_share, worth)
