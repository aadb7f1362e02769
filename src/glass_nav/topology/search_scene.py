"""The search as markers in the frame of the map, before the pose is known.

The leading hypotheses as robots with their probability; on the best three the last scan and the path by dead
reckoning, laid over the map; the rows of the forest, with each search node that was ruled out and the reason. Without
ROS. K hypotheses.
"""

from __future__ import annotations

from typing import Dict, List, Optional, Sequence, Tuple, Union

import numpy as np

from glass_nav.geometry import se2
from glass_nav.shapes import Shape, ShapeKind, Text, figures_at
from glass_nav.topology.atlas.atlas import Atlas
from glass_nav.topology.search import mismatches
from glass_nav.topology.search.atlas_localizer import AtlasLocalizer
from glass_nav.topology.search.belief import Belief, RuledOut
from glass_nav.topology.search.search_forest import SearchForest
from glass_nav.vocabulary import LEFT_OUT_RGB, PLACE_RGB, Rgb

HYPOTHESES, SCANS, DRIVEN, RULED_OUT, ROWS = NAMESPACES = ("hypotheses", "scans", "driven", "ruled_out", "rows")
MAX_ROBOTS, MAX_SCANS = 8, 3
MAX_REASONS = 12  # beside crosses; more would hide the map
MAX_ROWS, MAX_NAMED = 5, 6  # of the forest, and search nodes named in a row
MAX_CROSSED = 2  # search nodes that went, named in a row

INK: Rgb = (20, 20, 20)
_RING_M, _CORNERS = 0.45, 24
_STEP_M = 0.1  # of the driven path
_KEPT = 5000  # points of it
_MIN_SHARE = 0.005  # of a hypothesis that is drawn
_APART = np.array([6.0, 1.5])  # letters along and across: reasons nearer than that would cover each other
_HEIGHT_M = 0.06


