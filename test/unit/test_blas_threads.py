"""One thread of a program of ours uses the CPU: OpenBLAS keeps its own to itself."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

SCRIPTS = sorted(
    path
    for path in (Path(__file__).parents[2] / "scripts").iterdir()
    if path.read_bytes().partition(b"\n")[0].endswith(b"python3")
)

# Busy with matrices for half a second of CPU, then: ticks of CPU time of each thread of this process.
PROGRAM = """
import time
{first}
import numpy as np
square = np.random.default_rng(0).normal(size=(300, 300))
while time.process_time() < 1.0:
    square @ square
for task in sorted(__import__("pathlib").Path("/proc/self/task").iterdir()):
    print(sum(map(int, (task / "stat").read_text().rpartition(")")[2].split()[11:13])))
"""


def numpy_uses_openblas() -> bool:
    """Debian's numpy computes with the BLAS that is installed; the plain one knows no threads."""
    np.linalg.norm(np.eye(2))
    mapped = Path("/proc/self/maps")
    return mapped.exists() and "openblas" in mapped.read_text()


def busy_threads(first: str, **environment: str) -> int:
    """How many threads used more than a tenth of the CPU time that all used."""
    clean = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(first=first)],
        env={**clean, **environment},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
        timeout=60.0,
        check=True,
    )
    ticks = [int(line) for line in done.stdout.split()]
    return sum(each > 0.1 * sum(ticks) for each in ticks)


@pytest.mark.skipif(not os.path.isdir("/proc/self/task"), reason="no /proc: threads cannot be told apart")
class TestThreads:
    @pytest.mark.long_run
    def test_a_program_that_imports_the_package_first_keeps_one_thread_busy(self):
        assert busy_threads("import glass_nav") == 1

    @pytest.mark.long_run
    @pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="one core: BLAS takes one thread by itself")
    @pytest.mark.skipif(not numpy_uses_openblas(), reason="numpy does not use OpenBLAS here: its BLAS takes one thread")
    @pytest.mark.parametrize("name", ["OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"])
    def test_a_user_may_ask_for_more(self, name):
        assert busy_threads("import glass_nav", **{name: "2"}) == 2


@pytest.mark.parametrize("script", SCRIPTS, ids=[path.name for path in SCRIPTS])
def test_every_program_imports_the_package_before_numpy(script):
    imports = [node for node in ast.parse(script.read_text()).body if isinstance(node, (ast.Import, ast.ImportFrom))]
    names = [getattr(node, "module", None) or node.names[0].name for node in imports]
    loads_numpy = [name for name in names if name.partition(".")[0] not in {"importlib", "pathlib", "sys"}]
    assert loads_numpy[0].startswith("glass_nav.")
