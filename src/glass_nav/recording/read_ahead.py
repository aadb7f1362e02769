"""Reads items in another thread while the caller works: reading and decompressing release the GIL."""

from __future__ import annotations

import queue
import threading
from typing import Any, Generator, Iterable, Tuple, TypeVar

T = TypeVar("T")
_WAIT_S = 0.1  # until a reader that waits for room looks whether it is still needed


def read_ahead(items: Iterable[T], count: int = 32) -> Generator[T, None, None]:
    """The same items in the same order, at most so many of them before they are asked for.

    The items are made in one other thread, which ends with the last of them or when the iterator is closed. An
    exception comes where its item would have come.

    Args:
        items: to be iterated once.
        count: >= 1.
    """
    room: "queue.Queue[Tuple[str, Any]]" = queue.Queue(count)
    closed = threading.Event()

    def put(kind: str, item: Any) -> bool:
        while not closed.is_set():
            try:
                room.put((kind, item), timeout=_WAIT_S)
                return True
            except queue.Full:
                continue
        return False

    def read() -> None:
        try:
            for item in items:
                if not put("item", item):
                    return
            put("end", None)
        except BaseException as err:  # noqa: BLE001 - whatever it is, it belongs to the caller
            put("error", err)

    reader = threading.Thread(target=read, name="read_ahead", daemon=True)
    reader.start()
    try:
        while True:
            kind, item = room.get()
            if kind == "end":
                return
            if kind == "error":
                raise item
            yield item
    finally:
        closed.set()
        reader.join()
