"""Which beams of a scan ended at the back of a wall that the mapper saw from its other side only.

A map draws the faces of walls that the mapper saw. From a bridge, a courtyard or a room that it did not enter, the
lidar sees the other faces: the map shows them too far away, by the thickness of the wall. A scan matcher that takes the
nearest wall for the one that the beam met is then off by the same distance. B beams.
"""

from __future__ import annotations

import numpy as np

from glass_nav.geometry import se2
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.known_area import KnownArea
from glass_nav.sensing.scan import Scan

_BEFORE_M = 0.25  # the end of a beam: where the field tells from which side it came
_THICKEST_M = 0.75  # from there to the face that is drawn: farther walls attract no beam
_SIDE_M, _SIDE_CELLS = 0.15, 2.5  # from that face, to both sides: what the mapper saw


class WallBacks:
    """Knows which sides of the walls of one map the mapper saw."""

    def __init__(self, field: DistanceField, known_area: KnownArea, resolution_m: float) -> None:
        """
        Args:
            field, known_area: of the map.
            resolution_m: of its cells.
        """
        self._field, self._known_area = field, known_area
        self._side_m = max(_SIDE_M, _SIDE_CELLS * resolution_m)

    def without(self, scan: Scan, beams: np.ndarray, map_from_base: np.ndarray) -> np.ndarray:
        """The beams (B,), indices, of a scan from a pose (3,) that ended at no back of a wall."""
        bearing = scan.angles_rad[beams] + (map_from_base[2] + scan.base_from_laser[2])
        ahead = np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)
        before = se2.transform_points(map_from_base, scan.points_in_base()[beams]) - _BEFORE_M * ahead
        distance_m, along_x, along_y = self._field.at(before[:, 0], before[:, 1])
        away = np.stack([along_x, along_y], axis=-1)  # from the wall
        wall = before - distance_m[:, None] * away
        met = (distance_m < _THICKEST_M) & (np.sum(away * ahead, axis=1) < 0.0)
        side = self._side_m * away
        met &= self._known_area.is_unmapped(wall + side) & self._known_area.is_free(wall - side)
        return beams[~met]
