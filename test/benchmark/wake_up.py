#!/usr/bin/env python3
"""Whole wake-ups without ROS: simulated robots that know nothing find out where they are, and drive a tour.

Driver, SearchSession and Localizer decide, as in the nodes, wired as by their topics. A robot is put
at a random place of a building, seeks a meetpoint, and drives as the votes say until the search is over; then it hands
its pose over to the localization and drives to nodes of the atlas. Right: CONFIRMED within 0.5 m and 20 degrees of the
truth; wrong: CONFIRMED elsewhere, or any place reported with --elsewhere. A collision is a control step
in which the base stood at an obstacle.

    test/benchmark/wake_up.py --opaque --seeds 14        # film on all glass; all buildings, or --buildings A B
    test/benchmark/wake_up.py --lidars sensitive weak coated --jobs 2
    test/benchmark/wake_up.py --buildings twin_wings four_wings half_turn tower --no-tour --plan   # parts that look alike
    test/benchmark/wake_up.py --elsewhere --no-tour   # each robot has the map of another floor of the list
    test/benchmark/wake_up.py --graph-only --limit 300   # the same robots by the forest alone
    test/benchmark/wake_up.py --scans-alone   # the localization's own search looks at the same scans of the same drive

plan: edges of the best plan that knows the map (best_plan.py), where the first meetpoint leaves several places.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Optional

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import best_plan
import floors
import numpy as np

from glass_nav.demo.wired_robot import WiredRobot
from glass_nav.driving.driver_params import DriveParams
from glass_nav.driving.edge_tracking.edge_driver import Arrival
from glass_nav.driving.route import RoutePlanner
from glass_nav.geometry import angles, se2
from glass_nav.hypotheses.scan_explanation import ScanExplanation
from glass_nav.localization.localizer import Localizer
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.simulation import lidar, shipped_buildings, start_place
from glass_nav.simulation.simulation import Frame, Simulation
from glass_nav.topology.search.belief import NO_DART
from glass_nav.topology.search.expected_views import ExpectedViews
from glass_nav.topology.search.search_estimate import SearchEstimate
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.topology.search_decisions import SearchStatus
from glass_nav.topology.search_session import SearchSession
from glass_nav.topology.session_params import SessionParams
from glass_nav.vocabulary import LocalizationState, Outcome, SearchState
from glass_nav.world.grid_map import GridMap

LEG_S = 120.0  # simulated, at most
MAX_EDGES = 60
OTHER_SEED = 1000  # from a random floor to the one whose map a robot has that is elsewhere
SOON_S = 90.0
LEGS = 3
RIGHT_M, RIGHT_RAD = 0.5, math.radians(20.0)
MIN_LEG_M, MAX_LEG_M, LEG_ROOM_M = 4.0, 15.0, 0.45


class Job(NamedTuple):
    """One robot."""

    building: str
    lidar: str
    opaque: bool
    seed: int
    scans: bool  # are evidence
    tour: bool
    believed: str  # building whose map and atlas the robot is given
    elsewhere: bool  # that is another one
    alone: bool  # the search of the localization gets the same scans
    limit_s: float  # simulated, of the search
    scan_rate_hz: float
    plan: bool  # the best one is looked for
    anywhere: bool  # also behind gaps that no robot gets through
    verbose: bool


class Cost:
    """CPU seconds of the slowest call."""

    def __init__(self) -> None:
        self.slowest_s = 0.0

    def timed(self, call: Callable[..., List[Any]]) -> Callable[..., List[Any]]:
        """The same, measured."""

        def measured(*arguments: Any) -> List[Any]:
            began = time.process_time()
            decided = call(*arguments)
            self.slowest_s = max(self.slowest_s, time.process_time() - began)
            return decided

        return measured


class ScansAlone:
    """The search of the localization without a forest: the first place that it reports as LOCALIZED."""

    def __init__(self, grid_map: GridMap, seed: int) -> None:
        self._localizer = Localizer(LocalizerParams(), grid_map, np.random.default_rng([seed, 3]))
        self._localizer.scatter()
        self.state, self.seconds = "UNDECIDED", math.nan

    @property
    def is_decided(self) -> bool:
        return self.state != "UNDECIDED"

    def see(self, frame: Frame, now_s: float) -> None:
        """One more scan, until it has decided."""
        if self.is_decided:
            return
        estimate = self._localizer.update(frame.scan, frame.odom_from_base)
        if estimate.state == LocalizationState.LOCALIZED:
            right = is_right(estimate.map_from_base, frame.map_from_base)
            self.state, self.seconds = "RIGHT" if right else "WRONG", now_s


def is_right(pose: np.ndarray, truth: np.ndarray) -> bool:
    """Whether a pose (3,) is near enough to the truth (3,)."""
    off_m = float(np.hypot(*(pose[:2] - truth[:2])))
    return off_m < RIGHT_M and abs(float(angles.wrap(pose[2] - truth[2]))) < RIGHT_RAD


class Trial:
    """One robot in one building."""

    def __init__(self, job: Job) -> None:
        building, self.grid_map, self.atlas = floors.load(job.building, job.seed, job.opaque)
        if job.elsewhere:
            _, self.grid_map, self.atlas = floors.load(job.believed, job.seed + OTHER_SEED, job.opaque)
        self.job = job
        passage_m = 0.0 if job.anywhere else start_place.PASSAGE_M
        start = start_place.random_place(building, np.random.default_rng([job.seed, 1]), passage_m)
        self.simulation = Simulation(
            building, lidar.preset(job.lidar), seed=job.seed, scan_rate_hz=job.scan_rate_hz, start=start
        )
        self.drive = DriveParams()
        self.cost = Cost()
        session = SearchSession(
            lambda: (self.atlas.name, self.atlas),
            SessionParams(),
            SearchParams(use_scans=job.scans),
        )
        session.scan = self.cost.timed(session.scan)  # type: ignore[method-assign]
        session.meetpoint = self.cost.timed(session.meetpoint)  # type: ignore[method-assign]
        session.edge_traversal = self.cost.timed(session.edge_traversal)  # type: ignore[method-assign]
        self.robot = WiredRobot(self.simulation, self.drive, self.atlas, session)
        self.alone = ScansAlone(self.grid_map, job.seed) if job.alone else None
        self.plan: Optional[int] = None
        if job.verbose:
            self.robot.on_status = self._print
        self.rng = np.random.default_rng([job.seed, 2])
        self._last_node = -1
        self._shown: Optional[SearchEstimate] = None
        self._began_ns = self.simulation.stamp_ns

    @property
    def now_s(self) -> float:
        """Simulated time since the start."""
        return (self.simulation.stamp_ns - self._began_ns) * 1e-9

    # -- the search

    def search(self) -> Dict[str, Any]:
        """Run until the search is over, or driving has stopped."""
        robot = self.robot
        robot.wake_up(self.grid_map)
        step_s, truth = 0.0, self.simulation.map_from_base
        while self.now_s < self.job.limit_s and not robot.has_given_up:
            began = time.process_time()
            frame = robot.step()
            step_s = max(step_s, time.process_time() - began)
            truth = frame.map_from_base
            if self.alone is not None:
                self.alone.see(frame, self.now_s)
            estimate = robot.session.status.estimate
            if self.plan is None and estimate is not None and self.job.plan:
                self.plan = self._best_plan()
            if estimate is not None and (estimate.done or estimate.depth >= MAX_EDGES):
                break
        estimate = robot.session.status.estimate
        return {
            "state": "NO_MEETPOINT" if estimate is None else estimate.state,
            "failures": robot.failures,
            "edges": -1 if estimate is None else estimate.depth,
            "search_s": self.now_s,
            "step_s": step_s,  # of driver, search and simulation together
            "session_s": self.cost.slowest_s,  # the slowest step of the search alone
            "best_plan": self.plan,
            "candidates": -1 if estimate is None else len(estimate.dart),
            "reason": "" if estimate is None else estimate.reason,
            **self._errors(estimate, truth),
        }

    def _best_plan(self) -> Optional[int]:
        """Of a robot that stands at its first meetpoint, if several places are left to it."""
        localizer, belief = self.robot.session.localizer, self.robot.session.status.belief
        if localizer is None or belief is None or self.robot.arrival is None:
            return None
        left = belief.left(localizer.params.tolerances.risk)
        true = [k for k in left.tolist() if is_right(belief.poses[k], self.simulation.map_from_base)]
        if not true or len(left) < 2 or belief.dart[true[0]] == NO_DART:
            return None if true and len(left) > 1 else 0
        views = ExpectedViews(localizer.matcher.atlas, ScanExplanation(self.grid_map))
        left = left[belief.dart[left] != NO_DART]
        plan = best_plan.BestPlan(localizer.matcher, views, belief.dart[left], belief.poses[left])
        return plan.edges(left.tolist().index(true[0]))

    def _print(self, status: SearchStatus) -> None:
        estimate, arrival = status.estimate, self.robot.arrival
        if estimate is not None and arrival is not None and estimate is not self._shown:
            self._shown = estimate
            print(
                f"{self.now_s:7.1f} s depth {estimate.depth} {estimate.state}: {estimate.reason}; rank "
                f"{estimate.choice.rank if estimate.choice else '-'}; {self._truth(arrival)}{self._belief()}",
                flush=True,
            )

    def _truth(self, arrival: Arrival) -> str:
        """What the meetpoint really is."""
        at = se2.transform_points(self.simulation.map_from_base, arrival.meetpoint.centre_m)
        away = np.hypot(*(self.atlas.nodes.position_m - at).T)
        node = int(away.argmin())
        return (
            f"node {node} {away[node]:.2f} m off, degree {arrival.meetpoint.degree} of {self.atlas.degree[node]}, "
            f"r {arrival.meetpoint.r_m:.2f} of {self.atlas.nodes.r_m[node]:.2f} m{self._edge_truth(arrival, node)}"
        )

    def _belief(self) -> str:
        """The likeliest place, and its error."""
        belief = self.robot.session.status.belief
        if belief is None or not len(belief):
            return ""
        off_m = float(np.hypot(*(belief.poses[0] - self.simulation.map_from_base)[:2]))
        return (
            f"; belief: {len(belief)} places, {belief.share[0]:.4f}, elsewhere {belief.elsewhere:.4f}, scans "
            f"{belief.scan_nats[0]:.1f}, graph {belief.graph_nats[0]:.1f}, {off_m:.2f} m off"
        )

    def _edge_truth(self, arrival: Arrival, node: int) -> str:
        """The edges between the last node and this one that are most like the driven path."""
        before, self._last_node = self._last_node, node
        driven = arrival.traversal
        if driven is None:
            return ""
        ends = self.atlas.darts.node.reshape(-1, 2)
        edges = np.flatnonzero((np.sort(ends, axis=1) == sorted((before, node))).all(axis=1)).tolist()
        lengths = [f"{self.atlas.edges.length_m[edge]:.2f}/{self.atlas.edges.chord_m[edge]:.2f}" for edge in edges]
        return (
            f"; rank {driven.rank} from node {before}, {driven.length_m:.2f}/{driven.chord_m:.2f} m of "
            f"{' or '.join(lengths) or 'no edge'}"
        )

    def _errors(self, estimate: Optional[SearchEstimate], truth: np.ndarray) -> Dict[str, Any]:
        """Against the true pose (3,) at the last scan."""
        pose = self.robot.initial_pose
        if (
            self.job.elsewhere
            and estimate is not None
            and estimate.state in (SearchState.CONFIRMED, SearchState.AMBIGUOUS)
        ):
            return {"right": False, "wrong": True, "error_m": math.nan}
        if pose is None:
            return {"right": False, "wrong": False, "error_m": math.nan}
        right = is_right(pose, truth)
        return {"right": right, "wrong": not right, "error_m": float(np.hypot(*(pose[:2] - truth[:2])))}

    # -- the tour

    def tour(self) -> Dict[str, Any]:
        """Drive to some nodes while the filter tracks."""
        robot = self.robot
        robot.localize(Localizer(LocalizerParams(), self.grid_map, self.rng))
        planner = RoutePlanner(self.atlas, self.drive.edge.limits, self.grid_map)
        off_m: List[float] = []
        outcomes = []
        for node in self._goals(planner):
            if self.alone is not None and self.alone.is_decided:
                break
            robot.step()  # the driver hears of the localization
            robot.goto(node)
            until_s, ended = self.now_s + LEG_S, len(robot.ends)
            while len(robot.ends) == ended and self.now_s < until_s:
                frame = robot.step()
                if self.alone is not None:
                    self.alone.see(frame, self.now_s)
                assert robot.estimate is not None
                off_m.append(float(np.hypot(*(robot.estimate.map_from_base - frame.map_from_base)[:2])))
            robot.give_up()
            outcomes.append("TIME" if self.now_s >= until_s else str(robot.ends[-1].ending.outcome))
        return {
            "legs": outcomes,
            "tracking_m": float(np.mean(off_m)) if off_m else math.nan,
            "tracking_max_m": float(np.max(off_m)) if off_m else math.nan,
        }

    def _goals(self, planner: RoutePlanner) -> Iterator[int]:
        for _ in range(LEGS):
            assert self.robot.map_from_base is not None
            here = self.robot.map_from_base[:2]
            for node in self.rng.permutation(len(self.atlas.nodes)).tolist():
                if self.atlas.nodes.r_m[node] < LEG_ROOM_M:
                    continue
                try:
                    route = planner.to_node(here, node)
                except ValueError:
                    continue
                if MIN_LEG_M <= route.length_m <= MAX_LEG_M:
                    yield node
                    break


def run(job: Job) -> Dict[str, Any]:
    """One robot, from waking up to the end of its tour."""
    began = time.process_time()
    trial = Trial(job)
    found = trial.search()
    if found["right"] and (job.tour or job.alone):
        found.update(trial.tour())
    if trial.alone is not None:
        found.update(scans_state=trial.alone.state, scans_s=trial.alone.seconds)
    return {
        **job._asdict(),
        **found,
        "collisions": trial.robot.collisions,
        "cpu_s": time.process_time() - began,
        "all_s": trial.now_s,
    }


def reported(found: Dict[str, Any]) -> str:
    """One run in one line."""
    verdict = ", right" if found["right"] else ", WRONG" if found["wrong"] else ""
    plan = "" if found["best_plan"] is None else f" (best plan {found['best_plan']})"
    alone = f"; scans alone {found['scans_state']} after {found['scans_s']:.0f} s" if "scans_state" in found else ""
    return (
        f"{found['building']} {found['lidar']} seed {found['seed']}: {found['state']}{verdict} after "
        f"{found['edges']} edges{plan}, {found['search_s']:.0f} s ({found['reason']}); {found['collisions']} collisions; "
        f"legs {found.get('legs', '-')}, tracking {found.get('tracking_m', math.nan):.3f} m; failures "
        f"{found['failures']}; {found['cpu_s']:.0f} s CPU{alone}"
    )


def line(name: str, runs: List[Dict[str, Any]]) -> str:
    """One row of the table."""
    right = [each for each in runs if each["right"]]
    states = [each["state"] for each in runs if not each["right"]]
    legs = [leg for each in right for leg in each.get("legs", [])]

    def mean(key: str) -> str:
        known = [each[key] for each in right if not math.isnan(each.get(key, math.nan))]  # small parts have no goals
        return f"{np.mean(known):.3f}" if known else "-"

    return (
        f"| {name} | {len(runs)} | {len(right)} | {sum(each['wrong'] for each in runs)} | "
        f"{', '.join(f'{states.count(state)} {state}' for state in sorted(set(states))) or '-'} | "
        f"{np.mean([each['edges'] for each in runs]):.1f} | {np.mean([each['search_s'] for each in runs]):.0f} | "
        f"{sum(each['collisions'] > 0 for each in runs)} | {mean('error_m')} | {mean('tracking_m')} | "
        f"{sum(leg == Outcome.SUCCEEDED for leg in legs)}/{len(legs)} |"
    )


def bars(runs: List[Dict[str, Any]]) -> str:
    """How many were right, and how fast, in some sentences; a robot that was not found took for ever."""
    seconds = np.sort([each["search_s"] if each["right"] else math.inf for each in runs])
    right = sum(each["right"] for each in runs)
    said = [
        f"{right} of {len(runs)} right ({right / len(runs):.1%}), {sum(each['wrong'] for each in runs)} wrong, "
        f"{sum(each['collisions'] > 0 for each in runs)} with a collision; CONFIRMED after "
        f"{seconds[(len(seconds) - 1) // 2]:.0f} s in the median, "
        f"{np.mean(seconds <= SOON_S):.1%} within {SOON_S:.0f} s",
        f"slowest step {max(each['step_s'] for each in runs):.2f} s of CPU, of the search alone "
        f"{max(each['session_s'] for each in runs):.2f} s",
    ]
    planned = [(each["edges"], each["best_plan"]) for each in runs if each["best_plan"]]
    if planned:
        driven, best = np.array(planned).T
        said.append(
            f"where edges were needed ({len(planned)} robots): {driven.sum()} driven, {best.sum()} by the best plans "
            f"({driven.sum() / best.sum():.2f} times)"
        )
    alone = [each for each in runs if "scans_state" in each]
    if alone:
        states = [each["scans_state"] for each in alone]
        sooner = sum(each["scans_s"] <= each["search_s"] for each in alone)
        median_s = np.nanmedian([each["scans_s"] for each in alone])
        said.append(
            f"scans alone: {states.count('RIGHT')} right, {states.count('WRONG')} wrong, {states.count('UNDECIDED')} "
            f"undecided; those that decided after {median_s:.0f} s in the median, {sooner} of them no later than both"
        )
    return "\n".join(said)


def main() -> None:
    """Run all, print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--buildings", nargs="+", default=list(shipped_buildings.shipped()), help=floors.HELP)
    parser.add_argument("--lidars", nargs="+", default=["sensitive"], choices=list(lidar.PRESETS))
    parser.add_argument("--opaque", action="store_true", help="film on all glass")
    parser.add_argument("--seeds", type=int, default=2, help="robots in each building with each lidar")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--graph-only", action="store_true", help="scans are no evidence")
    parser.add_argument("--limit", type=float, default=900.0, metavar="S", help="simulated, of each search")
    parser.add_argument(
        "--scan-rate", type=float, default=10.0, metavar="HZ", help="of the lidar; 5 takes half the CPU"
    )
    parser.add_argument("--plan", action="store_true", help="compare with the best plan that knows the map")
    parser.add_argument(
        "--elsewhere",
        action="store_true",
        help="give each robot the map and atlas of another floor of the list: all are to be LOST",
    )
    parser.add_argument(
        "--scans-alone", action="store_true", help="the localization searches by the scans of the same drive"
    )
    parser.add_argument(
        "--anywhere",
        action="store_true",
        help="robots begin in any part of a floor, not only in the one that its own start is in",
    )
    parser.add_argument("--no-tour", action="store_true", help="a robot that is found drives no tour")
    parser.add_argument("--verbose", action="store_true", help="tell each step")
    parser.add_argument("--out", type=Path, help="file for all figures, json")
    arguments = parser.parse_args()
    names = arguments.buildings
    jobs = [
        Job(
            building,
            name,
            arguments.opaque,
            seed,
            not arguments.graph_only,
            not arguments.no_tour,
            names[(k + 1 + seed % max(len(names) - 1, 1)) % len(names)] if arguments.elsewhere else building,
            arguments.elsewhere,
            arguments.scans_alone,
            arguments.limit,
            arguments.scan_rate,
            arguments.plan,
            arguments.anywhere,
            arguments.verbose,
        )
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds)
        for k, building in enumerate(names)
        for name in arguments.lidars
    ]
    runs: List[Dict[str, Any]] = []
    with ProcessPoolExecutor(arguments.jobs) as pool:
        for found in pool.map(run, jobs):
            runs.append(found)
            print(reported(found), file=sys.stderr, flush=True)
            if arguments.out:
                arguments.out.write_text(json.dumps(runs, indent=1))
    print(
        "| building | robots | right | wrong | others | edges | search, s | with a collision | error, m | "
        "tracking, m | legs |\n|---|---|---|---|---|---|---|---|---|---|---|"
    )
    for name in arguments.buildings:
        print(line(name, [each for each in runs if each["building"] == name]))
    print(line("all", runs))
    print(f"\n{bars(runs)}")


if __name__ == "__main__":
    main()
