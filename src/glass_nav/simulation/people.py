"""Where walking people are at a time."""

from __future__ import annotations

from typing import List, Sequence, Tuple

import numpy as np

from glass_nav.simulation.building import Person, Surfaces, outline_rows, surfaces_from_rows

CORNERS = 12  # a person is a polygon
REFLECTANCE = 0.4  # of trousers
STEP_ASIDE_M = 0.45  # from the middle of the robot to the edge of a person: nearer than this nobody comes


def position(person: Person, time_s: float) -> np.ndarray:
    """(2,) place [m] of somebody who starts at the first waypoint, walks to the last and back, for ever."""
    lengths = np.hypot(*np.diff(person.waypoints_m, axis=0).T)
    total = float(lengths.sum())
    walked = (person.speed_m_s * time_s) % (2.0 * total)
    walked = min(walked, 2.0 * total - walked)
    at = np.concatenate([[0.0], np.cumsum(lengths)])
    return np.array([np.interp(walked, at, person.waypoints_m[:, 0]), np.interp(walked, at, person.waypoints_m[:, 1])])


def surfaces(people: Sequence[Person], time_s: float, robot_m: np.ndarray) -> Surfaces:
    """Outlines of all people at a time, on no map; who would bump into the robot at robot_m (2,) has stepped aside."""
    turn = 2.0 * np.pi * np.arange(CORNERS) / CORNERS
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    rows: List[Tuple[float, ...]] = []
    for person in people:
        middle = position(person, time_s)
        if np.hypot(*(middle - robot_m)) > person.radius_m + STEP_ASIDE_M:
            rows += outline_rows(middle + person.radius_m * circle, False, True, REFLECTANCE)
    return surfaces_from_rows(rows)
