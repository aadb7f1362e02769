"""wakeup_demo: tells how a robot wakes up, sends it on a tour of the building, and measures both.

Listens beside launch/wakeup.launch; the robot is found without it. Once the search is over and CONFIRMED it sends goals
to goto_node, one after the other, prints the errors against the simulator's truth and writes a picture.

Subscribes: meetpoint, edge_traversal, turn_choice, topology_status, topology_candidates, initialpose, amcl_pose,
    localization_status, ground_truth, map.
Calls: restart_search (Trigger), when the search is LOST.
Parameters: WakeupDemoParams. Exit code: 0 if the place was right and the tour was driven, 1 if not, 2 for a parameter
    that cannot be used.
"""

from __future__ import annotations

import math
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional

import actionlib
import numpy as np
import rospy
from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid
from std_srvs.srv import Trigger

from glass_nav import params
from glass_nav.evaluation.metrics import pose_errors
from glass_nav.evaluation.plots import wake_up_picture
from glass_nav.evaluation.plots.wake_up_picture import Depth, WakeUpStory
from glass_nav.geometry import angles
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.msg import (
    EdgeTraversal,
    GotoNodeAction,
    GotoNodeGoal,
    GotoNodeResult,
    LocalizationStatus,
    Meetpoint,
    TopologyCandidates,
    TopologyStatus,
)
from glass_nav.ros import conversions, shutdown
from glass_nav.ros.mailbox import Mailbox
from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.topology.atlas.atlas import Atlas
from glass_nav.topology.observations import turn_name

RIGHT_M, RIGHT_RAD = 0.5, 0.35  # a pose that is handed over so near is right
DONE = ("CONFIRMED", "AMBIGUOUS", "LOST")
ASKED = 3  # times for a node, if the driver knows of no localization yet
MIN_ROOM_M = 0.5  # around nodes of the tour
MIN_LEG_M, LEG_M = 2.0, 8.0  # from node to node, at least and about
LEG_CHOICES = 4  # nodes of which one is drawn


@dataclass(frozen=True)
class WakeupDemoParams:
    """Private parameters of the node."""

    atlas: str = ""  # of the building
    picture: str = ""  # file of the picture; empty: none
    searches: int = 3  # a robot that is LOST begins anew where it stands, so often at most
    tour: int = 4  # nodes to be driven to
    seed: int = 0  # of which
    search_limit_s: float = 900.0  # simulated, for one search
    tour_limit_s: float = 300.0  # simulated, for each node
    start_limit_s: float = 60.0  # of the wall clock, until something is heard

    def __post_init__(self) -> None:
        if not self.atlas:
            raise ValueError("~atlas must be a file, a folder or the name of a shipped atlas, got ''")
        if self.tour < 0 or self.seed < 0:
            raise ValueError(f"~tour and ~seed must be >= 0, got {self.tour} and {self.seed}")
        if self.searches < 1:
            raise ValueError(f"~searches must be >= 1, got {self.searches}")
        for name in ("search_limit_s", "tour_limit_s", "start_limit_s"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"~{name} must be > 0 and finite, got {getattr(self, name)}")


