"""From callback threads to the run loop: what came in, and what is asked for.

Callbacks only store; the run loop takes. No ROS in here: messages are opaque.
"""

from __future__ import annotations

import collections
import threading
from typing import Any, Callable, Deque, Dict, List, Optional, TypeVar

T = TypeVar("T")


class Mailbox:
    """Bounded lanes of items: put() from any thread, take() from the run loop.

    A lane that is full loses its oldest item, so a flood of scans cannot push out a command.
    """

    def __init__(self, **capacities: int) -> None:
        """Lanes by name, and how many items each may hold."""
        self._lanes: Dict[str, Deque[Any]] = {
            lane: collections.deque(maxlen=capacity) for lane, capacity in capacities.items()
        }
        self._changed = threading.Condition()

    def put(self, lane: str, item: Any) -> None:
        with self._changed:
            self._lanes[lane].append(item)
            self._changed.notify()

    def take(self, timeout_s: float) -> Dict[str, List[Any]]:
        """Lane -> what came since the last call, oldest first; waits for a first item up to the timeout."""
        with self._changed:
            if not any(self._lanes.values()):
                self._changed.wait(timeout_s)
            taken = {lane: list(items) for lane, items in self._lanes.items()}
            for items in self._lanes.values():
                items.clear()
            return taken

    def take_now(self, lane: str) -> List[Any]:
        """What lies in one lane, oldest first; without waiting."""
        with self._changed:
            taken = list(self._lanes[lane])
            self._lanes[lane].clear()
            return taken


class Errand:
    """Something the run loop shall do for another thread, which waits for the outcome."""

    def __init__(self, work: Callable[[], Any]) -> None:
        self._work = work
        self._done = threading.Event()
        self._error: Optional[Exception] = None
        self._abandoned = False

    def run(self) -> None:
        """Do it (run loop); a ValueError goes to the thread that waits, nothing else is caught."""
        if self._abandoned:  # nobody waits any more and was told so: doing it now would surprise
            return
        try:
            self._work()
        except ValueError as err:
            self._error = err
        finally:
            self._done.set()

    def wait(self, timeout_s: float) -> None:
        """Block until done. Raises what the work raised, or TimeoutError."""
        if not self._done.wait(timeout_s):
            self._abandoned = True
            raise TimeoutError(f"the node did not come to it within {timeout_s:g} s")
        if self._error is not None:
            raise self._error
