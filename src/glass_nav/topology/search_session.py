"""The decisions of topology_node: one search after another in an atlas, from reports and requests to what is published.

Without ROS and without a clock: each method is an event, and returns the decisions that follow from it, in the order
in which they are to be carried out. A search begins at a meetpoint and ends CONFIRMED, AMBIGUOUS or LOST, or when its
goal gives up. Before and after, the state is WAITING (the search starts at the next meetpoint), IDLE, or NO_ATLAS without
an atlas of the map.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from typing import List, Optional

import numpy as np

from glass_nav.log_line import LogLine
from glass_nav.sensing.scan import Scan
from glass_nav.topology import frame_relation, search_story
from glass_nav.topology.atlas.atlas import Atlas, AtlasError
from glass_nav.topology.atlas_source import AtlasSource, ReadAtlas
from glass_nav.topology.observations import Meetpoint, ObservationError, Traversal
from glass_nav.topology.report_pairing import ReportPairing
from glass_nav.topology.search.atlas_localizer import AtlasLocalizer
from glass_nav.topology.search.belief import Belief
from glass_nav.topology.search.search_estimate import SearchEstimate, TurnChoice
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.topology.search.served_explanation import ServedExplanation
from glass_nav.topology.search_decisions import (
    AtlasRequest,
    Decision,
    GoalEnd,
    GoalOutcome,
    InitialPose,
    Progress,
    SearchStatus,
    Turn,
)
from glass_nav.topology.session_params import SessionParams
from glass_nav.vocabulary import SearchState
from glass_nav.world.grid_map import GridMap

ON_THE_WAY_S = 5.0  # from one line between meetpoints to the next


@dataclass(frozen=True)
class Goal:
    """A requested search, whose client waits."""

    here: bool = False  # begin at the meetpoint that was reported last; else at the next one
    max_edges: int = 0  # give up after so many edges; 0: no limit


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
        self._source = AtlasSource(read_atlas, p.visits_file)
        self._p, self._search_params = p, search
        self._explanation = ServedExplanation()
        self._localizer: Optional[AtlasLocalizer] = None
        self._status = SearchStatus(SearchState.NO_ATLAS, "no atlas was read yet")
        self._goal: Optional[Goal] = None
        self._last_meetpoint: Optional[Meetpoint] = None
        self._pairing = ReportPairing(p.pairing_tolerance_s)
        self._told = -1, 0  # places left, and the stamp [ns], when the log said so

    @property
    def status(self) -> SearchStatus:
        """The last one."""
        return self._status

    @property
    def is_to_end(self) -> bool:
        """Whether the node is to end: the atlas was refused, and no map is awaited."""
        return self._p.end_without_atlas and self._status.state == SearchState.NO_ATLAS and not self._source.builds

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
        if not self._source.has_atlas:
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
        self._pairing.put_meetpoint(meetpoint)
        return self._advance("meetpoint")

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
            self._pairing.clear()
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
        self._pairing.put_traversal(traversal, stamp_ns)
        return self._advance("edge_traversal")

    def node_visits(self, node: np.ndarray, r_m: np.ndarray) -> List[Decision]:
        """A robot that knows its pose passed nodes (K,), and saw them at these distances (K,) from the obstacles.

        Args:
            node: of the atlas.
            r_m: NaN where it passed a node without seeing it.
        """
        if self._localizer is None or not len(node):
            return []
        atlas = self._localizer.atlas
        if node.min() < 0 or node.max() >= len(atlas.nodes):
            text = f"node_visits refused: nodes must be 0 to {len(atlas.nodes) - 1}, got {node.tolist()}"
            return [LogLine(text, logging.WARNING, often=True)]
        missed = np.isnan(r_m)
        atlas.visits.add_nodes(node[~missed], r_m[~missed])
        atlas.visits.add_misses(node[missed])
        return [*self._source.save_visits(atlas)]

    def map_served(self, grid_map: GridMap, name: str) -> List[Decision]:
        """A map is served: it explains scans from now on, and the atlas must be made from it.

        Args:
            grid_map: it.
            name: for people, as "that of topic /map".
        """
        if self.takes_scans:
            self._explanation.take(grid_map)
        if self._source.builds:
            return self._request_atlas(grid_map, name)
        if not self._p.check_map:
            return []
        self._source.serve(grid_map, name)
        try:
            if self._localizer is None:
                return [self._load(), self._await_meetpoint("there is another map")]
            warning = self._source.check(self._localizer.atlas)
            return [LogLine(f"the atlas {warning}", logging.WARNING)] if warning else []
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
        if not self._source.is_served(grid_map):
            return []  # another map was served since
        if isinstance(atlas, AtlasError):
            reason = f"no atlas can be built from {self._source.map_name}: {atlas}"
            status = self._show(SearchState.NO_ATLAS, reason)
            return [LogLine(reason, logging.ERROR), status, *self._end_goal(reason)]
        self._source.take_built(atlas)
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

    def _request_atlas(self, grid_map: GridMap, name: str) -> List[Decision]:
        """Ask for an atlas of the served map, unless the present one was built from the same."""
        if self._localizer is not None:
            try:
                self._localizer.atlas.check_map(grid_map, name)
                return []
            except AtlasError:  # of another map
                self._localizer = None
        self._source.serve(grid_map, name)
        status = self._show(SearchState.NO_ATLAS, f"an atlas of {name} is being made")
        return [LogLine(status.reason), status, AtlasRequest(grid_map)]

    def _load(self) -> LogLine:
        """Load the atlas and forget the search; raises what AtlasSource.load() raises."""
        atlas, line = self._source.load()
        self._localizer = AtlasLocalizer(atlas, self._search_params, self._explanation if self.takes_scans else None)
        return line

    def _await_meetpoint(self, why: str) -> SearchStatus:
        return self._show(SearchState.WAITING, f"the search starts at the next meetpoint: {why}")

    def _show(self, state: SearchState, reason: str, stamp_ns: int = 0) -> SearchStatus:
        """Enter a state outside of a search; what was known is discarded."""
        self._pairing.clear()
        if self._localizer is not None:
            self._localizer.begin()
        self._status = SearchStatus(state, reason, stamp_ns)
        return self._status

    def _judgeable(self, meetpoint: Meetpoint) -> Meetpoint:
        """The meetpoint, without its scan if no map is available to judge the scan by."""
        return meetpoint if self.uses_scans else replace(meetpoint, scan=None)

    def _advance(self, kind: str) -> List[Decision]:
        """Advance the search by one edge once both reports, edge and meetpoint, have arrived."""
        estimate = self._status.estimate
        if self._localizer is None or estimate is None or estimate.done:
            self._pairing.clear()
            return [LogLine(f"{kind} not used: the search is {self._status.state}", often=True)]
        dropped = self._pairing.drop_older()
        if dropped is not None:
            return [dropped]
        pair = self._pairing.take()
        if pair is None:
            return []
        traversal, meetpoint = pair
        try:
            estimate = self._localizer.update(traversal, self._judgeable(meetpoint))
        except ObservationError as err:
            self._pairing.put_meetpoint(meetpoint)  # it waits for another traversal
            return [LogLine(f"edge_traversal refused: {err}", logging.WARNING, often=True)]
        return self._judge(self._localizer, estimate, meetpoint.stamp_ns)

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
            localizer.count_visits(localizer.atlas.visits)  # what was measured on the confirmed path
            decisions += self._source.save_visits(localizer.atlas)
            if self._p.publish_initial_pose:
                decisions.append(InitialPose(status.map_from_base, stamp_ns))
            decisions += self._end_goal(estimate.reason, GoalOutcome.SUCCEEDED)
        elif estimate.done:
            decisions += self._end_goal(estimate.reason)
        return decisions

    def _end_goal(self, reason: str, outcome: GoalOutcome = GoalOutcome.ABORTED) -> List[Decision]:
        """Finish the current goal, if any, with the present result."""
        if self._goal is None:
            return []
        self._goal = None
        return [GoalEnd(outcome, reason, self._status)]
