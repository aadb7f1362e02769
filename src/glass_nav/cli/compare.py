"""glass_nav compare: runs, parameters or recorded poses side by side, with confidence over seeds."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Dict, List, Optional, Tuple

from glass_nav.cli import replay
from glass_nav.cli.progress import Progress
from glass_nav.compare import compare_runs, engine
from glass_nav.compare.compare_runs import Contestant, Job, Log
from glass_nav.compare.engine import Failed
from glass_nav.evaluation.metrics import comparison, thresholds
from glass_nav.evaluation.metrics.comparison import Comparison, Run
from glass_nav.evaluation.metrics.thresholds import Threshold
from glass_nav.evaluation.pages import comparison_page
from glass_nav.evaluation.plots import comparison_pictures, run_pictures
from glass_nav.world import map_file

HELP = "runs, parameters or recorded poses side by side, with confidence over seeds"
DESCRIPTION = """Compares contestants over logs and seeds: prints a table and writes compare.html, one file that needs
no network, its pictures as PNG files, runs.csv (a row per run, with the hash of its trajectory), compare.json and
timings.csv. A contestant is a folder that `glass_nav replay --out` wrote, a yaml file of parameters, the word default,
or poses that the log has: topic:/amcl_pose, or tf:map for what tf says. NAME=CONTESTANT names it; folders of one name
are runs of one contestant. The others are compared with the first, seed by seed, over the scans that all have a pose
for. A mean has its 95 % interval: Student's t over the seeds of each log, the logs as they are."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the subcommand."""
    parser.add_argument(
        "contestants",
        metavar="[NAME=]CONTESTANT",
        nargs="+",
        help="folder of results, yaml of parameters, default, topic:/TOPIC or tf:FRAME",
    )
    parser.add_argument("--out", required=True, type=Path, metavar="DIR", help="folder for the comparison")
    parser.add_argument(
        "--log",
        action="append",
        default=[],
        metavar="BAG=MAP",
        help="a log and its map, for all but folders; may be repeated",
    )
    parser.add_argument(
        "--logs",
        type=Path,
        metavar="FILE",
        help="yaml list of many: {log: a.bag, map: a.yaml}, also ground_truth and initial_pose; "
        "log: [a_0.bag, a_1.bag] are the parts of one run",
    )
    parser.add_argument("--seeds", type=int, default=3, metavar="N", help="runs of each over each log (default 3)")
    parser.add_argument("--first-seed", type=int, default=0, metavar="K", help="seeds K to K + N - 1 (default 0)")
    parser.add_argument(
        "--jobs",
        type=int,
        default=1,
        metavar="N",
        help="runs at a time, on so many cores (default 1; more: needs joblib); changes no result",
    )
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="run on a Dask cluster, such as tcp://10.0.0.7:8786 (needs distributed); its workers need "
        "this package and the files under the same paths",
    )
    parser.add_argument(
        "--fail-if",
        action="append",
        default=[],
        metavar="METRIC>LIMIT",
        help="exit with 1 if a contestant's mean over all logs and seeds is beyond a limit, such as "
        "'position_p95_m>0.3'; metrics as in runs.csv, cpu_ms_per_scan too; may be repeated",
    )
    replay.add_log_arguments(parser)


def usage_error(arguments: argparse.Namespace) -> Optional[str]:
    """What is wrong with the options as such, before any file is opened but the list of logs."""
    for name, least in (("seeds", 1), ("first_seed", 0), ("jobs", 1)):
        value = getattr(arguments, name)
        if value < least:
            return f"--{name.replace('_', '-')} must be >= {least}, got {value}"
    if arguments.scheduler is not None and arguments.jobs > 1:
        return "--jobs and --scheduler exclude each other"
    try:
        running = [each.name for each in compare_runs.contestants(arguments.contestants) if each.runs]
        compare_runs.logs(arguments.log, None)
        _limits(arguments)
    except ValueError as err:
        return str(err)
    if running and not (arguments.log or arguments.logs):
        return f"{running[0]} needs a log: --log BAG=MAP"
    given = argparse.Namespace(**vars(arguments))
    given.seed, given.fail_if = arguments.first_seed, []
    return replay.usage_error(given)