class WakeupDemo:
    """Keeps what it hears; run() tells it in order."""

    def __init__(self, p: WakeupDemoParams) -> None:
        """Raises AtlasError."""
        self._p = p
        self._atlas: Atlas = atlas_file.load(shipped_atlases.find(p.atlas))
        self._inbox = Mailbox(events=1000)
        self._truth: Dict[int, np.ndarray] = {}  # by stamp
        self._poses: Dict[int, np.ndarray] = {}  # of the localization, by stamp
        self._meetpoints: Dict[int, Meetpoint] = {}
        self._traversals: Dict[int, EdgeTraversal] = {}
        self._candidates: Dict[int, TopologyCandidates] = {}
        self._status: Optional[TopologyStatus] = None
        self._localization = ""
        self._handed_over: Optional[PoseWithCovarianceStamped] = None
        self._map: Optional[OccupancyGrid] = None
        self._depths: List[Depth] = []
        self._degree_before = 0
        self._waiting_rows: List[TopologyStatus] = []  # that came while the parts of one before were waited for
        self._confirmed_ns = 0
        self._client = actionlib.SimpleActionClient("goto_node", GotoNodeAction)
        for topic, kind in (
            ("ground_truth", PoseStamped),
            ("amcl_pose", PoseWithCovarianceStamped),
            ("meetpoint", Meetpoint),
            ("edge_traversal", EdgeTraversal),
            ("topology_candidates", TopologyCandidates),
            ("topology_status", TopologyStatus),
            ("localization_status", LocalizationStatus),
            ("initialpose", PoseWithCovarianceStamped),
            ("map", OccupancyGrid),
        ):
            rospy.Subscriber(
                topic,
                kind,
                lambda msg, topic=topic: self._inbox.put("events", (topic, msg)),
                queue_size=200,
                buff_size=2**22,
                tcp_nodelay=True,
            )

    def run(self, ending: threading.Event) -> int:
        """Exit code."""
        self._ending = ending
        if not self._wait(lambda: bool(self._truth) and self._map is not None, wall_s=self._p.start_limit_s):
            self._print("nothing is heard: is launch/wakeup.launch running?")
            return 1
        start = self._truth[min(self._truth)]
        self._print(
            f"wakes up at x {start[0]:.2f} m, y {start[1]:.2f} m, yaw {math.degrees(start[2]):.0f} degrees, "
            "which it does not know"
        )
        for searches_left in reversed(range(self._p.searches)):
            if not self._wait(
                lambda: self._status is not None and self._status.state_name in DONE, simulated_s=self._p.search_limit_s
            ):
                if not self._is_ending():
                    self._print(f"the search did not end within {self._p.search_limit_s:g} s")
                self._draw("still searching")
                return 1
            assert self._status is not None
            if self._status.state_name != "LOST" or not searches_left or not self._search_anew():
                break
        right = self._tell_outcome(self._status)
        toured = self._drive_tour() if right else False
        self._draw(self._status.state_name)
        return 0 if right and toured else 1

    # -- the search

    def _tell_outcome(self, status: TopologyStatus) -> bool:
        """Whether the place is known, and right."""
        if status.state_name != "CONFIRMED":
            self._print(f"{status.state_name}: {status.reason}")
            msg = self._candidates.get(conversions.ns_from_stamp(status.header.stamp))
            for pose in [] if msg is None else msg.poses[:10]:
                x, y, yaw = conversions.planar_from_pose(pose)
                self._print(f"  it could be at x {x:.2f} m, y {y:.2f} m, yaw {math.degrees(yaw):.0f} degrees")
            return False
        self._wait(lambda: self._handed_over is not None, wall_s=5.0)
        if self._handed_over is None:
            self._print("CONFIRMED, but no initialpose came")
            return False
        stamp_ns = conversions.ns_from_stamp(self._handed_over.header.stamp)
        said = conversions.planar_from_pose(self._handed_over.pose.pose)
        true = self._true_at(stamp_ns)
        off_m = float(np.hypot(*(said - true)[:2]))
        off_rad = abs(float(angles.wrap(said[2] - true[2])))
        right = off_m < RIGHT_M and off_rad < RIGHT_RAD
        self._print(
            f"CONFIRMED behind {status.depth} edges, {'right' if right else 'WRONG'}: hands over "
            f"x {said[0]:.2f} m, y {said[1]:.2f} m, {off_m:.3f} m and {math.degrees(off_rad):.1f} degrees off "
            "the truth"
        )
        return right

    def _search_anew(self) -> bool:
        """Whether there will be another search, from the meetpoint where the robot stands."""
        assert self._status is not None
        try:
            rospy.ServiceProxy("restart_search", Trigger)()
        except rospy.ServiceException as err:
            self._print(f"no new search: {err}")
            return False
        if not self._wait(lambda: self._status is not None and self._status.state_name != "LOST", wall_s=10.0):
            return False
        self._print("LOST: it forgets the search and begins anew where it stands")
        return True

    def _tell_depth(self, status: TopologyStatus) -> None:
        """One row of the search forest: the match edge, the match node, what is left, the turn."""
        stamp_ns = conversions.ns_from_stamp(status.header.stamp)
        self._wait(
            lambda: stamp_ns in self._meetpoints
            and stamp_ns in self._candidates
            and self._candidates[stamp_ns].total == status.candidates,
            wall_s=2.0,
            nested=True,
        )
        meetpoint, candidates = self._meetpoints.get(stamp_ns), self._candidates.get(stamp_ns)
        if meetpoint is None or candidates is None:
            return
        if status.depth == 0:
            self._depths = []
        self._print(f"search depth {status.depth}")
        traversal = self._traversals.get(stamp_ns)
        if traversal is not None and status.depth:
            before = self._degree_before
            name = turn_name(traversal.rank, before) if before > traversal.rank else f"RANK_{traversal.rank}"
            self._print(
                f"  match edge E{status.depth - 1}: {name}, length {traversal.length:.2f} m, chord "
                f"{traversal.chord:.2f} m"
            )
        self._degree_before = meetpoint.degree
        self._print(f"  match node M{status.depth}: degree {meetpoint.degree}, r {meetpoint.r:.2f} m")
        places = [f"{node} along {edge}" for node, edge in zip(candidates.nodes, candidates.edges)]
        more = f", and {candidates.total - 8} more" if candidates.total > 8 else ""
        self._print(
            f"  {candidates.total} candidate{'s' * (candidates.total != 1)} (node along edge): "
            f"{', '.join(places[:8]) or 'none'}{more}"
        )
        turn = f"; votes for {status.turn}" if status.turn else ""
        self._print(f"  {status.state_name}: {status.reason}{turn}")
        self._depths.append(
            Depth(
                np.array([conversions.planar_from_pose(pose) for pose in candidates.poses]).reshape(-1, 3),
                self._true_at(stamp_ns),
                status.turn or status.state_name,
            )
        )

    # -- the tour

    def _drive_tour(self) -> bool:
        """Whether every node was reached."""
        assert self._status is not None
        self._confirmed_ns = conversions.ns_from_stamp(self._status.header.stamp)
        if not self._wait(lambda: self._localization == "LOCALIZED", simulated_s=60.0):
            self._print(f"the localization is {self._localization or 'silent'}, not LOCALIZED: no tour")
            return False
        if not self._client.wait_for_server(rospy.Duration(10.0)):
            self._print("no action server goto_node")
            return False
        reached = True
        for node in self._tour():
            ended = self._go_to(node)
            if self._is_ending():
                return False
            if not ended:
                self._client.cancel_goal()
                self._print(f"goto_node {node}: not there within {self._p.tour_limit_s:g} s")
                reached = False
                continue
            result = self._client.get_result()
            succeeded = self._client.get_state() == GoalStatus.SUCCEEDED
            off_m = float(np.hypot(*(self._newest_truth()[:2] - self._atlas.nodes.position_m[node])))
            self._print(
                f"goto_node {node}: {result.reason}, {result.travelled:.1f} m driven; truly {off_m:.2f} m from the node"
            )
            reached = reached and succeeded
        self._tell_tracking()
        return reached

    def _go_to(self, node: int) -> bool:
        """Whether the goal came to an end, whatever it was. The driver may hear of the localization a little later than
        this node does, and is then asked again.
        """
        for _ in range(ASKED):
            self._client.send_goal(GotoNodeGoal(node=node))
            if not self._wait(
                lambda: self._client.get_result() is not None,  # its state may be known before
                simulated_s=self._p.tour_limit_s,
            ):
                return False
            if self._client.get_result().code != GotoNodeResult.NOT_LOCALIZED:
                break
            self._wait(self._is_ending, simulated_s=1.0)
        return True

    def _tour(self) -> List[int]:
        """Nodes one after the other, not far from each other, along edges that a robot fits through."""
        rng = np.random.default_rng(self._p.seed)
        atlas = self._atlas
        _, part = atlas.components()
        position = atlas.nodes.position_m
        here = self._newest_truth()[:2]
        at = int(np.argmin(np.hypot(*(position - here).T)))
        nodes: List[int] = []
        for _ in range(self._p.tour):
            away_m = np.hypot(*(position - position[at]).T)
            fits = (part == part[at]) & (atlas.nodes.r_m > MIN_ROOM_M) & (away_m > MIN_LEG_M)
            fits[nodes] = False
            choices = [node for node in np.argsort(np.abs(away_m - LEG_M)).tolist() if fits[node]][:LEG_CHOICES]
            if not choices:
                break
            at = int(rng.choice(choices))
            nodes.append(at)
        return nodes

    def _tell_tracking(self) -> None:
        stamps = np.array(sorted(stamp for stamp in self._poses if stamp >= self._confirmed_ns), np.int64)
        true_ns = np.array(sorted(self._truth), np.int64)
        reference = Trajectory(true_ns, np.array([self._truth[stamp] for stamp in true_ns.tolist()]))
        estimates = np.array([self._poses[stamp] for stamp in stamps.tolist()]).reshape(-1, 3)
        figures = pose_errors.summary(pose_errors.of(stamps, estimates, reference))
        way_m = sum(np.hypot(*np.diff(self._way(self._confirmed_ns), axis=0).T)) if len(stamps) else 0.0
        if figures["position_mean_m"] is None:
            self._print("tracking: no pose of the localization")
            return
        self._print(
            f"tracking over {way_m:.0f} m: mean {figures['position_mean_m']:.3f} m, 95 % within "
            f"{figures['position_p95_m']:.3f} m, most {figures['position_max_m']:.3f} m; heading mean "
            f"{figures['yaw_mean_deg']:.2f} degrees, at {len(stamps)} scans"
        )

    # -- what is heard

    def _wait(
        self,
        condition: Callable[[], bool],
        simulated_s: float = math.inf,
        wall_s: float = math.inf,
        nested: bool = False,
    ) -> bool:
        """Take in what comes until the condition holds, or too much time has passed."""
        began_s, wall_began_s = self._simulated_s(), time.monotonic()
        while not self._is_ending():
            if condition():
                return True
            if self._simulated_s() - began_s > simulated_s or time.monotonic() - wall_began_s > wall_s:
                return False
            rows: List[TopologyStatus] = []
            for topic, msg in self._inbox.take(timeout_s=0.05)["events"]:
                row = self._hear(topic, msg)
                if row is not None:
                    rows.append(row)
            if nested:
                self._waiting_rows += rows
                continue
            while rows:
                self._tell_depth(rows.pop(0))
                rows, self._waiting_rows = self._waiting_rows + rows, []
        return False

    def _is_ending(self) -> bool:
        return bool(rospy.is_shutdown() or self._ending.is_set())

    def _hear(self, topic: str, msg: Any) -> Optional[TopologyStatus]:
        """A row of the search, if the message is one."""
        stamp_ns = 0 if topic == "map" else conversions.ns_from_stamp(msg.header.stamp)
        if topic == "ground_truth":
            self._truth[stamp_ns] = conversions.planar_from_pose(msg.pose)
        elif topic == "amcl_pose":
            self._poses[stamp_ns] = conversions.planar_from_pose(msg.pose.pose)
        elif topic == "meetpoint":
            self._meetpoints[stamp_ns] = msg
        elif topic == "edge_traversal":
            self._traversals[stamp_ns] = msg
        elif topic == "topology_candidates":
            self._candidates[stamp_ns] = msg
        elif topic == "localization_status":
            self._localization = msg.state_name
        elif topic == "initialpose":
            self._handed_over = msg
        elif topic == "map":
            self._map = msg
        else:
            before, self._status = self._status, msg
            new = before is None or before.header.stamp != msg.header.stamp
            return msg if new and stamp_ns else None
        return None

    def _true_at(self, stamp_ns: int) -> np.ndarray:
        stamps = np.array(sorted(self._truth), np.int64)
        return Trajectory(stamps, np.array([self._truth[stamp] for stamp in stamps.tolist()])).at(np.int64(stamp_ns))

    def _newest_truth(self) -> np.ndarray:
        return self._truth[max(self._truth)]

    def _simulated_s(self) -> float:
        """Time of the newest truth: that of rospy may come later than what is heard."""
        return max(self._truth, default=0) * 1e-9

    def _way(self, from_ns: int, to_ns: float = math.inf) -> np.ndarray:
        """(N, 2) true way between two stamps."""
        return np.array([self._truth[stamp][:2] for stamp in sorted(self._truth) if from_ns <= stamp <= to_ns]).reshape(
            -1, 2
        )

    # -- output

    def _draw(self, outcome: str) -> None:
        if not self._p.picture or self._map is None:
            return
        grid = conversions.map_from_msg(self._map)
        until = self._confirmed_ns or math.inf
        handed = None if self._handed_over is None else conversions.planar_from_pose(self._handed_over.pose.pose)
        last_ns = max(self._poses, default=0)
        story = WakeUpStory(
            self._depths,
            self._way(0, until),
            self._way(self._confirmed_ns) if self._confirmed_ns else np.zeros((0, 2)),
            handed,
            self._poses.get(last_ns),
            self._truth.get(last_ns),
        )
        path = Path(self._p.picture)
        path.parent.mkdir(parents=True, exist_ok=True)
        wake_up_picture.draw(
            path,
            grid,
            story,
            f"{self._atlas.name}: {outcome} behind {max(len(self._depths) - 1, 0)} edges",
        )
        self._print(f"picture: {path}")

    @staticmethod
    def _print(line: str) -> None:
        sys.stdout.write(f"{line}\n")
        sys.stdout.flush()


def main() -> None:
    """Start; see the exit codes above."""
    rospy.init_node("wakeup_demo", disable_signals=True)
    ending = shutdown.event_on_signals()
    given: Dict[str, Any] = rospy.get_param("~", {})
    try:
        demo = WakeupDemo(params.load(WakeupDemoParams, given, rospy.get_name()))
    except (ValueError, OSError) as err:  # ParamError, AtlasError
        shutdown.refuse_to_start(err)
    code = 1
    try:
        code = demo.run(ending)
    finally:
        rospy.signal_shutdown("ended")
    sys.exit(code)
