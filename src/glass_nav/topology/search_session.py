"""The decisions of topology_node: one search after another in an atlas, from reports and requests to what is published.

Without ROS and without a clock: each method is an event, and returns the decisions that follow from it, in the order
in which they are to be carried out. A search begins at a meetpoint and ends CONFIRMED, AMBIGUOUS or LOST, or when its
goal gives up. Before and after, the state is WAITING (the search starts at the next meetpoint), IDLE, or NO_ATLAS without
an atlas of the map.
"""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path
from typing import Callable, List, Optional, Tuple, Union

import numpy as np

from glass_nav.log_line import LogLine
from glass_nav.params import number
from glass_nav.sensing.scan import Scan
from glass_nav.topology import frame_relation, search_story
from glass_nav.topology.atlas import atlas_file
from glass_nav.topology.atlas.atlas import Atlas, AtlasError
from glass_nav.topology.frame_relation import FrameRelation
from glass_nav.topology.observations import Meetpoint, ObservationError, Traversal
from glass_nav.topology.search.atlas_localizer import AtlasLocalizer
from glass_nav.topology.search.belief import Belief
from glass_nav.topology.search.search_estimate import SearchEstimate, TurnChoice
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.topology.search.served_explanation import ServedExplanation
from glass_nav.vocabulary import SearchState
from glass_nav.world.grid_map import GridMap

ON_THE_WAY_S = 5.0  # from one line between meetpoints to the next

ReadAtlas = Callable[[], Tuple[str, Atlas]]  # where it was found, and the atlas


@dataclass(frozen=True)
class SessionParams:
    """How searches are begun, fed and reported."""

    check_map: bool = True  # refuse the atlas if another map is served than it was made from
    end_without_atlas: bool = False  # when the atlas is refused, rather than wait for its map
    judge_by_scans: bool = True  # as use_scans of the search, which has taken its place
    search_at_start: bool = True  # with the first meetpoint; else when asked
    publish_initial_pose: bool = True
    listed_candidates: int = number(1000, 1, 100_000)  # at most, with their poses
    # [s] between the stamps of an edge traversal and its meetpoint
    pairing_tolerance_s: float = number(2.0, 0.0, 100.0)
    visits_file: str = ""  # the atlas with its statistics is read there and saved there; empty: nowhere

    def __post_init__(self) -> None:
        if self.listed_candidates < 1:
            raise ValueError(f"~listed_candidates must be >= 1, got {self.listed_candidates}")
        if not (math.isfinite(self.pairing_tolerance_s) and self.pairing_tolerance_s > 0.0):
            raise ValueError(f"~pairing_tolerance_s must be finite and > 0, got {self.pairing_tolerance_s}")
        if self.visits_file and not self.visits_file.endswith((".json", ".npz")):
            raise ValueError(f"~visits_file must be a .json or a .npz, got {self.visits_file!r}")


@dataclass(frozen=True)
class Goal:
    """A requested search, whose client waits."""

    here: bool = False  # begin at the meetpoint that was reported last; else at the next one
    max_edges: int = 0  # give up after so many edges; 0: no limit


class GoalOutcome(Enum):
    """How a goal ended."""

    SUCCEEDED = "SUCCEEDED"  # CONFIRMED
    ABORTED = "ABORTED"  # AMBIGUOUS, LOST, or too many edges
    PREEMPTED = "PREEMPTED"


# -- decisions


@dataclass(frozen=True)
class SearchStatus:
    """The status of the search, to be published."""

    state: SearchState
    reason: str  # one sentence
    stamp_ns: int = 0  # of the meetpoint that it follows from; 0: of none
    estimate: Optional[SearchEstimate] = None  # of the search; None before its first meetpoint
    poses: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))  # (K, 3) map_from_base of the first candidates
    relation: Optional[FrameRelation] = None  # of the frames, if it is CONFIRMED and dead reckoning is known
    belief: Optional[Belief] = None  # of scans and forest; None: no scan has been evidence yet

    @property
    def map_from_base(self) -> Optional[np.ndarray]:
        """(3,) the pose, if it is CONFIRMED."""
        return self.poses[0] if self.state == SearchState.CONFIRMED else None


@dataclass(frozen=True)
class Progress:
    """Feedback for the goal."""

    status: SearchStatus


@dataclass(frozen=True)
class Turn:
    """The answer to a meetpoint."""

    choice: TurnChoice
    stamp_ns: int  # of the meetpoint


