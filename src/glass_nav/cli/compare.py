"""glass_nav compare: compares runs, parameter sets or recorded poses, with confidence intervals."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Dict, List, Optional, Tuple

from glass_nav.cli import log_arguments
from glass_nav.cli.progress import Progress
from glass_nav.compare import compare_files, compare_runs, compared_logs, contestants, engine
from glass_nav.compare.compare_runs import Job
from glass_nav.compare.engine import Failed
from glass_nav.evaluation.metrics import comparison, thresholds
from glass_nav.evaluation.metrics.comparison import Run
from glass_nav.evaluation.metrics.thresholds import Threshold
from glass_nav.evaluation.pages import comparison_table

HELP = "compare runs, parameter sets or recorded poses, with confidence intervals"
DESCRIPTION = """Compares contestants over logs and seeds. Prints a table and writes compare.html (one file that needs no
network), its pictures as PNG files, runs.csv (a row per run, with the hash of its trajectory), compare.json and
timings.csv. A contestant is a folder written by `glass_nav replay --out`, a yaml file of parameters, the word default, or
poses recorded in the log: topic:/amcl_pose, or tf:map. NAME=CONTESTANT names it; folders with the same name are runs of one
contestant. All are compared with the first one, seed by seed, over the scans for which all have a pose. Means have 95 %
confidence intervals: Student's t over the seeds of each log, equal weight for all logs."""
EXAMPLES = (
    "glass_nav compare default mine.yaml --log run.bag=floor.yaml --seeds 3 --out compared",
    "glass_nav compare before=results_1 after=results_2 --out compared",
)


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
        help="runs at a time, a process each (default 1); changes no result",
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
    log_arguments.add_log_arguments(parser)


def usage_error(arguments: argparse.Namespace) -> Optional[str]:
    """What is wrong with the options as such, before any file is opened but the list of logs."""
    for name, least in (("seeds", 1), ("first_seed", 0), ("jobs", 1)):
        value = getattr(arguments, name)
        if value < least:
            return f"--{name.replace('_', '-')} must be >= {least}, got {value}"
    if arguments.scheduler is not None and arguments.jobs > 1:
        return "--jobs and --scheduler exclude each other"
    try:
        running = [each.name for each in contestants.parse(arguments.contestants) if each.runs]
        compared_logs.parse(arguments.log, None)
        _limits(arguments)
        log_arguments.log_use(arguments)
    except ValueError as err:
        return str(err)
    if running and not (arguments.log or arguments.logs):
        return f"{running[0]} needs a log: --log BAG=MAP"
    return None


def main(arguments: argparse.Namespace) -> bool:
    """Read, run, compare, draw, write.

    Returns:
        whether all contestants keep to the limits of --fail-if.

    Raises:
        ValueError, OSError: bad input; one line. Where only some runs fail the others are compared and written first.
    """
    everyone = contestants.parse(arguments.contestants)
    logs = compared_logs.parse(arguments.log, arguments.logs)
    compare_runs.check(everyone)
    read = [found for contestant in everyone for found in compare_runs.read(contestant, logs)]
    maps: Dict[str, Path] = {log.name: log.map for log in logs}
    for run, path in read:
        maps.setdefault(run.log, path)
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.seeds)
    jobs = compare_runs.jobs(everyone, logs, seeds, log_arguments.log_use(arguments))
    made, failed = _run(jobs, arguments)
    runs = [run for run, _ in read] + made
    for each in failed:
        _say(f"{each.job}: {each.reason}")
    if failed and not made:
        raise ValueError(f"none of {len(failed)} runs could be run; the first: {failed[0].reason}")
    names = [each.name for each in everyone if any(run.contestant == each.name for run in runs)]
    compared = comparison.of(runs, names, list(maps))
    for note in compared.notes:
        _say(note)
    page = compare_files.write(arguments.out, compared, maps, everyone)
    print("\n".join(comparison_table.lines(compared)))
    print(f"written to {page}")
    if failed:
        raise ValueError(f"{len(failed)} of {len(failed) + len(made)} runs failed, see above; the others are compared")
    missed = comparison.failures(compared, _limits(arguments))
    for line in missed:
        _say(line)
    return not missed


def _run(jobs: List[Job], arguments: argparse.Namespace) -> "Tuple[List[Run], List[Failed]]":
    """Runs all jobs, with one progress bar."""
    if not jobs:
        return [], []
    opened: List[Job] = []
    scans = 0
    for log in dict.fromkeys(job.log for job in jobs):
        found = compare_runs.open_log([job for job in jobs if job.log == log])
        for note in found.notes:
            _say(f"{log}: {note}")
        opened += found.jobs
        scans += found.expected_scans * len(found.jobs)
    progress = Progress("compare", scans)
    try:
        answers = engine.run(opened, compare_runs.make, progress.step, arguments.jobs, arguments.scheduler)
    finally:
        progress.finish()
    return (
        [each for each in answers if not isinstance(each, Failed)],
        [each for each in answers if isinstance(each, Failed)],
    )


def _limits(arguments: argparse.Namespace) -> List[Threshold]:
    return [thresholds.parse(text, list(comparison.BY_NAME)) for text in arguments.fail_if]


def _say(text: str) -> None:
    print(f"glass_nav compare: {text}", file=sys.stderr)