def main(arguments: argparse.Namespace) -> bool:
    """Read, run, compare, draw, write.

    Returns:
        whether all contestants keep to the limits of --fail-if.

    Raises:
        ValueError, OSError: bad input; one line. Where only some runs fail the others are compared and written first.
    """
    everyone = compare_runs.contestants(arguments.contestants)
    logs = compare_runs.logs(arguments.log, arguments.logs)
    compare_runs.check(everyone)
    read = [found for contestant in everyone for found in compare_runs.read(contestant, logs)]
    maps: Dict[str, Path] = {log.name: log.map for log in logs}
    for run, path in read:
        maps.setdefault(run.log, path)
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.seeds)
    made, failed = _run(compare_runs.jobs(everyone, logs, seeds, arguments), logs, arguments)
    runs = [run for run, _ in read] + made
    for each in failed:
        _say(f"{each.job}: {each.reason}")
    if failed and not made:
        raise ValueError(f"none of {len(failed)} runs could be made; the first: {failed[0].reason}")
    names = [each.name for each in everyone if any(run.contestant == each.name for run in runs)]
    compared = comparison.of(runs, names, list(maps))
    for note in compared.notes:
        _say(note)
    _write(compared, maps, everyone, arguments)
    print(table(compared))
    print(f"written to {arguments.out / 'compare.html'}")
    if failed:
        raise ValueError(
            f"{len(failed)} of {len(failed) + len(made)} runs could not be made, see above; the others are compared"
        )
    missed = comparison.failures(compared, _limits(arguments))
    for line in missed:
        _say(line)
    return not missed


def _run(jobs: List[Job], logs: List[Log], arguments: argparse.Namespace) -> "Tuple[List[Run], List[Failed]]":
    """All jobs, with one progress over all of them."""
    if not jobs:
        return [], []
    scans, opened = {}, []
    for log in logs:
        of_log = [job for job in jobs if job.log == log.name]
        scans[log.name], placed = _opened(log, of_log)
        opened += placed
    jobs = opened
    progress = Progress("compare", sum(scans[job.log] for job in jobs))
    try:
        answers = engine.run(jobs, compare_runs.make, progress.step, arguments.jobs, arguments.scheduler)
    finally:
        progress.finish()
    return (
        [each for each in answers if not isinstance(each, Failed)],
        [each for each in answers if isinstance(each, Failed)],
    )


def _opened(log: Log, jobs: List[Job]) -> "Tuple[int, List[Job]]":
    """About how many scans it has, and the jobs with where they start; says what was chosen in the log, and refuses one
    that cannot be used before anything runs.
    """
    ready = replay.prepare(jobs[0].arguments)
    jobs, start = compare_runs.started(jobs, ready)
    for note in ready.notes:
        if not (start and note.startswith("start: ")):
            _say(f"{log.name}: {note}")
    if start:
        _say(f"{log.name}: {start}")
    return ready.expected_scans, jobs


def _write(
    compared: Comparison, maps: Dict[str, Path], everyone: List[Contestant], arguments: argparse.Namespace
) -> None:
    arguments.out.mkdir(parents=True, exist_ok=True)
    about = {
        "versions": replay.versions(),
        "maps": {log: str(maps[log]) for log in compared.logs},
        "what": {each.name: _what(each) for each in everyone},
    }
    comparison.write(compared, arguments.out, about)
    grids = {}
    for log in compared.logs[: comparison_pictures.MAX_LOGS]:
        if maps[log].exists():  # results may come from elsewhere
            grid = map_file.load(maps[log])
            grids[log] = run_pictures.MapImage(grid.occupancy, grid.resolution_m, grid.map_from_grid)
    drawn = comparison_pictures.draw_all(arguments.out, compared, grids)
    comparison_page.write(arguments.out / "compare.html", compared, drawn, about)


def _what(contestant: Contestant) -> str:
    if contestant.results:
        return "results " + ", ".join(map(str, contestant.results))
    if contestant.recorded:
        return f"recorded poses, {contestant.recorded}"
    return "the defaults" if contestant.params is None else f"parameters {contestant.params}"


def table(compared: Comparison) -> str:
    """The comparison for people: a figure a line, means, then the differences to the first."""
    rows = comparison_page.summary(compared)
    widths = [max(map(len, column)) for column in zip(*rows)]
    lines = ["  ".join(f"{cell:<{width}s}" for cell, width in zip(row, widths)).rstrip() for row in rows]
    return "\n".join([f"{comparison.counted(compared)}; mean ± 95 % interval over seeds", *lines])


def _limits(arguments: argparse.Namespace) -> List[Threshold]:
    return [thresholds.parse(text, list(comparison.BY_NAME)) for text in arguments.fail_if]


def _say(text: str) -> None:
    print(f"glass_nav compare: {text}", file=sys.stderr)