class SearchScene:
    """Fed by what the robot sees and by each step of the search; forget() at the begin of another one."""

    def __init__(self) -> None:
        self._points = np.zeros((0, 2))  # of the last scan, in base
        self._odom_from_base: Optional[np.ndarray] = None
        self._driven: List[np.ndarray] = []  # odom_from_base along the path
        self._rows: List[Tuple[str, List[RuledOut]]] = []  # of the forest: what was seen and left, what went

    def forget(self) -> None:
        """Start over for another search."""
        self._driven, self._rows = [], []

    def saw(self, points_in_base: np.ndarray, odom_from_base: np.ndarray) -> None:
        """A scan (B, 2) and the odometry (3,) there."""
        self._points, self._odom_from_base = points_in_base, odom_from_base
        if not self._driven or np.hypot(*(odom_from_base - self._driven[-1])[:2]) >= _STEP_M:
            self._driven = [*self._driven, odom_from_base][-_KEPT:]

    def stepped(self, localizer: AtlasLocalizer) -> None:
        """The forest may have a new row."""
        forest = localizer.forest
        if forest.depth + 1 < len(self._rows):
            self._rows = []  # the search began again
        if forest.depth + 1 > len(self._rows):
            gone = mismatches.of_last_row(localizer.matcher, forest)
            self._rows.append((_row_words(localizer.atlas, forest, gone), gone))

    @property
    def ruled_out(self) -> Sequence[RuledOut]:
        """Search nodes that the last meetpoint ruled out."""
        return self._rows[-1][1] if self._rows else ()

    def shapes(self, atlas: Atlas, belief: Optional[Belief], alive: np.ndarray) -> List[Union[Shape, Text]]:
        """All shapes and texts; empty ones clear what was drawn.

        Args:
            atlas: of the search.
            belief: of scans and forest; None: there is none.
            alive: (C,) darts that are left.
        """
        letter_m = letter_size_m(atlas)
        return [*self._hypotheses(belief, letter_m), *self._crosses(atlas, alive, letter_m), *self._forest(atlas)]

    # -- parts

    def _hypotheses(self, belief: Optional[Belief], letter_m: float) -> List[Union[Shape, Text]]:
        poses, share = np.zeros((0, 3)), np.zeros(0)
        if belief is not None:
            shown = np.flatnonzero(belief.share >= _MIN_SHARE)[:MAX_ROBOTS]
            poses, share = self._now(belief, belief.poses[shown]), belief.share[shown]
        best = poses[:MAX_SCANS]
        scans = se2.transform_points(best[:, None], self._points).reshape(-1, 2) if len(self._points) else best[:0, :2]
        rings = [_robot(pose) for pose in poses] or [np.zeros((0, 2))]
        texts = []
        for number in range(MAX_ROBOTS):
            known = number < len(poses)
            at_m = np.append(poses[number, :2] + [0.0, _RING_M + 0.7 * letter_m], 0.1) if known else np.zeros(3)
            words = f"{100.0 * share[number]:.0f} %" if known else ""
            texts.append(Text(HYPOTHESES, 1 + number, words, at_m, letter_m, PLACE_RGB))
        return [
            Shape(HYPOTHESES, 0, ShapeKind.LINES, np.concatenate(rings), _HEIGHT_M, 0.1, PLACE_RGB),
            Shape(SCANS, 0, ShapeKind.SQUARES, scans, _HEIGHT_M, 0.08, PLACE_RGB, 0.8),
            Shape(DRIVEN, 0, ShapeKind.LINES, self._paths(best), _HEIGHT_M, 0.06, PLACE_RGB, 0.6),
            *texts,
        ]

    def _now(self, belief: Belief, poses: np.ndarray) -> np.ndarray:
        """(K, 3) poses of the hypotheses, moved by dead reckoning to the last scan."""
        if belief.odom_from_base is None or self._odom_from_base is None:
            return poses
        return se2.compose(poses, se2.compose(se2.inverse(belief.odom_from_base), self._odom_from_base))

    def _paths(self, poses: np.ndarray) -> np.ndarray:
        """Pairs of ends of the driven path that led to each of the poses (K, 3)."""
        if len(self._driven) < 2 or self._odom_from_base is None or not len(poses):
            return np.zeros((0, 2))
        way = se2.compose(se2.inverse(self._odom_from_base), np.array(self._driven))[:, :2]
        pairs = np.repeat(way, 2, axis=0)[1:-1]
        return se2.transform_points(poses[:, None], pairs).reshape(-1, 2)

    def _crosses(self, atlas: Atlas, alive: np.ndarray, letter_m: float) -> List[Union[Shape, Text]]:
        """A cross on each node that went and where no candidate is left, with the value that ruled it out."""
        nodes = atlas.darts.node
        left = set(nodes[alive].tolist())
        crossed: Dict[int, RuledOut] = {}
        for gone in self.ruled_out:
            node = int(nodes[gone.dart])
            if node not in left:
                crossed.setdefault(node, gone)
        places = atlas.nodes.position_m[list(crossed)] if crossed else np.zeros((0, 2))
        texts: List[Text] = []
        named: List[np.ndarray] = []
        for place, gone in zip(places, crossed.values()):
            if len(texts) < MAX_REASONS and all((np.abs(place - other) > _APART * letter_m).any() for other in named):
                named.append(place)
                at_m = np.append(place + [0.0, -0.8 * letter_m], 0.1)
                texts.append(
                    Text(RULED_OUT, 1 + len(texts), mismatches.words(gone), at_m, 0.75 * letter_m, LEFT_OUT_RGB)
                )
        texts += [Text(RULED_OUT, 1 + n, "", np.zeros(3), 1.0, LEFT_OUT_RGB) for n in range(len(texts), MAX_REASONS)]
        cross = Shape(RULED_OUT, 0, ShapeKind.LINES, figures_at("x", places, 0.5), _HEIGHT_M, 0.06, LEFT_OUT_RGB)
        return [cross, *texts]

    def _forest(self, atlas: Atlas) -> List[Text]:
        """The last rows below the map."""
        letter_m = letter_size_m(atlas)
        low, high = atlas.nodes.position_m.min(axis=0), atlas.nodes.position_m.max(axis=0)
        rows = [words for words, _ in self._rows[-MAX_ROWS:]]
        texts = []
        for number in range(MAX_ROWS):
            at_m = np.array([0.5 * (low[0] + high[0]), low[1] - (4.5 + 1.5 * number) * letter_m, 0.1])
            texts.append(Text(ROWS, number, rows[number] if number < len(rows) else "", at_m, 0.8 * letter_m, INK))
        return texts


def letter_size_m(atlas: Atlas) -> float:
    """Height of letters that can be read where all of the atlas is seen."""
    span = np.ptp(atlas.nodes.position_m, axis=0)
    return max(0.3, 0.02 * float(span.max()))


def _robot(pose: np.ndarray) -> np.ndarray:
    """Pairs of ends (2 n, 2): a round base, and a line to where it faces."""
    turn = np.linspace(0.0, 2.0 * np.pi, _CORNERS + 1)
    circle = _RING_M * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    lines = np.concatenate([np.repeat(circle, 2, axis=0)[1:-1], [[0.0, 0.0], [1.8 * _RING_M, 0.0]]])
    return np.asarray(se2.transform_points(pose, lines))


def _row_words(atlas: Atlas, forest: SearchForest, gone: Sequence[RuledOut]) -> str:
    """One row of the forest as text, as in the document's figures: search nodes left, and those ruled out."""
    nodes, here = atlas.darts.node, forest.meetpoints[-1]
    alive = np.unique(nodes[forest.candidates()[0]]).tolist()
    crossed = {int(nodes[each.dart]): mismatches.words(each) for each in gone}
    out = [f"{node} x ({why})" for node, why in crossed.items() if node not in alive]
    driven = f"edge {forest.traversals[-1].length_m:.2f} m, " if forest.depth else ""
    seen = f"depth {forest.depth}: {driven}degree {here.degree}, r {here.r_m:.2f} m"
    return f"{seen} | {_named([str(node) for node in alive], MAX_NAMED) or 'none left'} | {_named(out, MAX_CROSSED)}".rstrip(
        " |"
    )


def _named(names: List[str], most: int) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more
