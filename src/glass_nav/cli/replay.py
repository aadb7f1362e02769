"""glass_nav replay: a recorded robot through the filter, and how well it went. No roscore."""

from __future__ import annotations

import argparse
import platform
import sys
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Tuple

import numpy as np

from glass_nav import params
from glass_nav.cli.progress import Progress
from glass_nav.evaluation.metrics import replay_result, thresholds
from glass_nav.evaluation.metrics.case_scores import CASE_NAMES, NEAR_M
from glass_nav.evaluation.metrics.replay_result import ReplayResult
from glass_nav.evaluation.metrics.thresholds import Threshold
from glass_nav.evaluation.plots import run_pictures
from glass_nav.localization.initial_pose import StartPose
from glass_nav.localization.localizer import Estimate, Localizer
from glass_nav.recording.log_file import open_log
from glass_nav.recording.recording import LogOptions, Recording, Step
from glass_nav.replay import replay_bag, replay_params, replay_run, replay_topology
from glass_nav.replay.replay_params import Frames, ReplayParams
from glass_nav.replay.replay_run import Window
from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap

Listener = Callable[[Step, Estimate], None]

HELP = "run the localization on a recorded log"
DESCRIPTION = """Runs the localization on a recorded log, every scan of it, and writes metrics.json,
trajectory.tum, per_scan.csv, beam_cases.npz, worst_scans.npz, glass_map.yaml (how glassy each wall cell proved)
and trajectory.png; where the log has the truth about its beams, as
simulated ones do, also the scores of the cases and cases.png. Needs no roscore."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the subcommand."""
    parser.add_argument(
        "log",
        metavar="LOG",
        type=Path,
        nargs="+",
        help="bag of ROS 1 or ROS 2, or MRPT .rawlog; several bags: the parts of one run",
    )
    parser.add_argument("--map", required=True, type=Path, help="map_server .yaml, or MRPT .gridmap[.gz]")
    parser.add_argument("--out", required=True, type=Path, metavar="DIR", help="folder for the results")
    parser.add_argument(
        "--bag",
        type=Path,
        metavar="BAG",
        help="also write a bag for rviz and PlotJuggler: map, tf, scans, poses, particles, status, "
        "cases, cloud and glass map, on the topics of the node",
    )
    parser.add_argument(
        "--topology",
        nargs="?",
        const=replay_topology.FROM_MAP,
        metavar="ATLAS",
        help="also tell which nodes of an atlas the robot passed, and which of them it saw with lidar "
        "and odometry alone, as the driver does: a table, topology.csv and topology.png; an atlas "
        f"file, its folder, a shipped one's name, or {replay_topology.FROM_MAP}: made from "
        "the map, as without a value at the end of the line",
    )
    parser.add_argument(
        "--fail-if",
        action="append",
        default=[],
        metavar="METRIC>LIMIT",
        help="exit with 1 if a figure of metrics.json is beyond a limit, such as 'position_p95_m>0.3'; may be repeated",
    )
    add_run_arguments(parser)
    add_log_arguments(parser)
    parser.add_argument("--no-picture", action="store_true", help="do not draw trajectory.png and cases.png")


def add_run_arguments(parser: argparse.ArgumentParser) -> None:
    """What makes one run over a log another than the next."""
    parser.add_argument(
        "--params",
        type=Path,
        metavar="FILE",
        help="yaml of parameters, names as for the node; default: the node's defaults",
    )
    parser.add_argument("--seed", type=int, default=0, help="of the filter's random numbers (default 0)")


