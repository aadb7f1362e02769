"""glass_nav replay --topology: which nodes of an atlas a recorded robot passed, and which of them it detected.

The robot's eyes are those of the driver (driving/edge_tracking/passing.py), which knows no map; they are compared with the atlas
where the robot truly was.
"""

from __future__ import annotations

import logging
from pathlib import Path
from typing import List, Optional

import numpy as np

from glass_nav.driving.edge_tracking.local_graph import in_sight
from glass_nav.driving.edge_tracking.passing import PassingObserver
from glass_nav.evaluation.metrics import passed_nodes
from glass_nav.evaluation.metrics.passed_nodes import KnownNodes, Passing, SeenNode, TopologyScore
from glass_nav.evaluation.metrics.replay_result import ReplayResult
from glass_nav.evaluation.plots import passed_nodes_picture
from glass_nav.geometry import se2
from glass_nav.localization.localizer import Estimate
from glass_nav.recording.recording import Step
from glass_nav.topology.atlas import atlas_builder, atlas_file, shipped_atlases
from glass_nav.topology.atlas.atlas import RING_MARKER, Atlas
from glass_nav.vocabulary import LocalizationState
from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap

FROM_MAP = "map"  # as the name of an atlas: made from the map


def atlas_of(given: str, map_path: Path, grid_map: GridMap) -> Atlas:
    """The atlas of --topology.

    Args:
        given: file, folder or name of an atlas; FROM_MAP: made of the map.
        map_path: where the map is from.
        grid_map: the map.

    Raises:
        AtlasError: no such atlas, or one of another map.
    """
    if given == FROM_MAP:
        return atlas_builder.build(grid_map, map_file.name_of(map_path), map_file.name_of(map_path))[0]
    atlas = atlas_file.load(shipped_atlases.find(given))
    warning = atlas.check_map(grid_map, str(map_path))
    if warning:
        logging.getLogger(__name__).warning("the atlas %s %s", given, warning)
    return atlas


def known_nodes(atlas: Atlas) -> KnownNodes:
    """The nodes to compare with. Markers on plain rings are left out, since there is nothing to see."""
    ring = atlas.nodes.kind == RING_MARKER
    position_m = np.where(ring[:, None], np.inf, atlas.nodes.position_m)
    return KnownNodes(
        position_m,
        atlas.nodes.r_m,
        atlas.degree,
        atlas.darts.node.reshape(-1, 2),
        atlas.edges.length_m,
        atlas.edges.chord_m,
    )


def score(
    atlas: Atlas, grid_map: GridMap, observer: PassingObserver, stamps_ns: np.ndarray, map_from_base: np.ndarray
) -> TopologyScore:
    """Compares the detections of the observer with the atlas.

    Args:
        atlas: of the map.
        grid_map: the map.
        observer: that saw all scans.
        stamps_ns: (S,) of the scans.
        map_from_base: (S, 3) where the robot was, NaN where that is not known.
    """
    known = known_nodes(atlas)
    passing = Passing(
        observer.params.near, observer.params.linger_m, lambda from_m, to_m: in_sight(grid_map, from_m, to_m)
    )
    at = dict(zip(stamps_ns.tolist(), map_from_base))
    passed = [node for node in observer.finish() if np.isfinite(at.get(node.stamp_ns, np.array([np.nan]))).all()]
    seen: List[SeenNode] = [
        SeenNode(
            node.stamp_ns,
            node.first_ns,
            node.last_ns,
            se2.transform_points(at[node.stamp_ns], node.in_base_m),
            node.away_m,
            node.degree,
            node.r_m,
            node.doubt_m > observer.params.most_doubt_m,
            observer.is_steady(node),
        )
        for node in passed
    ]
    visits = passed_nodes.visits(known, stamps_ns, map_from_base, passing)
    meetings = passed_nodes.compare(known, visits, seen, passing)
    edges = passed_nodes.driven_edges(
        known, meetings, lambda first, second: observer.line_between(passed[first], passed[second])
    )
    return TopologyScore(known, seen, meetings, edges)


class Watch:
    """The observer beside the filter of a replay."""

    def __init__(self, atlas: Atlas, grid_map: GridMap) -> None:
        self.atlas, self._grid_map, self._observer = atlas, grid_map, PassingObserver()

    def listen(self, step: Step, estimate: Estimate) -> None:
        """Observes a scan; the filter's result is not used."""
        self._observer.see(step.scan, step.odom_from_base)

    def finish(self, result: ReplayResult) -> TopologyScore:
        """The drive is over."""
        return score(self.atlas, self._grid_map, self._observer, result.stamps_ns, poses(result))


def poses(result: ReplayResult) -> np.ndarray:
    """(S, 3) map_from_base by the reference, NaN where it does not reach; without one the estimates, NaN while lost."""
    if result.reference is not None and len(result.reference):
        return np.where(result.errors.matched[:, None], result.reference.at(result.stamps_ns), np.nan)
    lost = np.isin(
        np.array(result.states), [LocalizationState.UNKNOWN, LocalizationState.GLOBAL_SEARCH, LocalizationState.LOST]
    )
    return np.where(lost[:, None], np.nan, result.map_from_base)


def write(
    folder: Path, found: TopologyScore, atlas: Atlas, grid: Optional[GridMap], way_m: np.ndarray, title: str
) -> None:
    """topology.csv and, with a map, topology.png."""
    passed_nodes.write(folder / "topology.csv", found)
    if grid is not None:
        passed_nodes_picture.draw(
            folder / "topology.png",
            grid,
            [atlas.edges.polyline_m[edge] for edge in range(len(atlas.edges))],
            way_m,
            found,
            title,
        )
