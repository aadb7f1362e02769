"""Runs a module of ros/ as a process of its own: nothing outside of ros/ knows ROS."""

from __future__ import annotations

import subprocess
import sys
from typing import Sequence


def run(module: str, arguments: Sequence[str], program: str, codes: "tuple[int, ...]" = (0,)) -> int:
    """The exit code; what the process prints goes through.

    Args:
        module: dotted name.
        arguments: of the process.
        program: with what its errors begin, and a colon: taken off, it is said again.
        codes: exit codes that are answers.

    Raises:
        ValueError: any other exit code; the last line of its errors.
    """
    done = subprocess.run([sys.executable, "-m", module, *arguments], capture_output=True, text=True, check=False)
    if done.returncode not in codes:
        lines = [line for line in done.stderr.splitlines() if line.strip()]
        last = lines[-1] if lines else f"{module} ended with {done.returncode}"
        if "No module named" in last:
            last = f"this needs ROS: {last}; source its setup.bash"
        raise ValueError(last[len(program) + 2 :] if last.startswith(f"{program}: ") else last)
    print(done.stdout, end="")
    return done.returncode
