"""Which beams of a scan ended at the back of a wall that the mapper saw from its other side only.

A map draws the faces of walls that the mapper saw. From a bridge, a courtyard or a room that it did not enter, the
lidar sees the other faces: the map shows them too far away, by the thickness of the wall. A scan matcher that takes the
nearest wall for the one that the beam met is then off by the same distance. B beams.
"""

from __future__ import annotations

import numpy as np

from glass_nav import _distance_field
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
    at_back = _distance_field.end_at_backs(
        field.compiled,
        known_area.compiled,
        scan.points_in_base()[beams],
        scan.angles_rad[beams] + scan.base_from_laser[2],
        map_from_base,
        _BEFORE_M,
        _THICKEST_M,
        max(_SIDE_M, _SIDE_CELLS * known_area.resolution_m),
    )
    return beams[~at_back]
