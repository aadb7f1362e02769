"""A rotating emitter on a serial port, controlled by lines of text.

    to the device     T -150.00       turn to that angle [degrees], counterclockwise from ahead
    from the device   I A1            the tag A1 answered
                      A -150.00       arrived

Another device needs another class with turn_to(). No package beside Python's own is needed.
"""

from __future__ import annotations

import os
import select
import termios
import time
from types import TracebackType
from typing import List, Optional, Type

import numpy as np

BAUD_RATES = {9600: termios.B9600, 19200: termios.B19200, 57600: termios.B57600, 115200: termios.B115200}
_LONGEST_LINE = 200


class EmitterError(OSError):
    """The device does not answer, or not in its language; one line: the port, what was awaited, what came."""


class SerialEmitter:
    """`with SerialEmitter(port) as emitter:` the device on a port."""

    def __init__(self, port: str, baud: int = 9600, timeout_s: float = 10.0) -> None:
        """
        Args:
            port: such as /dev/ttyUSB0.
            baud: one of BAUD_RATES.
            timeout_s: for a move.

        Raises:
            EmitterError: the port cannot be opened.
            ValueError: another rate.
        """
        if baud not in BAUD_RATES:
            raise ValueError(f"~baud must be one of {', '.join(map(str, BAUD_RATES))}, got {baud}")
        self._port, self._timeout_s = port, timeout_s
        self._pending = b""
        try:
            self._file = os.open(port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError as err:
            raise EmitterError(f"{port}: cannot be opened: {err.strerror}") from err
        try:
            self._set_raw(BAUD_RATES[baud])
        except termios.error as err:
            os.close(self._file)
            raise EmitterError(f"{port}: is not a serial port: {err.args[-1]}") from err

    def __enter__(self) -> "SerialEmitter":
        return self

    def __exit__(
        self, kind: Optional[Type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        os.close(self._file)

    def turn_to(self, angle_rad: float) -> List[str]:
        """Turn to an angle; the ids of tags that answered on the way.

        Raises:
            EmitterError: the device does not arrive in time, or says something else.
        """
        angle_deg = f"{np.degrees(angle_rad):.2f}"
        os.write(self._file, f"T {angle_deg}\n".encode())
        until_s = time.monotonic() + self._timeout_s
        answered: List[str] = []
        while True:
            line = self._line(until_s, angle_deg)
            kind, _, rest = line.partition(" ")
            if kind == "A":
                return answered
            if kind != "I" or not rest:
                raise EmitterError(f"{self._port}: expected 'I ID' or 'A ANGLE', got {line!r}")
            if rest not in answered:
                answered.append(rest)

    def _line(self, until_s: float, angle_deg: str) -> str:
        while b"\n" not in self._pending:
            left_s = until_s - time.monotonic()
            if left_s <= 0.0 or not select.select([self._file], [], [], left_s)[0]:
                raise EmitterError(f"{self._port}: did not arrive at {angle_deg} degrees within {self._timeout_s:g} s")
            try:
                read = os.read(self._file, 1024)
            except OSError as err:
                raise EmitterError(f"{self._port}: cannot be read: {err.strerror}") from err
            if not read or len(self._pending) > _LONGEST_LINE:
                raise EmitterError(f"{self._port}: {'was closed' if not read else 'sends no lines of text'}")
            self._pending += read
        line, _, self._pending = self._pending.partition(b"\n")
        return line.decode("ascii", "replace").strip()

    def _set_raw(self, speed: int) -> None:
        """8 data bits, no parity, no echo, no translation of characters."""
        settings = termios.tcgetattr(self._file)
        settings[0] = settings[1] = settings[3] = 0
        settings[2] = termios.CS8 | termios.CREAD | termios.CLOCAL
        settings[4] = settings[5] = speed
        termios.tcsetattr(self._file, termios.TCSANOW, settings)
        termios.tcflush(self._file, termios.TCIOFLUSH)
