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

_BEFORE_M = 0.25  # the end of a beam: there the field shows the side from which the beam came
_THICKEST_M = 0.75  # from there to the face that is drawn: farther walls attract no beam
_SIDE_M, _SIDE_CELLS = 0.15, 2.5  # from that face, to both sides: what the mapper saw


def without(
    scan: Scan, beams: np.ndarray, map_from_base: np.ndarray, field: DistanceField, known_area: KnownArea
) -> np.ndarray:
    """The beams that ended at no back of a wall.

    Args:
        scan: one revolution of a lidar.
        beams: (B,) indices of beams that returned.
        map_from_base: (3,) pose.
        field, known_area: of the map.
    """
    bearing = scan.angles_rad[beams] + (map_from_base[2] + scan.base_from_laser[2])
    ahead = np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)
    before = se2.transform_points(map_from_base, scan.points_in_base()[beams]) - _BEFORE_M * ahead
    distance_m, along_x, along_y = field.at(before[:, 0], before[:, 1])
    away = np.stack([along_x, along_y], axis=-1)  # from the wall
    wall = before - distance_m[:, None] * away
    side = max(_SIDE_M, _SIDE_CELLS * known_area.resolution_m) * away
    met = (distance_m < _THICKEST_M) & (np.sum(away * ahead, axis=1) < 0.0)
    met &= known_area.is_unmapped(wall + side) & known_area.is_free(wall - side)
    return beams[~met]
