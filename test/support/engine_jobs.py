"""Work for the tests of the engine; in a file of its own, as other processes import it."""

from __future__ import annotations

import os
import signal
from pathlib import Path


def squared(job, step_done):
    """job * job, in so many steps; negative jobs cannot be done."""
    if job < 0:
        raise ValueError(f"{job} is\nnegative")
    for _ in range(job):
        step_done()
    return job * job


def process(job, step_done):
    """Which process did it."""
    return os.getpid()


def squared_or_ended(job, step_done):
    """ "end" ends its process without a word, as a kernel does that is out of memory."""
    return os._exit(1) if job == "end" else squared(job, step_done)


def ended_once(job, step_done):
    """Ends its process where the file that the job names is missing, and writes it."""
    step_done()
    if not Path(job).exists():
        Path(job).touch()
        os._exit(1)
    return "done"


def killed(job, step_done):
    """Kills the process of this number."""
    os.kill(job, signal.SIGKILL)
