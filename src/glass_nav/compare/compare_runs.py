"""The runs of a comparison, and how one of them is done."""

from __future__ import annotations

import dataclasses
import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Callable, List, Optional, Sequence, Tuple

from glass_nav.compare import recorded_poses
from glass_nav.compare.compared_logs import Log
from glass_nav.compare.contestants import Contestant
from glass_nav.evaluation.metrics import comparison, pose_errors, replay_result
from glass_nav.evaluation.metrics.comparison import Run
from glass_nav.geometry import se2
from glass_nav.replay import prepared_replay, replay_params
from glass_nav.replay.replay_options import LogUse, ReplayOptions, Triple


@dataclass(frozen=True)
class Job:
    """One run, in a form that can be sent to another process or machine."""

    contestant: Contestant
    log: str
    seed: Optional[int]  # None: recorded poses
    options: ReplayOptions

    def __str__(self) -> str:
        return f"{self.contestant.name} over {self.log}" + ("" if self.seed is None else f", seed {self.seed}")


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


def jobs(everyone: Sequence[Contestant], over: Sequence[Log], seeds: Sequence[int], use: LogUse) -> List[Job]:
    """All runs, in the order of logs, contestants and seeds."""
    found = []
    for log in over:
        for contestant in everyone:
            if contestant.runs:
                for seed in [None] if contestant.recorded else seeds:
                    found.append(Job(contestant, log.name, seed, replay_options(use, contestant, log, seed)))
    return found


def replay_options(use: LogUse, contestant: Contestant, log: Log, seed: Optional[int]) -> ReplayOptions:
    """Options of one run, with absolute paths: another process may work in another folder."""
    truth = log.ground_truth if log.ground_truth is not None else use.source.ground_truth
    truth = truth if truth is None or not Path(truth).is_file() else str(_whole(Path(truth)))
    pose = log.initial_pose if log.initial_pose is not None else use.start.pose
    return ReplayOptions(
        tuple(_whole(path) for path in log.paths),
        _whole(log.map),
        None if contestant.params is None else _whole(contestant.params),
        seed or 0,
        LogUse(
            dataclasses.replace(use.source, ground_truth=truth),
            dataclasses.replace(use.start, pose=pose),
            use.window,
        ),
    )


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
    """Does one run, from the files to its errors.

    Raises:
        RecordingError, MapError, ParamError, ValueError, OSError: bad input; one line.
    """
    if job.contestant.recorded is not None:
        return _recorded(job, step_done)
    result = prepared_replay.prepare(job.options).run(step_done)
    accuracy = None if result.case_scores is None else result.case_scores.metrics()["accuracy"]
    return comparison.run_of(job.contestant.name, job.log, result, accuracy)


@dataclass(frozen=True)
class OpenedLog:
    """The jobs over one log, each with where the robot starts."""

    jobs: List[Job]
    expected_scans: int  # of each
    notes: List[str]  # what was chosen or found odd


def open_log(jobs_of_log: Sequence[Job]) -> OpenedLog:
    """Refuse a log that cannot be used, before anything runs.

    Without a ground truth and an initial pose, all start where the recorded poses that take part have the robot: the
    pose of the parameters belongs to another day.

    Raises:
        RecordingError, MapError, ParamError, ValueError, OSError: bad input; one line.
    """
    ready = prepared_replay.prepare(jobs_of_log[0].options)
    given = ready.options.use.start
    recorded = next((job for job in jobs_of_log if job.contestant.recorded is not None), None)
    if recorded is None or ready.recording.ground_truth is not None or given.everywhere or given.pose is not None:
        return OpenedLog(list(jobs_of_log), ready.expected_scans, ready.notes)
    path = recorded_poses.find(recorded.options, recorded.contestant.recorded or "", lambda: None)
    first_ns, known_ns = path.wanted_ns[0], path.stamps_ns[0]
    map_from_odom = se2.compose(path.map_from_base[0], se2.inverse(path.odometry.at(known_ns)))
    x, y, yaw = se2.compose(map_from_odom, path.odometry.at(first_ns)).tolist()
    note = f"no ground truth: all start where {recorded.contestant.recorded} has the robot"
    return OpenedLog(
        [_placed(job, (x, y, yaw)) for job in jobs_of_log], ready.expected_scans, [*ready.recording.notes, note]
    )


def _placed(job: Job, pose: Triple) -> Job:
    use = job.options.use
    use = dataclasses.replace(use, start=dataclasses.replace(use.start, pose=pose))
    return dataclasses.replace(job, options=dataclasses.replace(job.options, use=use))


def _recorded(job: Job, step_done: Callable[[], None]) -> Run:
    began = time.perf_counter()
    path = recorded_poses.find(job.options, job.contestant.recorded or "", step_done)
    reference = path.ours.recording.ground_truth
    errors = pose_errors.of(path.stamps_ns, path.map_from_base, reference)
    return Run(
        job.contestant.name,
        job.log,
        None,
        path.stamps_ns,
        path.map_from_base,
        errors,
        None,
        None,
        None,
        time.perf_counter() - began,
        reference,
    )