def add_log_arguments(parser: argparse.ArgumentParser) -> None:
    """What is taken from a log, and where the robot starts in it: the same for all runs over it."""
    parser.add_argument(
        "--ground-truth",
        metavar="TOPIC_OR_FILE",
        help="poses in the map: a PoseStamped, PoseWithCovarianceStamped or Odometry topic, tf:FRAME "
        "for what tf says in a bag, a TUM file, or MRPT's _GT.txt; default: /ground_truth of a "
        "bag, LOG_GT.txt beside a rawlog; none: no ground truth",
    )
    parser.add_argument(
        "--true-beams",
        metavar="TOPIC",
        help="true cases: glass_nav/TrueBeams, or a glass_nav/BeamCases; default: the only topic of "
        "the first, or true_cases of the second; none: do not score the cases",
    )
    start = parser.add_argument_group("start")
    start.add_argument(
        "--initial-pose",
        type=float,
        nargs=3,
        metavar=("X", "Y", "YAW"),
        help="m, m, rad; default: the ground truth's pose at the first scan, else initial_pose_* of the parameters",
    )
    start.add_argument(
        "--initial-cov",
        type=float,
        nargs=3,
        metavar=("XX", "YY", "AA"),
        help="m^2, m^2, rad^2; default: initial_cov_* of the parameters",
    )
    start.add_argument(
        "--global", dest="everywhere", action="store_true", help="start anywhere in the map instead of at a pose"
    )
    source = parser.add_argument_group("what to take from the log")
    source.add_argument(
        "--scan-topic",
        metavar="TOPIC",
        help="LaserScan (of a rawlog: the sensor's label); default: the only one, or /scan",
    )
    source.add_argument("--odom-topic", metavar="TOPIC", help="Odometry; default: tf odom <- base, else the only one")
    source.add_argument("--odom-frame", metavar="FRAME", help="default: odom")
    source.add_argument("--base-frame", metavar="FRAME", help="default: base_link, else base_footprint")
    source.add_argument(
        "--laser-pose",
        type=float,
        nargs=3,
        metavar=("X", "Y", "YAW"),
        help="of the laser on the robot, for logs without its tf; m, m, rad",
    )
    part = parser.add_argument_group("part of the log")
    part.add_argument("--start", type=float, default=0.0, metavar="S", help="seconds after the first scan")
    part.add_argument("--duration", type=float, metavar="S", help="seconds from there")
    part.add_argument("--every", type=int, default=1, metavar="N", help="only each N-th scan")
    part.add_argument("--max-scans", type=int, metavar="N")


def usage_error(arguments: argparse.Namespace) -> Optional[str]:
    """What is wrong with the options as such, before any file is opened."""
    if arguments.seed < 0:
        return f"--seed must be >= 0, got {arguments.seed}"
    if arguments.everywhere and arguments.initial_pose is not None:
        return "--global and --initial-pose exclude each other"
    try:
        _window(arguments)
        _thresholds(arguments)
    except ValueError as err:
        return str(err)
    return None


def main(arguments: argparse.Namespace) -> bool:
    """Open, run, write.

    Returns:
        whether the run keeps to the limits of --fail-if.

    Raises:
        RecordingError, MapError, AtlasError, ParamError, ValueError, OSError: bad input; one line.
    """
    ready = prepare(arguments)
    recording, localizer, grid_map = ready.recording, ready.localizer, ready.grid_map
    watch = (
        None
        if arguments.topology is None
        else replay_topology.Watch(replay_topology.atlas_of(arguments.topology, arguments.map, grid_map), grid_map)
    )
    arguments.out.mkdir(parents=True, exist_ok=True)
    for note in ready.notes:
        _say(note)
    progress = Progress("replay", ready.expected_scans)
    try:
        with ExitStack() as stack:
            listeners: List[Listener] = [] if watch is None else [watch.listen]
            if arguments.bag is not None:
                arguments.bag.parent.mkdir(parents=True, exist_ok=True)
                listeners.append(
                    stack.enter_context(replay_bag.listener(arguments.bag, recording, localizer, grid_map))
                )
            result = ready.run(progress.step, _all_of(listeners))
    finally:
        progress.finish()
    image = run_pictures.MapImage(grid_map.occupancy, grid_map.resolution_m, grid_map.map_from_grid)
    topology = None if watch is None else watch.finish(result)
    about: Dict[str, Any] = {
        "log": " ".join(map(str, arguments.log)),
        "map": str(arguments.map),
        "start": ready.origin,
        "notes": ready.notes,
        "params": params.as_mapping(ready.settings.localizer),
        "versions": versions(),
    }
    if watch is not None and topology is not None:
        about["topology"] = topology.metrics()
        replay_topology.write(
            arguments.out,
            topology,
            watch.atlas,
            None if arguments.no_picture else image,
            replay_topology.poses(result)[:, :2],
            recording.name,
        )
    replay_result.write(result, arguments.out, about)
    glass = GridMap(localizer.glass_map.occupancy(), grid_map.resolution_m, grid_map.map_from_grid)
    map_file.save(glass, arguments.out / "glass_map.yaml", image_suffix=".png")
    if not arguments.no_picture:
        run_pictures.draw_trajectory(arguments.out / "trajectory.png", image, result, recording.name)
        if result.case_scores is not None:
            run_pictures.draw_cases(arguments.out / "cases.png", image, result, recording.name)
    for reason, count in result.refusals.most_common():
        _say(f"{count} scans refused: {reason}")
    print("\n".join([table(result), *([] if topology is None else replay_topology.table(topology.metrics()))]))
    print(f"written to {arguments.out}" + ("" if arguments.bag is None else f" and {arguments.bag}"))
    metrics = {**result.metrics(), **({} if topology is None else {"topology": topology.metrics()})}
    failures = [failure for failure in (each.failure(metrics) for each in _thresholds(arguments)) if failure]
    for failure in failures:
        _say(failure)
    return not failures


