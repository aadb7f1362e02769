"""Simulates a rotating slit of light, and tags that answer by radio when it hits them.

The device of the seed document landmark_bearings.txt, secs. 3 and 4. A motor turns a vertical slit of modulated light
in steps. It searches from coarse to fine: if a tag answers a coarse move, the emitter returns and repeats it in fine
moves; the bearing is the middle of the fine move in which the tag answered. A sweep takes about a minute with four
tags, so a moving robot takes each bearing from a different place. The emitter turns back and forth over its span, never
through the gap behind the robot.

A tag answers if the light comes from within its view, nothing opaque blocks it (walls, furniture, people), and enough
light arrives. The slit spreads in height only, so the light falls with the distance. A pane that transmits the share T
reduces the range by the factor T: tags are seen through glass, at a shorter range. The radio passes through everything.
Not modelled: light that a pane mirrors onto a tag, collisions between the answers of two tags, the width of the beam
(7 mm at 15 m).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, List, Optional, Tuple

import numpy as np

from glass_nav.geometry import angles
from glass_nav.sensing.bearings import LandmarkBearing
from glass_nav.simulation import glass, people
from glass_nav.simulation.building import PANE, Building, Surfaces, crosses, joined

OFF_WALL_M = 0.03  # the detector sticks out of the wall that its tag hangs on
PASSING_RAD = 0.5  # a tag this near the beam before and after was passed if it changed sides


@dataclass(frozen=True)
class ScannerModel:
    """The turning emitter. The defaults are the document's."""

    reading_rad: float = float(np.radians(1.0))  # size of a fine move: the resolution of bearings
    motor_step_rad: float = float(np.radians(0.18))  # where a move can end
    coarse_rad: float = float(np.radians(10.0))  # size of a coarse move
    span_rad: float = float(np.radians(300.0))
    move_s: float = 0.8  # duration of a move, coarse or fine: four tags take about 60 s

    def __post_init__(self) -> None:
        if not 0.0 < self.motor_step_rad <= self.reading_rad <= self.coarse_rad <= self.span_rad <= 2.0 * np.pi:
            raise ValueError(
                "a landmark scanner needs 0 < motor step <= reading step <= coarse move <= span <= 360 "
                "degrees, got "
                + ", ".join(
                    f"{np.degrees(value):g}"
                    for value in (self.motor_step_rad, self.reading_rad, self.coarse_rad, self.span_rad)
                )
            )
        if not 0.0 < self.move_s < np.inf:
            raise ValueError(f"a move of a landmark scanner must take > 0 s, got {self.move_s}")

    @property
    def sigma_rad(self) -> float:
        """Standard deviation of a bearing: uniform in its fine move, whose ends are off by up to half a motor step."""
        return float(np.hypot(self.reading_rad, self.motor_step_rad) / np.sqrt(12.0))


@dataclass(frozen=True)
class Turn:
    """One sweep over the span."""

    stamp_ns: int  # of its end
    bearings: Tuple[LandmarkBearing, ...]  # in the order taken


@dataclass(frozen=True)
class _Move:
    """A commanded move from one angle to another [rad]; the motor goes to its nearest step."""

    start_rad: float
    end_rad: float
    fine: bool
    listens: bool = True


