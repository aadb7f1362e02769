"""Searches for tags with a rotating emitter, from coarse to fine.

Seed document landmark_bearings.txt, sec. 4: the emitter turns by coarse moves; where a tag answers, it turns back and
goes over that move again in fine ones; it stops as soon as all tags have been found. The bearing of a tag is the middle of the
fine move in which it answered.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Dict, List, Protocol, Sequence, Tuple

import numpy as np

from glass_nav.params import number
from glass_nav.sensing.bearings import LandmarkBearing


class Emitter(Protocol):
    """The device: a light on a turntable, and a receiver of the tags' answers."""

    def turn_to(self, angle_rad: float) -> Sequence[str]:
        """Turn to an angle, counterclockwise from its own x axis; the ids of tags that answered on the way."""


@dataclass(frozen=True)
class EmitterSearchParams:
    """The moves of a search. The defaults are the document's."""

    coarse_step_deg: float = number(10.0, 0.01, 360.0)
    fine_step_deg: float = number(1.0, 0.01, 360.0)
    motor_step_deg: float = number(0.18, 0.0, 360.0)  # where the turntable can stop
    span_deg: float = number(300.0, 0.01, 360.0)  # that it turns over, the middle straight ahead
    tag_count: int = number(
        0, 0, 1000
    )  # of the tags in range: the search stops when they are found; 0: all of the span

    def __post_init__(self) -> None:
        if not self.motor_step_deg <= self.fine_step_deg <= self.coarse_step_deg <= self.span_deg:
            raise ValueError(
                "~motor_step_deg, ~fine_step_deg, ~coarse_step_deg and ~span_deg must ascend, got "
                f"{self.motor_step_deg:g}, {self.fine_step_deg:g}, {self.coarse_step_deg:g} and {self.span_deg:g}"
            )

    @property
    def sigma_rad(self) -> float:
        """Standard deviation of a bearing: uniform in its fine move, whose ends are off by up to half a motor step."""
        return float(np.radians(np.hypot(self.fine_step_deg, self.motor_step_deg)) / np.sqrt(12.0))


class EmitterSearch:
    """A search over the span; the next one goes the other way."""

    def __init__(self, p: EmitterSearchParams, way: int = 1) -> None:
        """
        Args:
            p: the moves.
            way: 1 counterclockwise, -1 clockwise.
        """
        self._p, self._way = p, way
        self._found: Dict[str, LandmarkBearing] = {}

    def run(
        self, emitter: Emitter, now_ns: Callable[[], int], go_on: Callable[[], bool] = lambda: True
    ) -> Tuple[LandmarkBearing, ...]:
        """Search; the bearings in the order taken.

        Args:
            emitter: the device.
            now_ns: the time, for the stamps of bearings.
            go_on: False: the search ends early.
        """
        edges = self._edges(
            -0.5 * self._p.span_deg * self._way, 0.5 * self._p.span_deg * self._way, self._p.coarse_step_deg
        )
        emitter.turn_to(edges[0])
        for start_rad, end_rad in zip(edges[:-1], edges[1:]):
            answered = emitter.turn_to(end_rad)
            if self._is_new(answered):
                self._look_closer(emitter, start_rad, end_rad, now_ns)
            if self._is_complete or not go_on():
                break
        return tuple(self._found.values())

    def _look_closer(self, emitter: Emitter, start_rad: float, end_rad: float, now_ns: Callable[[], int]) -> None:
        """Go back, and repeat the last coarse move in fine steps."""
        emitter.turn_to(start_rad)
        fine = self._edges(float(np.degrees(start_rad)), float(np.degrees(end_rad)), self._p.fine_step_deg)
        for before_rad, after_rad in zip(fine[:-1], fine[1:]):
            for tag in emitter.turn_to(after_rad):
                middle_rad = 0.5 * (before_rad + after_rad)
                self._found.setdefault(tag, LandmarkBearing(now_ns(), tag, middle_rad, self._p.sigma_rad))

    def _is_new(self, answered: Sequence[str]) -> bool:
        return any(tag not in self._found for tag in answered)

    @property
    def _is_complete(self) -> bool:
        return 0 < self._p.tag_count <= len(self._found)

    @staticmethod
    def _edges(start_deg: float, end_deg: float, step_deg: float) -> List[float]:
        """Angles [rad] from start to end, a step apart; the last step may be shorter."""
        count = max(int(np.ceil(abs(end_deg - start_deg) / step_deg - 1e-6)), 1)
        steps = start_deg + np.sign(end_deg - start_deg) * step_deg * np.arange(count)
        return [float(each) for each in np.radians(np.append(steps, end_deg))]