@dataclass(frozen=True)
class InitialPose:
    """The pose to be handed over to the localization."""

    map_from_base: np.ndarray  # (3,)
    stamp_ns: int  # of the meetpoint where the robot had this pose


@dataclass(frozen=True)
class GoalEnd:
    """The goal is over."""

    outcome: GoalOutcome
    reason: str
    status: SearchStatus


@dataclass(frozen=True)
class AtlasRequest:
    """An atlas of this map is to be made, and to be given to SearchSession.atlas_made()."""

    grid_map: GridMap


Decision = Union[SearchStatus, Progress, Turn, InitialPose, GoalEnd, LogLine, AtlasRequest]


# -- the session


class SearchSession:
    """One search at a time, as long as the node runs; call start() first."""

    def __init__(self, read_atlas: Optional[ReadAtlas], p: SessionParams, search: SearchParams) -> None:
        """
        Args:
            read_atlas: reads the atlas to use now, at the start and whenever it is to be read again; None: there is none,
                one is to be made of each map that is served.
            p: of the session.
            search: how each search is done.
        """
        self._read_atlas, self._makes_atlas = read_atlas, read_atlas is None
        self._p, self._search_params = p, search
        self._explanation = ServedExplanation()
        self._map: Optional[Tuple[GridMap, str]] = None  # that is served, and its name for people
        self._localizer: Optional[AtlasLocalizer] = None
        self._status = SearchStatus(SearchState.NO_ATLAS, "no atlas was read yet")
        self._goal: Optional[Goal] = None
        self._last_meetpoint: Optional[Meetpoint] = None
        self._unpaired_meetpoint: Optional[Meetpoint] = None
        self._unpaired_traversal: Optional[Tuple[Traversal, int]] = None  # with its stamp [ns]
        self._told = -1, 0  # places left, and the stamp [ns], when the log said so

    @property
    def status(self) -> SearchStatus:
        """The last one."""
        return self._status

    @property
    def is_to_end(self) -> bool:
        """Whether the node is to end: the atlas was refused, and no map is awaited."""
        return self._p.end_without_atlas and self._status.state == SearchState.NO_ATLAS and not self._makes_atlas

    @property
    def localizer(self) -> Optional[AtlasLocalizer]:
        """The localizer of the atlas; None without an atlas."""
        return self._localizer

    @property
    def choice(self) -> Optional[TurnChoice]:
        """The last turn of this search; None if there is none to take."""
        return None if self._status.estimate is None else self._status.estimate.choice

    @property
    def uses_scans(self) -> bool:
        """Whether scans are evidence."""
        return self.takes_scans and self._explanation.has_map

    @property
    def is_looking(self) -> bool:
        """Whether scans are of use now."""
        searching = self._status.state in (SearchState.WAITING, SearchState.SEARCHING, SearchState.TENTATIVE)
        return searching and self.uses_scans and self._localizer is not None

    @property
    def takes_scans(self) -> bool:
        """Whether scans are asked for, with or without a map."""
        return self._p.judge_by_scans and self._search_params.use_scans and not self._search_params.document

    # -- events

    def start(self) -> List[Decision]:
        """Read the atlas.

        Raises:
            ValueError, OSError: it cannot be used.
        """
        if self._read_atlas is None:
            return [self._show(SearchState.NO_ATLAS, "an atlas is built as soon as a map is served")]
        loaded = self._load()
        if self._p.search_at_start:
            waiting = self._await_meetpoint("the node has started")
            return [loaded, waiting, LogLine(f"{waiting.state}: {waiting.reason}")]
        return [loaded, self._show(SearchState.IDLE, "no search was requested")]

    def meetpoint(self, meetpoint: Meetpoint) -> List[Decision]:
        """The robot reports a meetpoint.

        Args:
            meetpoint: with the scan that was taken there, if candidates are to be judged by it.
        """
        self._last_meetpoint = meetpoint
        if self._localizer is not None and self._status.state == SearchState.WAITING:
            return self._judge(self._localizer, self._localizer.start(self._judgeable(meetpoint)), meetpoint.stamp_ns)
        if meetpoint.stamp_ns and meetpoint.stamp_ns == self._status.stamp_ns:
            return []  # the driver repeats its report until it hears that the search has begun
        self._unpaired_meetpoint = meetpoint
        return self._pair("meetpoint")

    def scan(self, scan: Scan, odom_from_base: np.ndarray) -> List[Decision]:
        """The robot sees something, wherever it is.

        Args:
            scan: one revolution of a lidar.
            odom_from_base: (3,) of the robot by dead reckoning at its stamp.
        """
        localizer = self._localizer
        if localizer is None or not self.is_looking:
            return []
        is_new, final = localizer.look(scan, odom_from_base)
        if final is not None:
            self._unpaired_meetpoint, self._unpaired_traversal = None, None
            return self._judge(localizer, final, scan.stamp_ns)
        if not is_new:
            return []
        self._status = replace(self._status, belief=localizer.belief)
        return [self._status, *self._told_on_the_way(localizer.belief, scan.stamp_ns)]

    def _told_on_the_way(self, belief: Optional[Belief], stamp_ns: int) -> List[Decision]:
        """Log the number of remaining places if it changed, at most once per interval."""
        if belief is None:
            return []
        risk = self._search_params.tolerances.risk
        left, (told_left, told_ns) = len(belief.left(risk)), self._told
        if left == told_left or 0 <= stamp_ns - told_ns < ON_THE_WAY_S * 1e9:
            return []
        self._told = left, stamp_ns
        return [LogLine(search_story.on_the_way(belief, risk))]

    def edge_traversal(self, traversal: Traversal, stamp_ns: int) -> List[Decision]:
        """The robot reports an edge that it drove, before or after the meetpoint at its end.

        Args:
            traversal: the edge.
            stamp_ns: of the report; 0: none.
        """
        self._unpaired_traversal = traversal, stamp_ns
        return self._pair("edge_traversal")

    def node_visits(self, node: np.ndarray, r_m: np.ndarray) -> List[Decision]:
        """A robot that knows its pose passed nodes (K,), and saw them at these distances (K,) from the obstacles.

        Args:
            node: of the atlas.
            r_m: NaN where it passed a node without seeing it.
        """
        if self._localizer is None or not len(node):
            return []
        if node.min() < 0 or node.max() >= len(self._localizer.atlas.nodes):
            text = (
                f"node_visits refused: nodes must be 0 to {len(self._localizer.atlas.nodes) - 1}, got {node.tolist()}"
            )
            return [LogLine(text, logging.WARNING, often=True)]
        missed, visits = np.isnan(r_m), self._localizer.atlas.visits
        visits.add_nodes(node[~missed], r_m[~missed])
        visits.add_misses(node[missed])
        return self._save_visits(self._localizer)

    def map_served(self, grid_map: GridMap, name: str) -> List[Decision]:
        """A map is served: it explains scans from now on, and the atlas must be made from it.

        Args:
            grid_map: it.
            name: for people, as "that of topic /map".
        """
        if self.takes_scans:
            self._explanation.take(grid_map)
        if self._makes_atlas:
            return self._map_without_atlas(grid_map, name)
        if not self._p.check_map:
            return []
        self._map = grid_map, name
        try:
            if self._localizer is not None:
                warning = self._localizer.atlas.check_map(*self._map)
                return [LogLine(f"the atlas {warning}", logging.WARNING)] if warning else []
            return [self._load(), self._await_meetpoint("there is another map")]
        except (ValueError, OSError) as err:
            self._localizer = None
            status = self._show(SearchState.NO_ATLAS, f"the atlas {err}")
            return [LogLine(f"atlas refused: {err}", logging.ERROR), status, *self._end_goal(status.reason)]

    def atlas_made(self, grid_map: GridMap, atlas: "Atlas | AtlasError") -> List[Decision]:
        """The answer to an AtlasRequest.

        Args:
            grid_map: of the request.
            atlas: of the map, or why there is none.
        """
        if self._map is None or self._map[0] is not grid_map:
            return []  # another map was served since
        if isinstance(atlas, AtlasError):
            status = self._show(SearchState.NO_ATLAS, f"no atlas can be built from {self._map[1]}: {atlas}")
            return [LogLine(status.reason, logging.ERROR), status, *self._end_goal(status.reason)]
        name = self._map[1]
        self._read_atlas = lambda: (f"the atlas built from {name}", atlas)
        loaded = self._load()
        if self._p.search_at_start:
            return [loaded, self._await_meetpoint("the atlas is made")]
        return [loaded, self._show(SearchState.IDLE, "no search was requested")]

    def goal(self, goal: Goal) -> List[Decision]:
        """Start the search of a new goal; the previous goal was preempted by it."""
        self._goal = goal
        if self._localizer is None:
            return self._end_goal(self._status.reason)
        if not goal.here:
            return [self._await_meetpoint("requested by the action")]
        if self._last_meetpoint is None:
            return self._end_goal("no meetpoint has been reported yet at which a search could begin")
        return [self._await_meetpoint("requested by the action"), *self.meetpoint(self._last_meetpoint)]

    def preempt(self) -> List[Decision]:
        """End the goal, because its client has cancelled it."""
        if self._goal is None:
            return []
        status = self._show(SearchState.IDLE, "the search was preempted")
        return [status, *self._end_goal(status.reason, GoalOutcome.PREEMPTED)]

    def restart(self) -> List[Decision]:
        """Forget the search.

        Raises:
            ValueError: there is no atlas to search in.
        """
        if self._localizer is None:
            raise ValueError(self._status.reason)
        return [self._await_meetpoint("restarted by service")]

    def reload_atlas(self) -> List[Decision]:
        """Read the atlas again and forget the search.

        Raises:
            ValueError, OSError: it cannot be used; the old one stays.
        """
        return [self._load(), self._await_meetpoint("the atlas was reloaded")]

    def time_jumped_back(self, jump: str) -> List[Decision]:
        """The clock was set back, as when a recording starts again.

        Args:
            jump: in words, by how much.
        """
        return [] if self._localizer is None else [self._await_meetpoint(jump)]

    # -- how an event is decided

    def _map_without_atlas(self, grid_map: GridMap, name: str) -> List[Decision]:
        if self._localizer is not None and self._map is not None:
            try:
                self._localizer.atlas.check_map(grid_map, name)
                return []
            except AtlasError:  # another one
                self._localizer = None
        self._map = grid_map, name
        status = self._show(SearchState.NO_ATLAS, f"an atlas of {name} is being made")
        return [LogLine(status.reason), status, AtlasRequest(grid_map)]

    def _load(self) -> LogLine:
        """Raises what reading raises, and AtlasError if the atlas is of another map than the one that is served, or the
        visits are of another atlas.
        """
        if self._read_atlas is None:
            raise AtlasError("no atlas has been built yet")
        found_at, atlas = self._read_atlas()
        atlas = self._with_visits(atlas)
        warning = ""
        if self._map is not None:
            try:
                warning = atlas.check_map(*self._map)
            except AtlasError as err:
                raise AtlasError(f"{found_at}: {err}") from err
        self._localizer = AtlasLocalizer(atlas, self._search_params, self._explanation if self.takes_scans else None)
        text = f"{found_at}: {len(atlas.nodes)} nodes, {len(atlas.edges)} edges"
        return LogLine(f"{text}; it {warning}", logging.WARNING) if warning else LogLine(text)

    def _with_visits(self, atlas: Atlas) -> Atlas:
        """The atlas with the statistics of the file of visits."""
        path = self._p.visits_file
        if not path or not Path(path).exists():
            return atlas
        kept = atlas_file.load(path)
        if not np.array_equal(kept.darts.node, atlas.darts.node) or len(kept.nodes) != len(atlas.nodes):
            raise AtlasError(
                f"~visits_file {path}: has visits of another atlas: {len(kept.nodes)} nodes and {len(kept.edges)} "
                f"edges, got an atlas of {len(atlas.nodes)} and {len(atlas.edges)}; delete it, or name another file"
            )
        return replace(atlas, visits=kept.visits)

    def _await_meetpoint(self, why: str) -> SearchStatus:
        return self._show(SearchState.WAITING, f"the search starts at the next meetpoint: {why}")

    def _show(self, state: SearchState, reason: str, stamp_ns: int = 0) -> SearchStatus:
        """Enter a state outside of a search; what was known is discarded."""
        self._unpaired_meetpoint, self._unpaired_traversal = None, None
        if self._localizer is not None:
            self._localizer.begin()
        self._status = SearchStatus(state, reason, stamp_ns)
        return self._status

    def _judgeable(self, meetpoint: Meetpoint) -> Meetpoint:
        """The meetpoint, without its scan if no map is available to judge the scan by."""
        return meetpoint if self.uses_scans else replace(meetpoint, scan=None)

    def _pair(self, kind: str) -> List[Decision]:
        """Advance the search by one edge once both reports, edge and meetpoint, have arrived."""
        estimate, meetpoint, driven = self._status.estimate, self._unpaired_meetpoint, self._unpaired_traversal
        if self._localizer is None or estimate is None or estimate.done:
            self._unpaired_meetpoint, self._unpaired_traversal = None, None
            return [LogLine(f"{kind} not used: the search is {self._status.state}", often=True)]
        if meetpoint is None or driven is None:
            return []
        traversal, stamp_ns = driven
        apart_s = 0.0 if 0 in (meetpoint.stamp_ns, stamp_ns) else abs(meetpoint.stamp_ns - stamp_ns) * 1e-9
        if apart_s > self._p.pairing_tolerance_s:
            return [self._drop_older(meetpoint.stamp_ns < stamp_ns, apart_s)]
        self._unpaired_traversal = None
        try:
            estimate = self._localizer.update(traversal, self._judgeable(meetpoint))
        except ObservationError as err:  # the meetpoint waits for another traversal
            return [LogLine(f"edge_traversal refused: {err}", logging.WARNING, often=True)]
        self._unpaired_meetpoint = None
        return self._judge(self._localizer, estimate, meetpoint.stamp_ns)

    def _drop_older(self, meetpoint_is_older: bool, apart_s: float) -> LogLine:
        if meetpoint_is_older:
            self._unpaired_meetpoint = None
        else:
            self._unpaired_traversal = None
        return LogLine(
            f"a {'meetpoint' if meetpoint_is_older else 'traversal'} is dropped: the edge_traversal and the meetpoint "
            f"at its end are stamped {apart_s:.3f} s apart, allowed ~pairing_tolerance_s "
            f"{self._p.pairing_tolerance_s:g} s",
            logging.WARNING,
            often=True,
        )

    def _judge(self, localizer: AtlasLocalizer, estimate: SearchEstimate, stamp_ns: int) -> List[Decision]:
        """Act on the estimate after a meetpoint."""
        goal = self._goal
        gives_up = goal is not None and not estimate.done and 0 < goal.max_edges <= estimate.depth
        if gives_up:
            estimate = replace(estimate, choice=None)  # the robot is to stay
        poses = localizer.poses(estimate, self._p.listed_candidates)
        status = SearchStatus(estimate.state, estimate.reason, stamp_ns, estimate, poses, belief=localizer.belief)
        if status.map_from_base is not None:
            node = localizer.node(estimate)
            relation = frame_relation.of(localizer.atlas, node, status.map_from_base, localizer.environment_from_base)
            status = replace(status, relation=relation)
        self._status = status
        decisions: List[Decision] = [
            status,
            LogLine(search_story.after(estimate, localizer.forest, stamp_ns)),
        ]
        if goal is not None and not estimate.done:
            decisions.append(Progress(status))
        if gives_up:
            decisions += self._end_goal(f"not found after {estimate.depth} edges: {estimate.reason}")
            decisions.append(self._show(SearchState.IDLE, f"gave up after {estimate.depth} edges", stamp_ns))
        elif estimate.choice is not None:
            decisions.append(Turn(estimate.choice, stamp_ns))
        if status.map_from_base is not None:
            decisions += self._count_visits(localizer)
            if self._p.publish_initial_pose:
                decisions.append(InitialPose(status.map_from_base, stamp_ns))
            decisions += self._end_goal(estimate.reason, GoalOutcome.SUCCEEDED)
        elif estimate.done:
            decisions += self._end_goal(estimate.reason)
        return decisions

    def _count_visits(self, localizer: AtlasLocalizer) -> List[Decision]:
        """Add the measurements of the confirmed path to the statistics of the atlas and its file."""
        localizer.count_visits(localizer.atlas.visits)
        return self._save_visits(localizer)

    def _save_visits(self, localizer: AtlasLocalizer) -> List[Decision]:
        if not self._p.visits_file:
            return []
        try:
            atlas_file.save(localizer.atlas, self._p.visits_file)
        except OSError as err:
            text = f"the atlas with its statistics is not saved: {self._p.visits_file}: {err.strerror}"
            return [LogLine(text, logging.ERROR)]
        return []

    def _end_goal(self, reason: str, outcome: GoalOutcome = GoalOutcome.ABORTED) -> List[Decision]:
        """Finish the current goal, if any, with the present result."""
        if self._goal is None:
            return []
        self._goal = None
        return [GoalEnd(outcome, reason, self._status)]
