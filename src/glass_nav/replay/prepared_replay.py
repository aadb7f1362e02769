"""Prepares a replay: log, map and filter, from its options."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Callable, List, Tuple

import numpy as np

from glass_nav.evaluation.metrics.replay_result import ReplayResult
from glass_nav.localization.initial_pose import StartPose
from glass_nav.localization.localizer import Estimate
from glass_nav.localization.method import PoseFilter
from glass_nav.recording.log_file import open_log
from glass_nav.recording.recording import LogOptions, Recording, Step
from glass_nav.replay import replay_params, replay_run
from glass_nav.replay.replay_options import ReplayOptions, StartOptions
from glass_nav.replay.replay_params import Frames, ReplayParams
from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap

Listener = Callable[[Step, Estimate], None]


@dataclass(frozen=True)
class PreparedReplay:
    """A log, a map and a filter; nothing has run yet."""

    options: ReplayOptions
    settings: ReplayParams
    grid_map: GridMap
    recording: Recording
    localizer: PoseFilter
    start: Callable[[int], None]  # see replay_run.run()
    origin: str  # where the robot starts, in words
    notes: List[str]  # what was chosen or found odd

    @property
    def expected_scans(self) -> int:
        """About how many will be used: for a progress bar."""
        return self.options.use.window.expected(len(self.recording), self.recording.duration_s)

    def run(
        self, step_done: Callable[[], None] = lambda: None, listen: Listener = lambda step, estimate: None
    ) -> ReplayResult:
        """Runs the replay, once: the filter is different afterwards. Arguments as of replay_run.run().

        Raises:
            RecordingError: not one scan of the log can be used.
        """
        options = self.options
        return replay_run.run(
            self.recording, self.localizer, self.start, options.seed, options.use.window, step_done, listen
        )


def prepare(options: ReplayOptions) -> PreparedReplay:
    """Open what the options name.

    Raises:
        RecordingError, MapError, ParamError, ValueError, OSError: bad input; one line.
    """
    settings, unused = (ReplayParams(), []) if options.params is None else replay_params.load(options.params)
    grid_map = map_file.load(options.map)
    recording = open_recording(options, settings)
    localizer = settings.method.begin(settings.localizer, grid_map, np.random.default_rng(options.seed))
    start, origin = _start(localizer, recording, options.use.start, settings.start)
    unused_note = [f"parameters that only a node uses: {', '.join(unused)}"] if unused else []
    notes = [*recording.notes, *unused_note, f"start: {origin}"]
    return PreparedReplay(options, settings, grid_map, recording, localizer, start, origin, notes)


def open_recording(options: ReplayOptions, settings: ReplayParams) -> Recording:
    """The log alone.

    Raises:
        RecordingError: it cannot be used; one line.
    """
    return open_log(list(options.log), _source(options.use.source, settings))


def _source(given: LogOptions, settings: ReplayParams) -> LogOptions:
    """Options of the source: as given, else a frame that the parameters name explicitly."""
    default, frames = Frames(), settings.frames
    odom_frame = frames.odom_frame_id if frames.odom_frame_id != default.odom_frame_id else None
    base_frame = frames.base_frame_id if frames.base_frame_id != default.base_frame_id else None
    return dataclasses.replace(
        given,
        base_frame=given.base_frame or base_frame,
        odom_frame=given.odom_frame or odom_frame,
        deskew=settings.deskew.deskew,
        wheels=settings.wheels,
        wheel_base_m=settings.localizer.odometry.wheel_base_m,
        laser_max_range=settings.localizer.limits.laser_max_range,
    )


def _start(
    localizer: PoseFilter, recording: Recording, given: StartOptions, defaults: StartPose
) -> Tuple[Callable[[int], None], str]:
    """A function that places the particles at the first scan, and a description of the start."""
    covariance = defaults.covariance if given.variance is None else np.diag(given.variance)
    pose, truth = given.pose, recording.ground_truth
    if given.everywhere:
        return lambda stamp_ns: localizer.scatter(), "anywhere in the map"
    if pose is not None:
        return lambda stamp_ns: localizer.set_pose(np.array(pose), covariance), "--initial-pose"
    if truth is not None and len(truth):
        return lambda stamp_ns: localizer.set_pose(
            truth.at(np.int64(stamp_ns)), covariance
        ), "the ground truth's first pose"
    return lambda stamp_ns: localizer.set_pose(defaults.pose, covariance), "initial_pose_* of the parameters"
