"""Many independent jobs at once: in this process, on its cores by joblib, or on the machines of a Dask cluster.

The answers come back in the order of the jobs, whatever ran them. joblib and distributed are optional packages.
"""

from __future__ import annotations

import contextlib
import os
import sys
import tempfile
import threading
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Optional, Sequence, Union

POLL_S = 0.2
CONNECT_S, WORKER_S = 10.0, 60.0


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
        work: answers one job; tells by its second argument of each step that it has done.
        step_done: called with how many more steps are done, by one thread at a time.
        cores: processes on this machine.
        scheduler: address of a Dask scheduler instead; its workers need this package and the files of the jobs.

    Raises:
        EngineError: a package is missing, or no scheduler answers.
    """
    if scheduler is not None:
        return _on_dask(jobs, work, step_done, scheduler)
    if cores > 1 and len(jobs) > 1:
        return _on_cores(jobs, work, step_done, min(cores, len(jobs)))
    return [_answered(work, job, lambda: step_done(1)) for job in jobs]


def _answered(work: Work, job: Any, step: Callable[[], None]) -> Any:
    try:
        return work(job, step)
    except (ValueError, OSError) as err:  # bad input, as the errors of this package are
        return Failed(job, _line(err) or type(err).__name__)


def _on_cores(jobs: Sequence[Any], work: Work, step_done: Callable[[int], None], cores: int) -> List[Any]:
    try:
        import joblib
    except ImportError as err:
        raise EngineError(
            f"more than one job at a time needs the Python package joblib (pip install joblib): {err}"
        ) from err
    with tempfile.TemporaryDirectory(prefix="glass_nav_") as folder:
        ticks = Path(folder) / "ticks"
        ticks.touch()
        answers: List[Any] = []
        # One thread for linear algebra in each: the cores are taken already.
        with _Watched(ticks, step_done), _package_first(), joblib.parallel_backend(
            "loky", n_jobs=cores, inner_max_num_threads=1
        ):
            try:
                parallel = joblib.Parallel(return_as="generator")
            except TypeError as err:
                raise EngineError(f"joblib {joblib.__version__} is too old, 1.3 or later is needed") from err
            try:
                for answer in parallel(joblib.delayed(_ticking)(work, job, str(ticks)) for job in jobs):
                    answers.append(answer)
            except BrokenProcessPool:  # it ends them all, and does not say which job it was
                answers += [
                    Failed(job, "a process ended on its own, out of memory? (fewer --jobs need less)")
                    for job in jobs[len(answers) :]
                ]
        return answers


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


def _ticking(work: Work, job: Any, ticks: str) -> Any:
    """In another process: each step is a byte at the end of a file."""
    with open(ticks, "ab", buffering=0) as file:
        return _answered(work, job, lambda: _tick(file))


def _tick(file: Any) -> None:
    file.write(b".")


class _Watched:
    """Tells of the bytes that are added to a file, while it is open."""

    def __init__(self, path: Path, step_done: Callable[[int], None]) -> None:
        self._path, self._step_done, self._seen = path, step_done, 0
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> None:
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        self._look()

    def _watch(self) -> None:
        while not self._ended.wait(POLL_S):
            self._look()

    def _look(self) -> None:
        size = os.path.getsize(self._path)
        if size > self._seen:
            self._step_done(size - self._seen)
            self._seen = size


def _on_dask(jobs: Sequence[Any], work: Work, step_done: Callable[[int], None], address: str) -> List[Any]:
    """A job's steps are told when it is done: its worker may be on another machine."""
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
            client.wait_for_workers(1, timeout=WORKER_S)
        except (OSError, distributed.TimeoutError) as err:
            raise EngineError(f"no worker has joined the Dask scheduler at {address} within {WORKER_S:g} s") from err
        futures = [client.submit(_counted, work, job, pure=False) for job in jobs]
        job_of = {future.key: job for future, job in zip(futures, jobs)}
        answers: Dict[str, Any] = {}
        for future in distributed.as_completed(futures):
            error = future.exception()  # what _counted() lets through: a worker that was killed or lacks the package
            answers[future.key], steps = (
                future.result()
                if error is None
                else (Failed(job_of[future.key], f"{type(error).__name__}: {_line(error)}"), 0)
            )
            step_done(steps)
        return [answers[future.key] for future in futures]


def _line(err: BaseException) -> str:
    return " ".join(str(err).split())


def _counted(work: Work, job: Any) -> "tuple[Any, int]":
    """The answer, and how many steps it took."""
    steps: List[None] = []
    return _answered(work, job, lambda: steps.append(None)), len(steps)
