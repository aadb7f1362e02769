"""Passes messages from callback threads to the run loop: callbacks only store, the run loop takes."""

from __future__ import annotations

import collections
import concurrent.futures
import threading
from concurrent.futures import Future
from typing import Any, Callable, Deque, Dict, List, TypeVar

T = TypeVar("T")


class Mailbox:
    """Bounded lanes of items: put() from any thread, take() from the run loop.

    A full lane drops its oldest item, so a flood of scans cannot displace a command.
    """

    def __init__(self, **capacities: int) -> None:
        """Names of the lanes, and how many items each may hold."""
        self._lanes: Dict[str, Deque[Any]] = {
            lane: collections.deque(maxlen=capacity) for lane, capacity in capacities.items()
        }
        self._changed = threading.Condition()

    def put(self, lane: str, item: Any) -> None:
        with self._changed:
            self._lanes[lane].append(item)
            self._changed.notify()

    def submit(self, lane: str, work: Callable[[], T]) -> "Future[T]":
        """Put a callable into a lane; the future completes when the run loop has called it. See outcome()."""
        future: "Future[T]" = Future()
        self.put(lane, lambda: _run(work, future))
        return future

    def take(self, timeout_s: float) -> Dict[str, List[Any]]:
        """Lane -> items since the last call, oldest first; waits for a first item up to the timeout."""
        with self._changed:
            if not any(self._lanes.values()):
                self._changed.wait(timeout_s)
            taken = {lane: list(items) for lane, items in self._lanes.items()}
            for items in self._lanes.values():
                items.clear()
            return taken

    def take_now(self, lane: str) -> List[Any]:
        """The items in one lane, oldest first, without waiting."""
        with self._changed:
            taken = list(self._lanes[lane])
            self._lanes[lane].clear()
            return taken


def outcome(future: "Future[T]", timeout_s: float) -> T:
    """What a call by Mailbox.submit() returned or raised. TimeoutError if it has not finished; it is cancelled
    if it has not begun.
    """
    try:
        return future.result(timeout_s)
    except concurrent.futures.TimeoutError:
        future.cancel()  # its failure is reported to the caller: a later call would be a surprise
        raise TimeoutError(f"the node did not answer within {timeout_s:g} s") from None


def _run(work: Callable[[], T], future: "Future[T]") -> None:
    """Do the work and set the future; as an executor does, but other errors than ValueError end the run loop too."""
    if not future.set_running_or_notify_cancel():
        return
    try:
        future.set_result(work())
    except ValueError as err:
        future.set_exception(err)
    except BaseException as err:
        future.set_exception(err)
        raise
