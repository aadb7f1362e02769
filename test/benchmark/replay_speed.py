"""How many times faster than real time `glass_nav replay` is: whole runs of the command, on one core.

    python3 test/benchmark/replay_speed.py [--logs NAME ...] [--minutes 10]

Each log is replayed as a user would, with all output (pictures, too) and default parameters, up to the given
minutes of it; numpy's libraries have one thread. Figures: seconds of log, CPU seconds of the process (user and system;
start of Python included), their quotient, CPU milliseconds per scan, and what share of the scans moved the particles
(update_min_d 0.1 m, update_min_a 0.1 rad). Exit code 1 where the quotient is below 20. The logs are read from the
folder GLASS_NAV_DATA, as for the tests.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, Dict, Tuple

import numpy as np

REPO = Path(__file__).resolve().parents[2]
DATA = Path(os.environ.get("GLASS_NAV_DATA") or REPO.parent / "shared" / "data")
LOGS = ("intel", "mit_csail", "aces", "acapulco", "wean2", "uob_trace0", "olin_mac", "mit_racecar2")
LEAST = 20.0


def measure(name: str, minutes: float, out: Path) -> Tuple[float, float, Dict[str, Any]]:
    """Seconds of log, CPU seconds, and metrics.json of one run."""
    folder = DATA / "logs" / name
    one_thread = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [
            sys.executable,
            str(REPO / "scripts" / "glass_nav"),
            "replay",
            str(folder / f"{name}.bag"),
            "--map",
            str(folder / "map.yaml"),
            "--out",
            str(out),
            "--duration",
            str(60.0 * minutes),
        ],
        env={**os.environ, **one_thread},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        check=True,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    metrics = json.loads((out / "metrics.json").read_text())
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return float(metrics["log_duration_s"]), cpu_s, metrics


def main() -> int:
    """Print a table; exit code 1 where a log is slower than the bar."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--logs", nargs="+", default=LOGS, metavar="NAME")
    parser.add_argument("--minutes", type=float, default=10.0)
    given = parser.parse_args()
    print(
        "| log | scans × beams | Hz | s of log | CPU s | times real time | ms per scan | updates |\n" + 8 * "|---" + "|"
    )
    slow = []
    for name in given.logs:
        with tempfile.TemporaryDirectory() as out:
            log_s, cpu_s, metrics = measure(name, given.minutes, Path(out))
            beams = np.load(Path(out) / "beam_cases.npz")["cases"].shape[1]
        times, scans = log_s / cpu_s, metrics["scans"]
        slow += [name] if times < LEAST else []
        print(
            f"| {name} | {scans} × {beams} | {scans / log_s:.1f} | {log_s:.0f} | {cpu_s:.1f} | {times:.1f} | "
            f"{1e3 * cpu_s / scans:.1f} | {metrics['updates'] / scans:.2f} |",
            flush=True,
        )
    if slow:
        print(f"below {LEAST:g} times real time: {', '.join(slow)}")
    return 1 if slow else 0


if __name__ == "__main__":
    sys.exit(main())
