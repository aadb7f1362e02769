"""glass_nav landmarks plan: expected accuracy of positions from landmarks, and where to add landmarks."""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from pathlib import Path
from typing import List, Optional

import numpy as np

from glass_nav.evaluation.plots import landmark_picture
from glass_nav.evaluation.plots.landmark_picture import Panel, Tags
from glass_nav.localization.bearings import bearing_errors, landmark_planning
from glass_nav.localization.bearings.landmark_planning import Suggestion
from glass_nav.sensing.raycast import RayCaster
from glass_nav.world import landmark_file, map_file
from glass_nav.world.grid_map import GridMap
from glass_nav.world.landmark_map import RANGE_M, VIEW_RAD, LandmarkMap

HELP = "compute the accuracy of positions all over a map, and where to add landmarks"
DESCRIPTION = """Computes the expected position error all over a map for a robot that measures bearings to the landmarks
of a file, and where more landmarks would help most. Writes the picture landmarks.png, and landmarks.yaml with the suggested
landmarks added."""
EXAMPLES = (
    "glass_nav landmarks plan floor.yaml landmarks.yaml --out plan",
    "glass_nav landmarks plan floor.yaml landmarks.yaml --add 3 --glass-map results/glass_map.yaml",
)

GOOD_M = 0.3  # the seed document's bar for a position
GLASS_PERCENT = 50  # of a cell of a glass map that lets the light through
PICTURE, FILE = "landmarks.png", "landmarks.yaml"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the subcommand."""
    parser.add_argument("map", type=Path, metavar="MAP", help="map_server .yaml or MRPT .gridmap[.gz]")
    parser.add_argument(
        "landmarks",
        type=Path,
        metavar="LANDMARKS",
        help="landmarks.yaml: sigma, and landmarks, a list of {id, position: [x, y], facing_deg, "
        "view_deg, range}; the list may be empty",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("."), metavar="DIR", help=f"for {PICTURE} and {FILE} (default .)"
    )
    parser.add_argument("--add", type=int, default=1, metavar="N", help="number of landmarks to suggest (default 1)")
    parser.add_argument(
        "--step-deg",
        type=float,
        default=1.0,
        metavar="DEG",
        help="resolution of the bearings, degrees (default 1)",
    )
    parser.add_argument(
        "--glass-map",
        type=Path,
        metavar="MAP",
        help="glass_map.yaml of glass_nav replay: landmarks are visible through glass; without it all walls hide them",
    )
    parser.add_argument(
        "--spacing",
        type=float,
        default=0.5,
        metavar="M",
        help="distance between the evaluated positions, m (default 0.5)",
    )


def usage_error(arguments: argparse.Namespace) -> Optional[str]:
    """What is wrong with the options as such, before any file is opened."""
    if arguments.add < 0:
        return f"--add must be >= 0, got {arguments.add}"
    if not 0.0 < arguments.step_deg <= 45.0:
        return f"--step-deg must be > 0 and <= 45 degrees, got {arguments.step_deg}"
    if not 0.05 <= arguments.spacing < math.inf:
        return f"--spacing must be >= 0.05 m, got {arguments.spacing}"
    return None


def main(arguments: argparse.Namespace) -> None:
    """Load, plan, write.

    Raises:
        MapError, LandmarkError, ValueError, OSError: bad input; one line.
    """
    grid_map, landmarks = map_file.load(arguments.map), landmark_file.load(arguments.landmarks)
    _check_inside(arguments, grid_map, landmarks)
    walls = RayCaster(_see_through(grid_map, arguments.glass_map))
    sigma_rad = bearing_errors.step_sigma(math.radians(arguments.step_deg))
    points = landmark_planning.points(grid_map, arguments.spacing)
    seen = landmark_planning.visible(walls, landmarks, points)
    sigma_m = bearing_errors.expected_sigma(landmarks, points, seen, sigma_rad)
    print(f"{len(points)} places, bearings in steps of {arguments.step_deg:g} degrees")
    print(f"{len(landmarks)} landmarks: {_line(sigma_m, seen.sum(axis=1))}")
    suggestions: List[Suggestion] = []
    if arguments.add:
        places = landmark_planning.candidates(grid_map, 2.0 * arguments.spacing)
        suggestions = landmark_planning.suggest(walls, landmarks, seen, points, places, sigma_rad, arguments.add)
    more = _as_map(suggestions, landmarks)
    for name, each in zip(more.ids, suggestions):
        x, y = each.position_m
        print(
            f"+ {name} at x {x:.2f} m, y {y:.2f} m, facing {math.degrees(each.facing_rad):.0f} degrees: "
            f"{_line(each.sigma_m, each.seen)}"
        )
    if len(suggestions) < arguments.add:
        print("no other place on a wall helps")
    arguments.out.mkdir(parents=True, exist_ok=True)
    landmark_file.save(
        landmarks.joined(more),
        arguments.out / FILE,
        f"{arguments.landmarks.name} and what glass_nav landmarks plan added",
    )
    panels = [
        Panel(
            f"{len(landmarks)} landmarks: {_line(sigma_m, seen.sum(axis=1))}",
            _tags(landmarks),
            _tags(_as_map([], landmarks)),
            sigma_m,
        )
    ]
    if suggestions:
        panels.append(
            Panel(
                f"with {', '.join(more.ids)}: {_line(suggestions[-1].sigma_m, suggestions[-1].seen)}",
                _tags(landmarks),
                _tags(more),
                suggestions[-1].sigma_m,
            )
        )
    landmark_picture.draw(
        arguments.out / PICTURE,
        grid_map,
        points,
        arguments.spacing,
        panels,
        f"{arguments.map}: positions from bearings in steps of {arguments.step_deg:g} degrees",
    )
    print(f"written to {arguments.out / PICTURE} and {arguments.out / FILE}")


def _check_inside(arguments: argparse.Namespace, grid_map: GridMap, landmarks: LandmarkMap) -> None:
    inside = grid_map.contains(*grid_map.cells(landmarks.positions_m))
    if not inside.all():
        number = int(np.argmin(inside))
        x, y = landmarks.positions_m[number]
        raise ValueError(
            f"{arguments.landmarks}: landmark {landmarks.ids[number]!r} at x {x:g} m, y {y:g} m lies "
            f"outside the map {arguments.map}"
        )


def _see_through(grid_map: GridMap, path: Optional[Path]) -> GridMap:
    """The map without its walls of glass."""
    if path is None:
        return grid_map
    glass = map_file.load(path)
    if glass.occupancy.shape != grid_map.occupancy.shape:
        raise ValueError(
            f"{path}: a glass map must have the cells of the map, {grid_map.occupancy.shape}, got "
            f"{glass.occupancy.shape}"
        )
    occupancy = np.where(glass.occupancy >= GLASS_PERCENT, 0, grid_map.occupancy)
    return replace(grid_map, occupancy=occupancy.astype(np.int8))


def _line(sigma_m: np.ndarray, seen: np.ndarray) -> str:
    """One line: the share of the map where a position can be computed, and its accuracy."""
    good, known = np.mean(sigma_m <= GOOD_M), np.isfinite(sigma_m)
    median = f", median sigma {np.median(sigma_m[known]):.2f} m" if known.any() else ""
    return (
        f"three or more in sight of {np.mean(seen >= 3):.0%} of the places, position within {GOOD_M:g} m (1 sigma) "
        f"at {good:.0%}{median}"
    )


def _as_map(suggestions: List[Suggestion], landmarks: LandmarkMap) -> LandmarkMap:
    """The suggestions as landmarks, with unused names."""
    names: List[str] = []
    number = 1
    while len(names) < len(suggestions):
        if f"new{number}" not in landmarks:
            names.append(f"new{number}")
        number += 1
    count = len(suggestions)
    positions_m = np.array([each.position_m for each in suggestions], float).reshape(-1, 2)
    facing_deg = np.rint(np.degrees([each.facing_rad for each in suggestions]))  # no tag is hung more exactly
    return LandmarkMap(
        tuple(names),
        np.round(positions_m, 2),
        np.radians(facing_deg),
        np.full(count, VIEW_RAD),
        np.full(count, RANGE_M),
        landmarks.sigma_m,
    )


def _tags(landmarks: LandmarkMap) -> Tags:
    return Tags(landmarks.ids, landmarks.positions_m, landmarks.facing_rad)
