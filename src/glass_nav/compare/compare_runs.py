"""The runs behind a comparison: who takes part, over which logs, and one of these runs from start to end."""

from __future__ import annotations

import argparse
import os
import time
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Optional, Sequence, Tuple

import numpy as np

from glass_nav.cli import replay
from glass_nav.cli.replay import Prepared
from glass_nav.evaluation.metrics import comparison, pose_errors, replay_result
from glass_nav.evaluation.metrics.comparison import Run
from glass_nav.geometry import se2
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.recording.recording import Entry, RecordingError, Step
from glass_nav.replay import replay_params

DEFAULT = "default"
RECORDED = ("topic:", "tf:")
_Listed = Tuple[Tuple[Path, ...], Path, Optional[str], Optional[Tuple[float, float, float]]]  # the fields of Log
CARRY_NS = 100_000_000  # a recorded pose may be so much older or newer than the scans' odometry


@dataclass(frozen=True)
class Contestant:
    """Who takes part: one of results, parameters, recorded."""

    name: str
    results: Tuple[Path, ...] = ()  # folders of replays, a run each
    params: Optional[Path] = None  # None and nothing else: the defaults
    recorded: Optional[str] = None  # "topic:/amcl_pose", "tf:map"

    @property
    def runs(self) -> bool:
        """Whether there is something to run, over logs."""
        return not self.results


@dataclass(frozen=True)
class Log:
    """One log, with what belongs to it alone."""

    name: str
    paths: Tuple[Path, ...]
    map: Path
    ground_truth: Optional[str] = None
    initial_pose: Optional[Tuple[float, float, float]] = None


@dataclass(frozen=True)
class Job:
    """One run to be made, as it is sent to whoever makes it."""

    contestant: Contestant
    log: str
    seed: Optional[int]  # None: recorded poses
    arguments: argparse.Namespace  # of glass_nav replay

    def __str__(self) -> str:
        return f"{self.contestant.name} over {self.log}" + ("" if self.seed is None else f", seed {self.seed}")


def contestants(texts: Sequence[str]) -> List[Contestant]:
    """Those of the command line, `[NAME=]WHAT` each; folders of one name are runs of one contestant.

    Raises:
        ValueError: a name twice, or what is none of the kinds; one line.
    """
    found: Dict[str, Contestant] = {}
    for text in texts:
        name, what = _named(text)
        contestant = _contestant(name, what)
        if name in found:
            if found[name].runs or contestant.runs:
                raise ValueError(f"two contestants are named {name}: give them names, NAME={what}")
            contestant = Contestant(name, found[name].results + contestant.results)
        found[name] = contestant
    return list(found.values())


def _named(text: str) -> Tuple[str, str]:
    name, mark, what = text.partition("=")
    if mark and not os.path.exists(text):
        if not name or not what:
            raise ValueError(f"expected NAME=WHAT, got '{text}'")
        return name, what
    return text.rstrip("/"), text


def _contestant(name: str, what: str) -> Contestant:
    if what == DEFAULT:
        return Contestant(name)
    if what.startswith(RECORDED):
        if not what.partition(":")[2]:
            raise ValueError(f"expected topic:/TOPIC or tf:FRAME, got '{what}'")
        return Contestant(name, recorded=what)
    if what.endswith((".yaml", ".yml")):
        return Contestant(name, params=Path(what))
    if Path(what).is_dir():
        return Contestant(name, (Path(what),))
    raise ValueError(
        f"{what}: expected a folder of results, a .yaml of parameters, '{DEFAULT}', topic:/TOPIC or tf:FRAME"
    )


def logs(pairs: Sequence[str], listing: Optional[Path]) -> List[Log]:
    """Those of --log BAG=MAP and of the list.

    Raises:
        ValueError: not of that form; one line.
    """
    found: List[_Listed] = []
    for pair in pairs:
        log, mark, grid = pair.rpartition("=")
        if not (mark and log and grid):
            raise ValueError(f"--log must be BAG=MAP, got '{pair}'")
        found.append(((Path(log),), Path(grid), None, None))
    if listing is not None:
        found += [_listed(listing, number, item) for number, item in enumerate(_items(listing), 1)]
    names = _names([paths for paths, *_ in found])
    if len(set(names)) < len(names):
        raise ValueError(f"a log is named twice: {next(name for name in names if names.count(name) > 1)}")
    return [Log(name, *rest) for name, rest in zip(names, found)]


def _items(listing: Path) -> List[Any]:
    import yaml

    try:
        items = yaml.safe_load(listing.read_text())
    except (UnicodeDecodeError, yaml.YAMLError) as err:
        raise ValueError(f"{listing}: is no yaml: {' '.join(str(err).split())}") from err
    if not isinstance(items, list) or not items:
        raise ValueError(f"{listing}: must be a list of log and map, a log each, got {type(items).__name__}")
    return items