@dataclass(frozen=True)
class Prepared:
    """A log, a map and a filter, from the options of a command; nothing has run yet."""

    settings: ReplayParams
    grid_map: GridMap
    recording: Recording
    localizer: Localizer
    start: Callable[[int], None]  # see replay_run.run()
    origin: str  # where the robot starts, in words
    notes: List[str]  # what was chosen or found odd
    seed: int
    window: Window

    @property
    def expected_scans(self) -> int:
        """About how many will be used: for a progress bar."""
        return self.window.expected(len(self.recording))

    def run(
        self,
        step_done: Callable[[], None] = lambda: None,
        listen: Callable[[Step, Estimate], None] = lambda step, estimate: None,
    ) -> ReplayResult:
        """Once only: the filter is not the same afterwards. For the arguments see replay_run.run().

        Raises:
            RecordingError: not one scan of the log can be used.
        """
        return replay_run.run(self.recording, self.localizer, self.start, self.seed, self.window, step_done, listen)


def prepare(arguments: argparse.Namespace) -> Prepared:
    """Open what the options name: log, map, params, seed, and those of add_log_arguments().

    Raises:
        RecordingError, MapError, ParamError, ValueError, OSError: bad input; one line.
    """
    settings, unused = (ReplayParams(), []) if arguments.params is None else replay_params.load(arguments.params)
    grid_map = map_file.load(arguments.map)
    recording = open_recording(arguments, settings)
    localizer = Localizer(settings.localizer, grid_map, np.random.default_rng(arguments.seed))
    start, origin = _start(localizer, recording, arguments, settings.start)
    unused_note = [f"parameters that only a node uses: {', '.join(unused)}"] if unused else []
    return Prepared(
        settings,
        grid_map,
        recording,
        localizer,
        start,
        origin,
        [*recording.notes, *unused_note, f"start: {origin}"],
        arguments.seed,
        _window(arguments),
    )


def open_recording(arguments: argparse.Namespace, settings: ReplayParams) -> Recording:
    """The log, with the options of add_log_arguments().

    Raises:
        RecordingError: it cannot be used; one line.
    """
    return open_log(arguments.log, _log_options(arguments, settings))


def versions() -> Dict[str, str]:
    """Of what the numbers depend on."""
    import scipy

    return {
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "machine": platform.machine(),
    }


def table(result: ReplayResult) -> str:
    """The figures of a run for people."""
    figures = result.metrics()
    lines = [
        f"{figures['scans']} scans, {figures['updates']} updates, {figures['scans_refused']} refused; "
        f"{figures['cpu_ms_per_scan']:.1f} ms CPU per scan, {figures['times_real_time']:.1f} times real time"
    ]
    if figures["position_mean_m"] is not None or result.errors.matched.any():
        lines.append(
            "position error  "
            + "  ".join(
                f"{name} {_metres(figures[f'position_{name}_m'])}" for name in ("mean", "median", "rmse", "p95", "max")
            )
        )
        lines.append(
            f"yaw error       mean {figures['yaw_mean_deg']:.2f} deg  "
            f"median {figures['yaw_median_deg']:.2f} deg  p95 {figures['yaw_p95_deg']:.2f} deg"
        )
        lines.append(
            f"lost            {100 * figures['lost_share']:.1f} % of the scans more than 0.5 m off, "
            f"{100 * figures['lost_1m_share']:.1f} % more than 1 m"
        )
    lines.append(
        "beam cases      "
        + "  ".join(f"{name} {100 * figures['case_share'][str(case)]:.1f} %" for case, name in enumerate(CASE_NAMES))
    )
    return "\n".join(lines + _case_lines(figures["cases"]) + _surface_lines(figures["scan_surfaces"]))


