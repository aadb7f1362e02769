"""Many independent jobs at once: in this process, on its cores, or on the machines of a Dask cluster.

Processes of this machine are Python's own; those of other machines are the work of dask.distributed, an optional
package. The answers come back in the order of the jobs, whatever ran them.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
import sys
import threading
import time
from collections import deque
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Optional, Sequence, Set, Tuple, Union

CONNECT_S, JOIN_S = 10.0, 60.0  # that a scheduler, and its first worker, may take
CHECK_S = 60.0  # between two looks whether it still has a worker
REPORT_S = 0.2  # between two reports of a worker on how far it is
TOPIC = "glass_nav_steps"
ATTEMPTS = 2  # at a job whose process ends
DIED = "its process died, out of memory?"


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
        EngineError: Dask is missing, no scheduler answers, or it has no worker.
    """
    if scheduler is not None:
        return _on_scheduler(jobs, work, step_done, scheduler)
    if cores > 1 and len(jobs) > 1:
        return _on_cores(jobs, work, step_done, min(cores, len(jobs)))
    return [_answered(work, job, lambda: step_done(1)) for job in jobs]


def _on_cores(jobs: Sequence[Any], work: Work, step_done: Callable[[int], None], cores: int) -> List[Any]:
    steps = _Steps(step_done)
    answers: Dict[int, Any] = {}
    attempts = [0] * len(jobs)
    waiting = deque(range(len(jobs)))
    running: "Dict[Any, Tuple[_Process, int]]" = {}  # by its connection
    with contextlib.ExitStack() as stack:

        def start_next(process: "_Process") -> None:
            if waiting:
                number = waiting.popleft()
                attempts[number] += 1
                process.start(jobs[number])
                running[process.connection] = process, number

        for _ in range(cores):
            start_next(stack.enter_context(_Process(work)))
        while running:
            for connection in wait(list(running)):
                process, number = running[connection]
                report = process.report()
                if isinstance(report, int):
                    steps.reached(number, report)
                    continue
                del running[connection]
                if report is not None:
                    steps.reached(number, report.steps, last=True)
                    answers[number] = report.answer
                else:
                    if attempts[number] < ATTEMPTS:
                        waiting.appendleft(number)
                    else:
                        answers[number] = Failed(jobs[number], DIED)
                    if not waiting:
                        continue
                    process = stack.enter_context(_Process(work))
                start_next(process)
    return [answers[number] for number in range(len(jobs))]


@dataclass(frozen=True)
class _Ended:
    """What a process reports after a job, once it has done this number of steps."""

    steps: int
    answer: Any


class _Process:
    """A worker process that does one job after the other; as a context manager it ends the process."""

    def __init__(self, work: Work) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, its_end = context.Pipe()
        self._process = context.Process(target=_serve, args=(its_end, work), daemon=True)
        with _package_first():
            self._process.start()
        its_end.close()  # the process has the only one now, so that its death ends the connection

    def __enter__(self) -> "_Process":
        return self

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        self._process.join()
        self.connection.close()

    def start(self, job: Any) -> None:
        with contextlib.suppress(OSError):  # it died: report() says so
            self.connection.send(job)

    def report(self) -> "Union[int, _Ended, None]":
        """Waits for the number of steps done so far, the end of the job, or None: the process has died."""
        try:
            return self.connection.recv()  # type: ignore[no-any-return]
        except (EOFError, OSError):
            return None


def _serve(connection: "Connection", work: Work) -> None:
    """Main function of a worker process: do the jobs that arrive on the connection."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that started this one
    while True:
        try:
            job = connection.recv()
        except EOFError:
            return
        counter = _Counter(connection.send)
        try:
            answer = _answered(work, job, counter.step)
        except Exception as err:  # noqa: BLE001 - the other jobs go on
            answer = Failed(job, f"{type(err).__name__}: {_line(err)}")
        connection.send(_Ended(counter.count, answer))


def _on_scheduler(jobs: Sequence[Any], work: Work, step_done: Callable[[int], None], address: str) -> List[Any]:
    try:
        import distributed
    except ImportError as err:
        raise EngineError(f"--scheduler needs the Python package distributed (pip install distributed): {err}") from err
    try:
        client = distributed.Client(address, timeout=CONNECT_S)
    except (OSError, ValueError, distributed.TimeoutError) as err:
        raise EngineError(f"no Dask scheduler answers at {address}: {_line(err)}") from err
    with client:
        try:
            client.wait_for_workers(1, timeout=JOIN_S)
        except (OSError, distributed.TimeoutError) as err:
            raise EngineError(f"no worker has joined the Dask scheduler at {address} within {JOIN_S:g} s") from err
        try:
            return _gathered(distributed, client, jobs, work, step_done, address)
        except (distributed.CancelledError, OSError) as err:
            raise EngineError(f"the Dask scheduler at {address} does not answer any more") from err


def _gathered(
    distributed: Any, client: Any, jobs: Sequence[Any], work: Work, step_done: Callable[[int], None], address: str
) -> List[Any]:
    futures = [client.submit(_counted, work, job, number, pure=False) for number, job in enumerate(jobs)]
    number_of = {future.key: number for number, future in enumerate(futures)}
    steps = _Steps(step_done)
    answers: Dict[int, Any] = {}
    client.subscribe_topic(TOPIC, steps.heard)
    try:
        waiting = set(futures)
        while waiting:
            for future in _done(distributed, client, waiting, address):
                waiting.remove(future)
                number, error = number_of[future.key], future.exception()
                if error is None:
                    answers[number], count = future.result()
                    steps.reached(number, count, last=True)
                else:  # what _counted() lets through: its process was killed, or lacks the package
                    died = isinstance(error, distributed.KilledWorker)
                    answers[number] = Failed(jobs[number], DIED if died else f"{type(error).__name__}: {_line(error)}")
    finally:
        client.unsubscribe_topic(TOPIC)
    return [answers[number] for number in range(len(jobs))]


def _done(distributed: Any, client: Any, futures: "Set[Any]", address: str) -> "Set[Any]":
    """Wait until at least one future is done; fail when the scheduler has no worker left."""
    while True:
        try:
            return set(distributed.wait(futures, timeout=CHECK_S, return_when="FIRST_COMPLETED").done)
        except distributed.TimeoutError:
            if client.status != "running":
                raise OSError("connection lost") from None
            if not client.scheduler_info()["workers"]:
                raise EngineError(f"the Dask scheduler at {address} has lost its last worker") from None


class _Steps:
    """Adds up what the workers report; a report may come late, or again when a job is done a second time."""

    def __init__(self, step_done: Callable[[int], None]) -> None:
        self._step_done, self._lock = step_done, threading.Lock()
        self._counts: Dict[int, int] = {}
        self._ended: "set[int]" = set()

    def heard(self, event: "Tuple[float, Tuple[int, int]]") -> None:
        """Take a report from a worker, in the client's own thread."""
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


class _Counter:
    """Counts the steps of a job, and reports their number from time to time."""

    def __init__(self, report: Callable[[int], None]) -> None:
        self._report, self._reported_s = report, time.monotonic()
        self.count = 0

    def step(self) -> None:
        self.count += 1
        if time.monotonic() - self._reported_s >= REPORT_S:
            self._reported_s = time.monotonic()
            self._report(self.count)


def _counted(work: Work, job: Any, number: int) -> "Tuple[Any, int]":
    """Run a job on a Dask worker; returns its answer and the number of its steps."""
    from distributed import get_worker

    worker = get_worker()
    counter = _Counter(lambda count: worker.log_event(TOPIC, (number, count)))
    return _answered(work, job, counter.step), counter.count


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