def _listed(listing: Path, number: int, item: Any) -> _Listed:
    """One log of the list; its paths are meant from the folder of the list."""
    allowed = {"log", "map", "ground_truth", "initial_pose"}
    if not isinstance(item, dict) or not {"log", "map"} <= set(item) <= allowed:
        raise ValueError(
            f"{listing}: item {number} must have log and map, may have ground_truth and initial_pose, got {item}"
        )
    parts = item["log"] if isinstance(item["log"], list) else [item["log"]]
    pose, truth = item.get("initial_pose"), item.get("ground_truth")
    if not parts or not all(isinstance(text, str) for text in [*parts, item["map"], truth or ""]):
        raise ValueError(f"{listing}: item {number}: log, map and ground_truth must be texts, got {item}")
    if pose is not None and not (
        isinstance(pose, list) and len(pose) == 3 and all(type(value) in (int, float) for value in pose)
    ):
        raise ValueError(f"{listing}: item {number}: initial_pose must be [x, y, yaw] in m, m, rad, got {pose}")
    if truth is not None and (listing.parent / truth).is_file():
        truth = str(listing.parent / truth)
    return (
        tuple(listing.parent / part for part in parts),
        listing.parent / item["map"],
        truth,
        None if pose is None else (float(pose[0]), float(pose[1]), float(pose[2])),
    )


def _names(paths: "Sequence[Tuple[Path, ...]]") -> List[str]:
    """What the logs are called: the name of the file, its whole path where names meet."""
    short = [each[0].name for each in paths]
    return [name if short.count(name) == 1 else str(each[0]) for name, each in zip(short, paths)]


def read(contestant: Contestant, known: Sequence[Log]) -> "List[Tuple[Run, Path]]":
    """The runs of its folders, each with the map it was made with.

    Raises:
        ValueError, OSError: no results of a replay; one line.
    """
    found = []
    for folder in contestant.results:
        result, metrics = replay_result.read(folder)
        text = str(metrics["log"])
        same = [log.name for log in known if _same(" ".join(map(str, log.paths)), text)]
        scores = metrics.get("cases")
        run = comparison.run_of(
            contestant.name,
            same[0] if same else Path(text).name,
            result,
            None if scores is None else scores["accuracy"],
        )
        found.append((run, Path(metrics["map"])))
    return found


def _same(one: str, other: str) -> bool:
    return os.path.abspath(one) == os.path.abspath(other)


def jobs(
    everyone: Sequence[Contestant], over: Sequence[Log], seeds: Sequence[int], arguments: argparse.Namespace
) -> List[Job]:
    """All runs to be made, in the order of logs, contestants and seeds."""
    found = []
    for log in over:
        for contestant in everyone:
            if contestant.runs:
                for seed in [None] if contestant.recorded else seeds:
                    found.append(Job(contestant, log.name, seed, replay_arguments(arguments, contestant, log, seed)))
    return found


def replay_arguments(
    arguments: argparse.Namespace, contestant: Contestant, log: Log, seed: Optional[int]
) -> argparse.Namespace:
    """As if `glass_nav replay` had been given them; whole paths, as who runs it may be in another folder."""
    given = argparse.Namespace(**vars(arguments))
    given.log, given.map, given.seed = [_whole(path) for path in log.paths], _whole(log.map), seed or 0
    given.params = None if contestant.params is None else _whole(contestant.params)
    truth = log.ground_truth if log.ground_truth is not None else arguments.ground_truth
    given.ground_truth = truth if truth is None or not Path(truth).is_file() else str(_whole(Path(truth)))
    given.initial_pose = list(log.initial_pose) if log.initial_pose is not None else arguments.initial_pose
    given.fail_if = []
    return given


def _whole(path: Path) -> Path:
    return Path(os.path.abspath(path))


def check(everyone: Sequence[Contestant]) -> None:
    """Refuse parameters before anything runs.

    Raises:
        ParamError: what cannot be used.
    """
    for contestant in everyone:
        if contestant.params is not None:
            replay_params.load(contestant.params)


def make(job: Job, step_done: Callable[[], None]) -> Run:
    """One run, from the files to its errors.

    Raises:
        RecordingError, MapError, ParamError, ValueError, OSError: bad input; one line.
    """
    if job.contestant.recorded is not None:
        return _recorded(job, step_done)
    result = replay.prepare(job.arguments).run(step_done)
    accuracy = None if result.case_scores is None else result.case_scores.metrics()["accuracy"]
    return comparison.run_of(job.contestant.name, job.log, result, accuracy)