def _case_lines(scores: Optional[Dict[str, Any]]) -> List[str]:
    if scores is None:
        return []
    lines = [
        f"cases told      {_figure(scores['accuracy'])} of {scores['beams']} beams right, "
        f"{_figure(scores['accuracy_answered'])} of those that answered; macro F1 {_figure(scores['macro_f1'])}; "
        f"{_figure(scores['used_share'])} used",
        f"  {'':22s}{'true':>9s}{'told':>9s}{'precision':>11s}{'recall':>8s}{'F1':>8s}",
    ]
    for case, name in enumerate(CASE_NAMES):
        share, told = (100 * (scores[key][case] or 0.0) for key in ("true_share", "told_share"))
        precision, recall, f1 = (_figure(scores[key][case]) for key in ("precision", "recall", "f1"))
        lines.append(f"  {case} {name:20s}{share:7.1f} %{told:7.1f} %{precision:>11s}{recall:>8s}{f1:>8s}")
    return lines


def _surface_lines(scores: Optional[Dict[str, Any]]) -> List[str]:
    if scores is None:
        return []
    return [
        f"scan_surfaces   {_figure(scores['cut_at_pane_share'])} of {scores['at_pane']} beams that passed or were "
        f"mirrored at a pane cut within {NEAR_M:g} m of it, {_figure(scores['cut_wrongly_share'], 4)} of the "
        f"others cut; pose trusted in {_figure(scores['trusted_share'])} of the scans"
    ]


def _figure(value: Optional[float], digits: int = 3) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def _metres(value: Optional[float]) -> str:
    return "infinite" if value is None else f"{value:.3f} m"


def _thresholds(arguments: argparse.Namespace) -> List[Threshold]:
    return [thresholds.parse(text) for text in arguments.fail_if]


def _window(arguments: argparse.Namespace) -> Window:
    return Window(arguments.start, arguments.duration, arguments.every, arguments.max_scans)


def _log_options(arguments: argparse.Namespace, settings: ReplayParams) -> LogOptions:
    """The command first, then a frame that the parameters name and that is not just the default."""
    default, frames = Frames(), settings.frames
    odom_frame = frames.odom_frame_id if frames.odom_frame_id != default.odom_frame_id else None
    base_frame = frames.base_frame_id if frames.base_frame_id != default.base_frame_id else None
    pose = arguments.laser_pose
    return LogOptions(
        arguments.scan_topic,
        arguments.odom_topic,
        arguments.base_frame or base_frame,
        arguments.odom_frame or odom_frame,
        None if pose is None else (pose[0], pose[1], pose[2]),
        arguments.ground_truth,
        arguments.true_beams,
        settings.deskew.deskew,
    )


def _start(
    localizer: Localizer, recording: Recording, arguments: argparse.Namespace, defaults: StartPose
) -> Tuple[Callable[[int], None], str]:
    """What places the particles at the first scan, and a text that says where."""
    covariance = defaults.covariance if arguments.initial_cov is None else np.diag(arguments.initial_cov)
    truth = recording.ground_truth
    if arguments.everywhere:
        return lambda stamp_ns: localizer.scatter(), "anywhere in the map"
    if arguments.initial_pose is not None:
        return lambda stamp_ns: localizer.set_pose(np.array(arguments.initial_pose), covariance), "--initial-pose"
    if truth is not None and len(truth):
        return lambda stamp_ns: localizer.set_pose(
            truth.at(np.int64(stamp_ns)), covariance
        ), "the ground truth's first pose"
    return lambda stamp_ns: localizer.set_pose(defaults.pose, covariance), "initial_pose_* of the parameters"


def _all_of(listeners: List[Listener]) -> Listener:
    def listen(step: Step, estimate: Estimate) -> None:
        for each in listeners:
            each(step, estimate)

    return listen


def _say(text: str) -> None:
    print(f"glass_nav replay: {text}", file=sys.stderr)
