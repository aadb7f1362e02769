"""The markers of the topology node for rviz, with a namespace for each kind.

Namespaces: `atlas` (edges) and `nodes`; candidates as arrows in `searching`, `tentative`, `confirmed` or `ambiguous`,
by the state of the search; `forest`, the paths of the candidates; `text`; and those of topology/search_scene.py:
`hypotheses` with their shares, `scans` and `driven` for the best of them, `ruled_out`, crosses on search nodes that
went, with the value that ruled them out, and `rows` of the forest.
"""

from __future__ import annotations

from typing import List

import numpy as np
from geometry_msgs.msg import Pose, Quaternion, Vector3
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from glass_nav.geometry import se2
from glass_nav.ros import conversions
from glass_nav.ros.packed_markers import PackedMarkerArray, colour, points_marker, shape_marker, text_marker
from glass_nav.shapes import Shape
from glass_nav.topology import search_scene, search_story
from glass_nav.topology.atlas.atlas import Atlas
from glass_nav.topology.search.atlas_localizer import AtlasLocalizer
from glass_nav.topology.search_decisions import SearchStatus
from glass_nav.topology.search_scene import SearchScene
from glass_nav.vocabulary import ATLAS_RGB, FOREST_RGB, NODE_RGB, SEARCH_RGB

NAMESPACES = ("atlas", "nodes", *(state.lower() for state in SEARCH_RGB), "forest", "text", *search_scene.NAMESPACES)
MAX_PATHS = 50  # of candidates; more would only hide the map

_ARROW_M = np.array([[0.0, 0.0], [0.8, 0.0], [0.8, 0.0], [0.5, 0.2], [0.8, 0.0], [0.5, -0.2]])  # pairs of ends
_HEIGHT_M = 0.02


def atlas_markers(atlas: Atlas, map_frame: str) -> List[Marker]:
    """Edges and nodes."""
    header = conversions.header(0, map_frame)  # stamp 0: for every time
    lines = [_line(atlas, 2 * edge) for edge in range(len(atlas.edges))]  # once for an atlas
    return [
        points_marker(header, "atlas", 0, Marker.LINE_LIST, _pairs(lines), _HEIGHT_M, 0.06, _rgb(ATLAS_RGB)),
        points_marker(header, "nodes", 0, Marker.POINTS, atlas.nodes.position_m, _HEIGHT_M, 0.25, _rgb(NODE_RGB)),
    ]


def search_markers(
    localizer: AtlasLocalizer, status: SearchStatus, scene: SearchScene, map_frame: str, atlas_shown: List[Marker]
) -> MarkerArray:
    """An atlas and what is known about the robot's place in it; namespaces of other states are cleared.

    Args:
        localizer: of the search.
        status: what is known, with the poses to show.
        scene: what was seen so far.
        map_frame: frame of the map.
        atlas_shown: of atlas_markers().
    """
    atlas, estimate, header = localizer.atlas, status.estimate, conversions.header(0, map_frame)
    arrows = {state: np.zeros((0, 2)) for state in SEARCH_RGB}
    forest, alive = np.zeros((0, 2)), np.zeros(0, np.int64)
    if estimate is not None:
        if status.state in arrows:
            arrows[status.state] = _placed(_ARROW_M, status.poses)
        alive = estimate.dart
        forest = _pairs(
            [
                _line(atlas, departure)
                for dart in estimate.dart[:MAX_PATHS].tolist()
                for departure in (localizer.path(dart)[1:] ^ 1).tolist()
            ]
        )
    markers = [
        points_marker(header, state.lower(), 0, Marker.LINE_LIST, points, 3 * _HEIGHT_M, 0.1, _rgb(SEARCH_RGB[state]))
        for state, points in arrows.items()
    ]
    markers.append(points_marker(header, "forest", 0, Marker.LINE_LIST, forest, 2 * _HEIGHT_M, 0.12, _rgb(FOREST_RGB)))
    shown = [
        shape_marker(header, each) if isinstance(each, Shape) else text_marker(header, each)
        for each in scene.shapes(atlas, status.belief if status.map_from_base is None else None, alive)
    ]
    reason = status.reason
    if estimate is None and status.belief is not None:  # before the first meetpoint
        reason = search_story.on_the_way(status.belief, localizer.params.tolerances.risk)
    words = _text(header, atlas, f"{status.state}\n{reason}")
    return PackedMarkerArray([*atlas_shown, *markers, words, *shown])


def _line(atlas: Atlas, dart: int) -> np.ndarray:
    """(n, 2) points of a dart's edge; straight if the atlas has no line of it."""
    points = atlas.edges.polyline_m[dart >> 1]
    if not len(points):
        points = atlas.nodes.position_m[atlas.darts.node[2 * (dart >> 1) : 2 * (dart >> 1) + 2]]
    return points


def _pairs(lines: List[np.ndarray]) -> np.ndarray:
    """Lines (n, 2) as pairs of ends (K, 2)."""
    if not lines:
        return np.zeros((0, 2))
    return np.concatenate([np.repeat(line, 2, axis=0)[1:-1] for line in lines])


def _placed(shape: np.ndarray, poses: np.ndarray) -> np.ndarray:
    """A shape (n, 2) at each pose (K, 3): (K n, 2)."""
    return se2.transform_points(poses[:, None], shape).reshape(-1, 2)


def _rgb(rgb: "tuple[int, int, int]") -> ColorRGBA:
    return colour(np.array(rgb))


def _text(header: Header, atlas: Atlas, text: str) -> Marker:
    """A text above the atlas, as large as the view of the whole atlas needs."""
    low, high = atlas.nodes.position_m.min(axis=0), atlas.nodes.position_m.max(axis=0)
    size = search_scene.letter_size_m(atlas)
    pose = Pose(orientation=Quaternion(w=1.0))
    pose.position.x, pose.position.y = 0.5 * float(low[0] + high[0]), float(high[1]) + 4.0 * size
    return Marker(
        header=header,
        ns="text",
        id=0,
        type=Marker.TEXT_VIEW_FACING,
        action=Marker.ADD,
        pose=pose,
        scale=Vector3(0.0, 0.0, size),
        color=_rgb((0, 0, 0)),
        text=text,
    )
