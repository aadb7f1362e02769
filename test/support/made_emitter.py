"""A turning emitter among tags that stand still, and the same behind a pseudo terminal, as on a serial port."""

from __future__ import annotations

import os
import pty
import select
import threading
import tty
from typing import Callable, Dict, List

import numpy as np

TAGS_DEG = {"A": -93.4, "B": -12.2, "C": -17.7, "D": 88.88}


class Turntable:
    """Tells which tags its light passed."""

    def __init__(self, tags_deg: Dict[str, float] = TAGS_DEG) -> None:
        self._tags_deg = tags_deg
        self.moves_deg = [0.0]

    def turn_to(self, angle_rad: float) -> List[str]:
        start, end = self.moves_deg[-1], float(np.degrees(angle_rad))
        self.moves_deg.append(end)
        return [tag for tag, at in self._tags_deg.items() if min(start, end) < at <= max(start, end)]


class SerialDevice:
    """`with SerialDevice() as device:` a device at device.port; device.answer says what it sends for each line."""

    def __init__(self) -> None:
        self._table = Turntable()
        self._ours, self._theirs = pty.openpty()
        tty.setraw(self._theirs)
        self.port = os.ttyname(self._theirs)
        self.answer: Callable[[str], str] = self._turn
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._serve)

    def __enter__(self) -> "SerialDevice":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.set()
        self._thread.join()
        os.close(self._ours)
        os.close(self._theirs)

    def _turn(self, line: str) -> str:
        angle = float(line.split()[1])
        return "".join(f"I {tag}\r\n" for tag in self._table.turn_to(np.radians(angle))) + f"A {angle:.2f}\r\n"

    def _serve(self) -> None:
        pending = b""
        while not self._ending.is_set():
            if not select.select([self._ours], [], [], 0.01)[0]:
                continue
            pending += os.read(self._ours, 1024)
            while b"\n" in pending:
                line, _, pending = pending.partition(b"\n")
                os.write(self._ours, self.answer(line.decode()).encode())
