"""The positions of walking people at a given time."""

from __future__ import annotations

from typing import List, Sequence, Tuple

import numpy as np

from glass_nav.simulation.building import Person, Surfaces, outline_rows, surfaces_from_rows

CORNERS = 12  # a person is a polygon
REFLECTANCE = 0.4  # of trousers
STEP_ASIDE_M = 0.45  # least distance from the robot's centre to a person's edge


def position(person: Person, time_s: float) -> np.ndarray:
    """(2,) place [m] of a person who walks from the first waypoint to the last and back, forever."""
    lengths = np.hypot(*np.diff(person.waypoints_m, axis=0).T)
    total = float(lengths.sum())
    walked = (person.speed_m_s * time_s) % (2.0 * total)
    walked = min(walked, 2.0 * total - walked)
    at = np.concatenate([[0.0], np.cumsum(lengths)])
    return np.array([np.interp(walked, at, person.waypoints_m[:, 0]), np.interp(walked, at, person.waypoints_m[:, 1])])


def surfaces(people: Sequence[Person], time_s: float, robot_m: np.ndarray) -> Surfaces:
    """Outlines of all people at a time, unmapped; they step aside for a robot at robot_m (2,)."""
    turn = 2.0 * np.pi * np.arange(CORNERS) / CORNERS
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    rows: List[Tuple[float, ...]] = []
    for person in people:
        middle = position(person, time_s)
        if np.hypot(*(middle - robot_m)) > person.radius_m + STEP_ASIDE_M:
            rows += outline_rows(middle + person.radius_m * circle, False, True, REFLECTANCE)
    return surfaces_from_rows(rows)
