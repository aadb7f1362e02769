"""Every file of a folder, cut short and with bytes changed, given to every subcommand in every role.

    python test/benchmark/corrupted_files.py [--data DIR] [--seed N] [--most MB]

Prints each run that ends with a traceback, another exit code than 0 to 3, more than one line of error, or not within 10 s
and 2 GB, and the numbers of runs. Exit code 1 if there is such a run.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

from corrupted_files import COMMANDS, corrupted, fault, words

GLASS_NAV = Path(__file__).resolve().parents[2] / "scripts" / "glass_nav"
LIMIT_S, LIMIT_BYTES = 10.0, 2 * 10**9


def main() -> int:
    """Run all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    default = os.environ.get("GLASS_NAV_DATA", str(Path(__file__).resolve().parents[3] / "shared" / "data"))
    parser.add_argument("--data", type=Path, default=Path(default), help="folder with good files")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--most", type=float, default=30.0, metavar="MB", help="larger files are left out")
    parser.add_argument("--role", choices=sorted(COMMANDS), action="append", help="only these roles")
    given = parser.parse_args()
    bag, map_file = given.data / "logs/olin_mac/olin_mac.bag", given.data / "logs/olin_mac/map.yaml"
    files = [path for path in sorted(given.data.rglob("*")) if path.is_file()]
    runs = bad = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for path in files:
            if path.stat().st_size > given.most * 1e6:
                continue
            for change, data in corrupted(path.read_bytes(), given.seed):
                broken = folder / path.name
                broken.write_bytes(data)
                for role in given.role or COMMANDS:
                    for command in COMMANDS[role]:
                        found = _run(words(command, FILE=broken, BAG=bag, MAP=map_file, OUT=folder / "out"))
                        runs, bad = runs + 1, bad + bool(found)
                        if found:
                            print(f"{path}, {change}: {command}: {found}", flush=True)
                broken.unlink()
    print(f"{runs} runs, {bad} bad")
    return 1 if bad else 0


def _run(arguments: "list[str]") -> str:
    try:
        done = subprocess.run(
            [sys.executable, str(GLASS_NAV), *arguments],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            timeout=LIMIT_S,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (LIMIT_BYTES, LIMIT_BYTES)),
        )
    except subprocess.TimeoutExpired:
        return f"not within {LIMIT_S:g} s"
    return fault(done.returncode, done.stderr)


if __name__ == "__main__":
    sys.exit(main())