def started(jobs_of_log: Sequence[Job], ready: Prepared) -> "Tuple[List[Job], str]":
    """The jobs, and in words what was changed: where nobody says where the robot starts, ours start where recorded
    poses that take part have it, not at the pose of the parameters, which is of another day.

    Args:
        jobs_of_log: all over one log.
        ready: one of them, opened.

    Raises:
        RecordingError: the log cannot be used, or has no such poses.
    """
    given = jobs_of_log[0].arguments
    recorded = next((job for job in jobs_of_log if job.contestant.recorded is not None), None)
    if recorded is None or ready.recording.ground_truth is not None or given.everywhere or given.initial_pose:
        return list(jobs_of_log), ""
    way = _recorded_way(recorded, lambda: None)
    first_ns, known_ns = way.wanted_ns[0], way.stamps_ns[0]
    map_from_odom = se2.compose(way.map_from_base[0], se2.inverse(way.odometry.at(known_ns)))
    start = se2.compose(map_from_odom, way.odometry.at(first_ns)).tolist()
    for job in jobs_of_log:
        job.arguments.initial_pose = start
    return list(jobs_of_log), f"no ground truth: all start where {recorded.contestant.recorded} has the robot"


@dataclass(frozen=True)
class _Way:
    """Poses that another localization left in a log."""

    ours: Prepared
    odometry: Trajectory  # odom_from_base, at all scans
    wanted_ns: np.ndarray  # (W,) scans of the part of the log that is looked at
    stamps_ns: np.ndarray  # (S,) those that have a pose
    map_from_base: np.ndarray  # (S, 3)


def _recorded(job: Job, step_done: Callable[[], None]) -> Run:
    began = time.perf_counter()
    way = _recorded_way(job, step_done)
    reference = way.ours.recording.ground_truth
    errors = pose_errors.of(way.stamps_ns, way.map_from_base, reference)
    return Run(
        job.contestant.name,
        job.log,
        None,
        way.stamps_ns,
        way.map_from_base,
        errors,
        None,
        None,
        None,
        time.perf_counter() - began,
        reference,
    )


def _recorded_way(job: Job, step_done: Callable[[], None]) -> _Way:
    """At the stamp of every scan of ours that has one."""
    source = job.contestant.recorded or ""
    ours = replay.prepare(job.arguments)
    theirs = argparse.Namespace(**vars(job.arguments))
    theirs.ground_truth = source[len("topic:") :] if source.startswith("topic:") else source
    poses = replay.open_recording(theirs, ours.settings).ground_truth
    assert poses is not None  # what is asked for and not there is an error
    at_ns: List[int] = []
    odom_from_base: List[np.ndarray] = []

    def noted() -> Iterator[Entry]:
        for entry in ours.recording:
            if isinstance(entry, Step):
                at_ns.append(entry.scan.stamp_ns)
                odom_from_base.append(entry.odom_from_base)
            yield entry

    entries, wanted = noted(), []
    for entry in ours.window.of(entries):
        if isinstance(entry, Step):
            wanted.append(entry.scan.stamp_ns)
        step_done()
    deque(entries, maxlen=0)  # poses may belong to scans before and after those wanted
    if not wanted:
        raise RecordingError(f"{job.log}: none of its scans can be used")
    unique, first = np.unique(np.array(at_ns, np.int64), return_index=True)
    odometry, wanted_ns = Trajectory(unique, np.array(odom_from_base)[first]), np.unique(np.array(wanted, np.int64))
    found, map_from_base = carried(poses, odometry, wanted_ns)
    if not found.any():
        raise RecordingError(f"{job.log}: {source} has no pose before the last scan")
    return _Way(ours, odometry, wanted_ns, wanted_ns[found], map_from_base[found])


def carried(poses: Trajectory, odometry: Trajectory, stamps_ns: np.ndarray) -> "Tuple[np.ndarray, np.ndarray]":
    """Poses that come now and then, carried on by odometry: the newest map_from_odom holds, as tf hands it out.

    Args:
        poses: map_from_base, N of them.
        odometry: odom_from_base; poses more than CARRY_NS outside its time are of no use.
        stamps_ns: (S,) when the poses are wanted, within the odometry.

    Returns:
        (S,) bool: there was a pose by then; (S, 3) map_from_base, NaN where there was none.
    """
    usable = odometry.covers(poses.stamps_ns, CARRY_NS)
    at_ns, map_from_base = poses.stamps_ns[usable], poses.poses[usable]
    newest = np.searchsorted(at_ns, stamps_ns, side="right") - 1
    found = newest >= 0
    result = np.full((len(stamps_ns), 3), np.nan)
    if found.any():
        map_from_odom = se2.compose(map_from_base, se2.inverse(odometry.at(at_ns)))
        result[found] = se2.compose(map_from_odom[newest[found]], odometry.at(stamps_ns[found]))
    return found, result