class LandmarkScanner:
    """The emitter on its robot: step() it as time advances."""

    def __init__(self, model: ScannerModel, building: Building, start_ns: int = 0) -> None:
        """
        Args:
            model: of the emitter.
            building: with its tags.
            start_ns: time of the first move.
        """
        self._model, self._building = model, building
        self._move_ns = round(model.move_s * 1e9)
        self._way = 1.0  # counter-clockwise
        self._began_ns = start_ns
        self._move_queue: List[_Move] = []
        self._coarse_rad = -0.5 * model.span_rad  # where the next coarse move begins
        self._move = self._next_move()
        self._answered = False
        self._found: Dict[str, LandmarkBearing] = {}
        self._off_rad: Optional[np.ndarray] = None  # (N,) angle from the beam to each tag at the last step
        self._turns: List[Turn] = []

    def step(self, now_ns: int, map_from_sensor: np.ndarray) -> None:
        """Advance to the time now, with the sensor at a pose (3,). Steps should be short compared with a move."""
        while now_ns >= self._began_ns + self._move_ns:
            end_ns = self._began_ns + self._move_ns
            self._look(end_ns, 1.0, map_from_sensor)
            self._began_ns = end_ns
            self._after_move(end_ns)
        self._look(now_ns, (now_ns - self._began_ns) / self._move_ns, map_from_sensor)

    def take_turns(self) -> List[Turn]:
        """The sweeps that ended since the last call."""
        turns, self._turns = self._turns, []
        return turns

    def _look(self, now_ns: int, share: float, map_from_sensor: np.ndarray) -> None:
        """Hear the tags that the beam has passed since the last step."""
        start, end = self._on_motor(self._move.start_rad), self._on_motor(self._move.end_rad)
        tags = self._building.tags
        way = tags.positions_m - map_from_sensor[:2]
        off_rad = angles.wrap(np.arctan2(way[:, 1], way[:, 0]) - map_from_sensor[2] - start - share * (end - start))
        before, self._off_rad = self._off_rad, off_rad
        if before is None or not self._move.listens:
            return
        passed = (before > 0.0) != (off_rad > 0.0)
        passed &= (np.abs(before) < PASSING_RAD) & (np.abs(off_rad) < PASSING_RAD)
        for number in np.flatnonzero(passed):
            if self._is_lit(int(number), map_from_sensor[:2], now_ns):
                self._hear(tags.ids[number], now_ns)

    def _hear(self, landmark_id: str, now_ns: int) -> None:
        self._answered = True
        if self._move.fine and landmark_id not in self._found:
            middle = 0.5 * (self._move.start_rad + self._move.end_rad)
            self._found[landmark_id] = LandmarkBearing(now_ns, landmark_id, middle, self._model.sigma_rad)

    def _after_move(self, end_ns: int) -> None:
        move, model = self._move, self._model
        if not move.fine and move.listens and self._answered:  # go back and repeat it in fine moves
            count = max(int(round(abs(move.end_rad - move.start_rad) / model.reading_rad)), 1)
            edges = np.linspace(move.start_rad, move.end_rad, count + 1).tolist()
            self._move_queue = [_Move(move.end_rad, move.start_rad, False, listens=False)]
            self._move_queue += [_Move(a, b, True) for a, b in zip(edges[:-1], edges[1:])]
        self._answered = False
        if not self._move_queue and self._at_end():
            self._turns.append(Turn(end_ns, tuple(self._found.values())))
            self._found, self._way = {}, -self._way
        self._move = self._next_move()

    def _at_end(self) -> bool:
        return self._way * self._coarse_rad > 0.5 * self._model.span_rad - 1e-9

    def _next_move(self) -> _Move:
        if self._move_queue:
            return self._move_queue.pop(0)
        half = 0.5 * self._model.span_rad
        start = self._coarse_rad
        self._coarse_rad = float(np.clip(start + self._way * self._model.coarse_rad, -half, half))
        return _Move(start, self._coarse_rad, False)

    def _on_motor(self, angle_rad: float) -> float:
        return round(angle_rad / self._model.motor_step_rad) * self._model.motor_step_rad

    def _is_lit(self, number: int, sensor_m: np.ndarray, now_ns: int) -> bool:
        tags = self._building.tags
        way = sensor_m - tags.positions_m[number]
        if not tags.reaches(way[None], np.array([number])).any():
            return False
        distance = float(np.hypot(*way))
        surfaces = joined(self._building.surfaces, people.surfaces(self._building.people, now_ns * 1e-9, sensor_m))
        detector_m = tags.positions_m[number] + min(OFF_WALL_M, 0.5 * distance) * way / distance
        return light_between(surfaces, sensor_m, detector_m) * tags.range_m[number] >= distance


def light_between(surfaces: Surfaces, from_m: np.ndarray, to_m: np.ndarray) -> float:
    """Share of the light that reaches one point (2,) from another through all that is present."""
    met = crosses(from_m[None], to_m[None], surfaces.from_m, surfaces.to_m)[0] & surfaces.present
    if (met & (surfaces.kind != PANE)).any():
        return 0.0
    panes = np.flatnonzero(met)
    line = surfaces.to_m[panes] - surfaces.from_m[panes]
    way = to_m - from_m
    across = np.abs(line[:, 0] * way[1] - line[:, 1] * way[0]) / (np.hypot(line[:, 0], line[:, 1]) * np.hypot(*way))
    _, passing = glass.sheet(across, surfaces.coating[panes], surfaces.thickness_m[panes])
    return float(np.prod(passing))
