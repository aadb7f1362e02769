"""glass_nav landmarks limits: the document's table of position errors, for any three landmarks and step angle."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import List, Optional, Tuple

import numpy as np

from glass_nav.localization.bearings import bearing_errors
from glass_nav.world import landmark_file

HELP = "position errors for three landmarks, by the step angle of the emitter"
DESCRIPTION = """Prints how large the error of a position from three landmarks can be if the angles between them are read
in steps (Tsukiyama 2009, Tables 1 and 2), and the step that keeps the error within a limit. The landmarks are given in one of three
ways: by --tags and --at, by --ranges and --between as the document gives them, or from a file by --landmarks, --ids and
--at."""
EXAMPLES = (
    "glass_nav landmarks limits --tags 0 0 6 0 3 5 --at 3 2 --step-deg 1",
    "glass_nav landmarks limits --landmarks landmarks.yaml --ids a b c --at 3 2 --within 0.2",
)

WITHIN_M = 0.3  # the seed document's bar
WAYS = (("tags", "at"), ("ranges", "between"), ("landmarks", "ids", "at"))
_OPTIONS = ("tags", "at", "ranges", "between", "landmarks", "ids")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the task."""
    parser.add_argument(
        "--tags",
        type=float,
        nargs=6,
        metavar=("X0", "Y0", "X1", "Y1", "X2", "Y2"),
        help="three landmarks in the map, m",
    )
    parser.add_argument("--at", type=float, nargs=2, metavar=("X", "Y"), help="where the robot is in the map, m")
    parser.add_argument(
        "--ranges", type=float, nargs=3, metavar=("R0", "R1", "R2"), help="of the landmarks from the robot, m"
    )
    parser.add_argument(
        "--between",
        type=float,
        nargs=2,
        metavar=("A", "B"),
        help="angle from the first landmark to the second, and from the second to the third, counterclockwise, degrees",
    )
    parser.add_argument("--landmarks", type=Path, metavar="FILE", help="landmarks.yaml, with --ids")
    parser.add_argument("--ids", nargs=3, metavar=("ID0", "ID1", "ID2"), help="three of the landmarks of FILE")
    parser.add_argument(
        "--step-deg", type=float, default=1.0, metavar="DEG", help="largest error of an angle, degrees (default 1)"
    )
    parser.add_argument(
        "--within",
        type=float,
        default=WITHIN_M,
        metavar="M",
        help=f"limit of the error, for which a step is computed, m (default {WITHIN_M:g})",
    )


def usage_error(arguments: argparse.Namespace) -> Optional[str]:
    """What is wrong with the options as such, before any file is opened."""
    given = tuple(name for name in _OPTIONS if getattr(arguments, name) is not None)
    if set(given) not in [set(way) for way in WAYS]:
        ways = ", or ".join(" and ".join(f"--{name}" for name in way) for way in WAYS)
        got = ", ".join(f"--{name}" for name in given) or "none"
        return f"three landmarks must be given by {ways}, got {got}"
    for name in ("tags", "at", "ranges", "between"):
        values = getattr(arguments, name)
        if values is not None and not np.all(np.isfinite(values)):
            return f"--{name} must be finite, got {' '.join(f'{value:g}' for value in values)}"
    if arguments.ranges is not None and not min(arguments.ranges) > 0.0:
        return f"--ranges must be > 0 m, got {' '.join(f'{value:g}' for value in arguments.ranges)}"
    if not 0.0 < arguments.step_deg <= bearing_errors.MAX_STEP_DEG:
        return f"--step-deg must be > 0 and <= {bearing_errors.MAX_STEP_DEG:g} degrees, got {arguments.step_deg:g}"
    if not 0.0 < arguments.within < math.inf:
        return f"--within must be finite and > 0 m, got {arguments.within:g}"
    return None


def main(arguments: argparse.Namespace) -> None:
    """Print the table, and the step that keeps the limit.

    Raises:
        LandmarkError, ValueError, OSError: bad input; one line.
    """
    landmarks_m, point_m = _geometry(arguments)
    between_deg = np.degrees(bearing_errors.angles_between(landmarks_m, point_m))
    limits_m = bearing_errors.limits_of_error(landmarks_m, point_m, math.radians(arguments.step_deg))
    step_deg = math.degrees(bearing_errors.largest_step(landmarks_m, point_m, arguments.within))
    for line in table(limits_m, between_deg, arguments.step_deg):
        print(line)
    print(f"largest error {100.0 * limits_m.max():.1f} cm in steps of {arguments.step_deg:g} degrees")
    print(f"a step of at most {step_deg:.2f} degrees keeps the error within {arguments.within:g} m")


def table(limits_m: np.ndarray, between_deg: np.ndarray, step_deg: float) -> List[str]:
    """The lines of the document's table, in cm: rows the first angle, columns the second."""
    columns = between_deg[1] + step_deg * np.array(bearing_errors.STEPS)
    rows = between_deg[0] + step_deg * np.array(bearing_errors.STEPS)
    lines = ["position error [cm]; rows: angle 1 to 2 as read, columns: angle 2 to 3 [degrees]"]
    lines.append(" " * 8 + "".join(f"{column:8.2f}" for column in columns))
    lines += [
        f"{row:8.2f}" + "".join(f"{100.0 * error:8.1f}" for error in errors) for row, errors in zip(rows, limits_m)
    ]
    return lines


def _geometry(arguments: argparse.Namespace) -> Tuple[np.ndarray, np.ndarray]:
    """Positions of the landmarks (3, 2) and of the robot (2,) [m]."""
    if arguments.ranges is not None:
        direction = np.radians([0.0, arguments.between[0], sum(arguments.between)])
        return np.array(arguments.ranges)[:, None] * np.column_stack([np.cos(direction), np.sin(direction)]), np.zeros(
            2
        )
    point_m = np.array(arguments.at)
    if arguments.tags is not None:
        return np.array(arguments.tags).reshape(3, 2), point_m
    landmarks = landmark_file.load(arguments.landmarks)
    return landmarks.positions_m[landmarks.numbers(arguments.ids)], point_m
