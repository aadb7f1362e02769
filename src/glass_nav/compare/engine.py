"""Many independent jobs at once: in this process, on its cores, or on the machines of a Dask cluster.

More than one at a time is the work of dask.distributed, an optional package: `cores` starts a cluster of processes on
this machine. The answers come back in the order of the jobs, whatever ran them.
"""

from __future__ import annotations

import contextlib
import logging
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Optional, Sequence, Tuple, Union

CONNECT_S, WORKER_S = 10.0, 60.0
REPORT_S = 0.2  # between two reports of a worker on how far it is
TOPIC = "glass_nav_steps"
ATTEMPTS = 2  # at a job whose process ends


class EngineError(ValueError):
    """The engine cannot be had; one line."""


@dataclass(frozen=True)
class Failed:
    """A job that could not be done, and why: one line. The others go on."""

    job: Any
    reason: str


Work = Callable[[Any, Callable[[], None]], Any]  # (job, step_done) -> answer; a function of a module, not a local one


def run(
    jobs: Sequence[Any], work: Work, step_done: Callable[[int], None], cores: int = 1, scheduler: Optional[str] = None
) -> "List[Union[Any, Failed]]":
    """The answer to each job, or why there is none.

    Args:
        jobs: what pickle can send.
        work: answers one job; calls its second argument after each step.
        step_done: called with the number of further steps that are done, by one thread at a time.
        cores: processes on this machine.
        scheduler: address of a Dask scheduler instead; its workers need this package and the files of the jobs.

    Raises:
        EngineError: the package is missing, or no scheduler answers.
    """
    if scheduler is not None:
        return _on_scheduler(jobs, work, step_done, scheduler)
    if cores > 1 and len(jobs) > 1:
        return _on_cores(jobs, work, step_done, min(cores, len(jobs)))
    return [_answered(work, job, lambda: step_done(1)) for job in jobs]


def _on_cores(jobs: Sequence[Any], work: Work, step_done: Callable[[int], None], cores: int) -> List[Any]:
    distributed = _distributed(f"--jobs {cores}")
    import dask

    settings = {"distributed.scheduler.allowed-failures": ATTEMPTS - 1}
    with dask.config.set(settings), _package_first(), distributed.LocalCluster(
        n_workers=cores,
        threads_per_worker=1,
        processes=True,
        memory_limit=0,  # the kernel's alone
        dashboard_address=None,
        silence_logs=logging.CRITICAL,
    ) as cluster, distributed.Client(cluster) as client:
        return _gathered(distributed, client, jobs, work, step_done)


def _on_scheduler(jobs: Sequence[Any], work: Work, step_done: Callable[[int], None], address: str) -> List[Any]:
    distributed = _distributed("--scheduler")
    try:
        client = distributed.Client(address, timeout=CONNECT_S)
    except (OSError, ValueError, distributed.TimeoutError) as err:
        raise EngineError(f"no Dask scheduler answers at {address}: {_line(err)}") from err
    with client:
        try:
            client.wait_for_workers(1, timeout=WORKER_S)
        except (OSError, distributed.TimeoutError) as err:
            raise EngineError(f"no worker has joined the Dask scheduler at {address} within {WORKER_S:g} s") from err
        return _gathered(distributed, client, jobs, work, step_done)


def _distributed(option: str) -> Any:
    try:
        import distributed
    except ImportError as err:
        raise EngineError(f"{option} needs the Python package distributed (pip install distributed): {err}") from err
    return distributed


def _gathered(
    distributed: Any, client: Any, jobs: Sequence[Any], work: Work, step_done: Callable[[int], None]
) -> List[Any]:
    futures = [client.submit(_counted, work, job, number, pure=False) for number, job in enumerate(jobs)]
    number_of = {future.key: number for number, future in enumerate(futures)}
    steps = _Steps(step_done)
    answers: Dict[int, Any] = {}
    client.subscribe_topic(TOPIC, steps.heard)
    try:
        for future in distributed.as_completed(futures):
            number, error = number_of[future.key], future.exception()
            if error is None:
                answers[number], count = future.result()
                steps.reached(number, count, last=True)
            else:  # what _counted() lets through: its process was killed, or lacks the package
                died = isinstance(error, distributed.KilledWorker)
                reason = "its process died, out of memory?" if died else f"{type(error).__name__}: {_line(error)}"
                answers[number] = Failed(jobs[number], reason)
    finally:
        client.unsubscribe_topic(TOPIC)
    return [answers[number] for number in range(len(jobs))]


class _Steps:
    """Adds up what the workers report; a report may come late, or again when a job is done a second time."""

    def __init__(self, step_done: Callable[[int], None]) -> None:
        self._step_done, self._lock = step_done, threading.Lock()
        self._counts: Dict[int, int] = {}
        self._ended: "set[int]" = set()

    def heard(self, event: "Tuple[float, Tuple[int, int]]") -> None:
        """From a worker, in the client's own thread."""
        number, count = event[1]
        self.reached(number, count)

    def reached(self, number: int, count: int, last: bool = False) -> None:
        """A job has done so many steps in all."""
        with self._lock:
            before = self._counts.get(number, 0)
            if number not in self._ended and count > before:
                self._counts[number] = count
                self._step_done(count - before)
            if last:
                self._ended.add(number)


def _counted(work: Work, job: Any, number: int) -> "Tuple[Any, int]":
    """On a worker: the answer, and how many steps it took."""
    from distributed import get_worker

    worker, count, reported_s = get_worker(), 0, time.monotonic()

    def step() -> None:
        nonlocal count, reported_s
        count += 1
        if time.monotonic() - reported_s >= REPORT_S:
            reported_s = time.monotonic()
            worker.log_event(TOPIC, (number, count))

    return _answered(work, job, step), count


def _answered(work: Work, job: Any, step: Callable[[], None]) -> Any:
    try:
        return work(job, step)
    except (ValueError, OSError) as err:  # bad input, as the errors of this package are
        return Failed(job, _line(err) or type(err).__name__)


@contextlib.contextmanager
def _package_first() -> Iterator[None]:
    """New processes get the search path of this one, in which catkin's __init__.py puts the sources before itself, and
    they have no compiled modules: let them find the package where this process found it.
    """
    import glass_nav

    folder = str(Path(glass_nav.__path__[0]).parent)
    sys.path.insert(0, folder)
    try:
        yield
    finally:
        sys.path.remove(folder)  # the first of that name


def _line(err: BaseException) -> str:
    return " ".join(str(err).split())
