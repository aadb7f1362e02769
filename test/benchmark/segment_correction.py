#!/usr/bin/env python3
"""A scan aligned with wall segments of a map: quality around the truth, region of convergence, speed.

    python test/benchmark/segment_correction.py                   the simulated buildings, some minutes
    python test/benchmark/segment_correction.py --out pictures/   also draws Emse, Ecf and the combined measure
    python test/benchmark/segment_correction.py --tasks speed
    python test/benchmark/segment_correction.py --tasks judge --logs intel uob_trace0

quality: Emse, Ecf and the combined measure over a grid of offsets from the true pose, of scans as they are and with a
third of the beams ending at people. basin: share of random starts within 0.5 m and 10 degrees that end within 2 cm and
0.3 degrees of the truth, not counting a direction that the walls leave free (a hallway). With beams whose true case is
1, 3 or 4, with all beams, and as in `glass_nav locate`, which has to estimate the cases; next to the document's method,
and point-to-point ICP on the wall cells by scipy's KD-tree. speed: CPU time of a correction of 541 points against 500
segments. judge: do the measures distinguish right poses from wrong ones that a scan was aligned to, better than the fit
that `~status` uses?

Exit 1 if a best value is not at the truth, if fewer than 95 % of the starts in rooms converge with known cases, or if a
correction takes more than 3 ms of CPU time.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path
from typing import Callable, Dict, List, NamedTuple, Tuple

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import numpy as np
from scipy.spatial import cKDTree

sys.path.append(str(Path(__file__).resolve().parent))

import drives
import replay_logs
import tracks
from glass_nav.geometry import angles, se2
from glass_nav.localization.particle_filter import importance_weights
from glass_nav.hypotheses import scan_alignment
from glass_nav.localization.segments.segment_correction import SegmentCorrectionParams, SegmentCorrector
from glass_nav.localization.segments.segment_locator import SegmentLocator
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.raycast import RayCaster
from glass_nav.world import wall_segments
from glass_nav.world.grid_map import GridMap

TASKS = ("quality", "basin", "speed", "judge")
REACH_M, REACH_RAD = 0.5, np.radians(10.0)
RIGHT_M, RIGHT_RAD = 0.02, np.radians(0.3)
BAR_SHARE, BAR_MS = 0.95, 3.0
GRID_M = np.linspace(-0.5, 0.5, 51)
GRID_RAD = np.radians(np.linspace(-10.0, 10.0, 41))
NEAR_STEPS = 2  # of the grids: a best value so far from the truth is at it
PEOPLE_SHARE = 1.0 / 3.0
POINTS, SEGMENTS = 541, 500


class Icp:
    """Point to point on the centres of the wall cells, without pairs that are far apart; the reach shrinks."""

    def __init__(self, grid_map: GridMap, iterations: int = 15, first_m: float = 1.0) -> None:
        self._cells = grid_map.centres(*np.nonzero(grid_map.occupied))
        self._tree = cKDTree(self._cells)
        self._reaches_m = first_m * (1.0 - np.arange(iterations) / iterations)

    def correct(self, points: np.ndarray, pose: np.ndarray) -> np.ndarray:
        pose = np.array(pose, float)
        for reach_m in self._reaches_m:
            placed = se2.transform_points(pose, points)
            away, cell = self._tree.query(placed, distance_upper_bound=reach_m)
            paired = np.isfinite(away)
            if np.count_nonzero(paired) < 3:
                return pose
            here, there = placed[paired], self._cells[cell[paired]]
            a, b = here - here.mean(axis=0), there - there.mean(axis=0)
            turn = np.arctan2(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b))
            step = np.append(there.mean(axis=0) - se2.transform_points(np.array([0, 0, turn]), here.mean(axis=0)), turn)
            pose = se2.compose(step, pose)
        return pose


class View(NamedTuple):
    """A scan with its truth."""

    frame: drives.Frame
    points: np.ndarray  # (B, 2) in the robot's frame, NaN: no answer
    known: np.ndarray  # (B,) bool: its true case is 1, 3 or 4


def views(name: str, lidar_name: str, seed: int, count: int) -> Tuple[GridMap, List[View]]:
    """Scans spread over the drive through a building."""
    grid_map, frames = drives.drive(name, lidar_name, seed)
    chosen = [frames[index] for index in np.linspace(0, len(frames) - 1, count).astype(int)]
    return grid_map, [
        View(frame, frame.scan.points_in_base(), importance_weights.known_ends(frame.truth.case)) for frame in chosen
    ]


def walls(grid_map: GridMap) -> np.ndarray:
    return wall_segments.extract(grid_map, wall_segments.FINE_TOLERANCE_CELLS).segments_m


# -- quality


def with_people(points: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The same scans with a third of the beams cut short, in groups of about 15 beams."""
    groups = np.repeat(rng.random(len(points) // 15 + 1) < PEOPLE_SHARE, 15)[: len(points)]
    share = np.repeat(rng.uniform(0.2, 0.9, len(points) // 15 + 1), 15)[: len(points)]
    return np.where(groups[:, None], share[:, None] * points, points)


def measures(corrector: SegmentCorrector, points: np.ndarray, pose: np.ndarray) -> np.ndarray:
    quality = corrector.quality(points, pose)
    return np.array([quality.mse_m2, quality.classification_factor, quality.combined])


def around(corrector: SegmentCorrector, points: np.ndarray, true: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """(Y, X, 3) over offsets in the robot's frame, (T, 3) over turns, of Emse, Ecf and combined."""
    plane = np.array(
        [[measures(corrector, points, se2.compose(true, np.array([x, y, 0.0]))) for x in GRID_M] for y in GRID_M]
    )
    return plane, np.array([measures(corrector, points, true + [0.0, 0.0, turn]) for turn in GRID_RAD])


def best_at(plane: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """(3, 3) offsets x, y [m] and turn [rad] of the best Emse, Ecf and combined."""
    found = []
    for measure, sign in enumerate((-1.0, 1.0, 1.0)):
        row, column = np.unravel_index(np.argmax(sign * plane[..., measure]), plane.shape[:2])
        found.append([GRID_M[column], GRID_M[row], GRID_RAD[np.argmax(sign * turns[:, measure])]])
    return np.array(found)


def quality(arguments: argparse.Namespace) -> bool:
    """The measures around true poses in rooms; the combined one and Ecf must be best there with people too."""
    print("quality: where each measure is best, off the true pose: m (deg), largest over the places")
    print("| building | beams | places | Emse | Ecf | combined |\n|---|---|---|---|---|---|")
    fine = True
    near_m, near_rad = NEAR_STEPS * (GRID_M[1] - GRID_M[0]), NEAR_STEPS * (GRID_RAD[1] - GRID_RAD[0])
    for name in arguments.buildings:
        grid_map, seen = views(name, arguments.lidar, arguments.seed, 4)
        corrector = SegmentCorrector(walls(grid_map))
        for people in (False, True):
            off, shown = [], None
            for number, view in enumerate(seen):
                points = view.points[view.known]
                true = view.frame.map_from_base
                if len(corrector.correct(points, true).free):
                    continue
                if people:
                    points = with_people(points, np.random.default_rng([arguments.seed, number]))
                plane, turns = around(corrector, points, true)
                off.append(best_at(plane, turns))
                shown = (plane, turns)
            if not off:
                continue
            worst = np.array(off)  # (places, 3 measures, 3)
            distance = np.hypot(worst[..., 0], worst[..., 1]).max(axis=0)
            turn = np.abs(worst[..., 2]).max(axis=0)
            print(
                f"| {name} | {'a third at people' if people else 'as seen'} | {len(off)} | "
                + " | ".join(f"{metres:.2f} ({np.degrees(angle):.1f})" for metres, angle in zip(distance, turn))
                + " |",
                flush=True,
            )
            counted = slice(1, 3) if people else slice(0, 3)  # Emse is what people spoil
            fine &= bool(np.all(distance[counted] <= near_m + 1e-9) and np.all(turn[counted] <= near_rad + 1e-9))
            if arguments.out is not None and shown is not None:
                draw(arguments.out / f"quality_{name}{'_people' if people else ''}.png", *shown)
    print()
    return fine


def draw(path: Path, plane: np.ndarray, turns: np.ndarray) -> None:
    """Above: each measure over x and y. Below: over the heading."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(2, 3, figsize=(11, 6.5), constrained_layout=True)
    for measure, name in enumerate(("Emse [m$^2$]", "Ecf", "combined")):
        shown = axes[0, measure].imshow(
            plane[..., measure], origin="lower", cmap="viridis", extent=[GRID_M[0], GRID_M[-1], GRID_M[0], GRID_M[-1]]
        )
        figure.colorbar(shown, ax=axes[0, measure])
        axes[0, measure].plot(0.0, 0.0, "r+", markersize=12)
        axes[0, measure].set_title(name)
        axes[0, measure].set_xlabel("ahead [m]")
        axes[1, measure].plot(np.degrees(GRID_RAD), turns[:, measure], color="#1f77b4")
        axes[1, measure].axvline(0.0, color="#d62728", linewidth=0.8)
        axes[1, measure].set_xlabel("turn [deg]")
    axes[0, 0].set_ylabel("left [m]")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=80)
    pyplot.close(figure)


# -- basin


def start_near(true: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Uniformly distributed offsets within reach."""
    away, bearing = REACH_M * np.sqrt(rng.random()), rng.uniform(-np.pi, np.pi)
    return true + [away * np.cos(bearing), away * np.sin(bearing), rng.uniform(-REACH_RAD, REACH_RAD)]


def is_right(pose: np.ndarray, true: np.ndarray, free: np.ndarray, lever_m: float) -> bool:
    """Within the limits, ignoring free directions (K, 3)."""
    left = pose - true
    left[2] = lever_m * angles.wrap(left[2])
    left -= free.T @ (free @ left)
    return bool(np.hypot(left[0], left[1]) <= RIGHT_M and abs(left[2]) <= lever_m * RIGHT_RAD)


def basin(arguments: argparse.Namespace) -> bool:
    """Share of the starts that converge."""
    ways = ("known cases", "all beams", "locate", "document", "ICP, known cases")
    print("basin: share of starts that end at the truth; rooms / hallways, apart from the direction that is free")
    print("| building | starts in rooms, hallways | " + " | ".join(ways) + " |\n|" + "---|" * (2 + len(ways)))
    all_of: Dict[Tuple[str, bool], List[bool]] = {}
    for name in arguments.buildings:
        grid_map, seen = views(name, arguments.lidar, arguments.seed, arguments.places)
        segments_m = walls(grid_map)
        squares, literal = (
            SegmentCorrector(segments_m, params)
            for params in (SegmentCorrectionParams(), SegmentCorrectionParams(method="document", iterations=40))
        )
        locator, icp = SegmentLocator(grid_map), Icp(grid_map)
        rng = np.random.default_rng([arguments.seed, len(name)])
        here: Dict[Tuple[str, bool], List[bool]] = {}
        for view in seen:
            true, answered = view.frame.map_from_base, np.isfinite(view.points).all(axis=1)
            points, known = view.points[answered], view.points[view.known]
            walls_there = squares.correct(known, true)
            free, lever_m = walls_there.free, walls_there.lever_m
            if len(free) > 1:
                continue
            for _ in range(arguments.starts):
                start = start_near(true, rng)
                ends = (
                    squares.correct(known, start).map_from_base,
                    squares.correct(points, start).map_from_base,
                    locator.locate(view.frame.scan, start).correction.map_from_base,
                    literal.correct(known, start).map_from_base,
                    icp.correct(known, start),
                )
                for way, end in zip(ways, ends):
                    for found in (here, all_of):
                        found.setdefault((way, bool(len(free))), []).append(is_right(end, true, free, lever_m))
        print(basin_row(name, here, ways), flush=True)
    print(basin_row("all", all_of, ways) + "\n")
    return bool(np.mean(all_of[ways[0], False]) >= BAR_SHARE)


def basin_row(name: str, found: Dict[Tuple[str, bool], List[bool]], ways: Tuple[str, ...]) -> str:
    cells = [f"{len(found.get((ways[0], False), []))}, {len(found.get((ways[0], True), []))}"]
    for way in ways:
        cells.append(
            " / ".join(f"{np.mean(found[way, hall]):.3f}" if (way, hall) in found else "-" for hall in (False, True))
        )
    return f"| {name} | " + " | ".join(cells) + " |"


# -- speed


def speed(arguments: argparse.Namespace) -> bool:
    """Median CPU ms of a correction, methods in alternation."""
    grid_map, seen = views("changed_rooms", arguments.lidar, arguments.seed, 20)
    segments_m = walls(grid_map)
    if len(segments_m) < SEGMENTS:
        raise RuntimeError(f"needs {SEGMENTS} segments, the map has {len(segments_m)}")
    caster, rng = RayCaster(grid_map), np.random.default_rng(arguments.seed)
    angles_rad = np.linspace(-np.pi, np.pi, POINTS, endpoint=False)
    spent: Dict[str, List[float]] = {}
    icp = Icp(grid_map)
    for view in seen:
        true = view.frame.map_from_base
        middle = (segments_m[:, :2] + segments_m[:, 2:]) / 2.0
        nearest = np.argsort(np.hypot(*(middle - true[:2]).T))[:SEGMENTS]
        ranges_m = caster.cast(true[None], angles_rad, 30.0)[0] + rng.normal(0.0, 0.01, POINTS)
        points = ranges_m[:, None] * np.column_stack([np.cos(angles_rad), np.sin(angles_rad)])
        points = points[np.isfinite(points).all(axis=1)]
        points = points[np.resize(np.arange(len(points)), POINTS)]
        ways: Dict[str, Callable[[np.ndarray], object]] = {
            "ICP": lambda start, points=points: icp.correct(points, start)
        }
        for method in ("least_squares", "document"):
            corrector = SegmentCorrector(segments_m[nearest], SegmentCorrectionParams(method=method))
            ways[method] = lambda start, corrector=corrector, points=points: corrector.correct(points, start)
        for _ in range(10):
            start = start_near(true, rng)
            for name, way in ways.items():
                began = time.process_time()
                way(start)
                spent.setdefault(name, []).append(1e3 * (time.process_time() - began))
    median = {name: float(np.median(values)) for name, values in spent.items()}
    print(f"speed: CPU ms of a correction, {POINTS} points, {SEGMENTS} segments, 15 steps, one thread (median, p95)")
    print("| way | median | p95 | times ICP |\n|---|---|---|---|")
    for name, values in spent.items():
        print(f"| {name} | {median[name]:.2f} | {np.percentile(values, 95):.2f} | {median[name] / median['ICP']:.2f} |")
    print()
    return median["least_squares"] <= BAR_MS


# -- judge


def judge(arguments: argparse.Namespace) -> bool:
    """Probability that each measure ranks a right pose above a wrong one of the same scan."""
    print("judge: chance that the right pose of a scan gets the better value than a wrong one that it was aligned to")
    print("| log or building | pairs | fit of the scan | Ecf | combined | Emse |\n|---|---|---|---|---|---|")
    for name in [*arguments.logs, *arguments.buildings]:
        track = tracks.load(name, arguments.seed)
        field, corrector = DistanceField(track.grid_map), SegmentCorrector(walls(track.grid_map))
        rng = np.random.default_rng(arguments.seed)
        better = []
        for index in np.linspace(0, len(track.moments) - 1, 40).astype(int):
            moment = track.moments[index]
            points = moment.scan.points_in_base()[moment.scan.answered]
            if len(points) < 30:
                continue
            starts = moment.map_from_base + np.column_stack([rng.uniform(-4.0, 4.0, (12, 2)), rng.uniform(-3, 3, 12)])
            ends = scan_alignment.align(field, points, np.vstack([moment.map_from_base, starts])).poses
            wrong = [pose for pose in ends[1:] if not tracks.is_right(pose, moment.map_from_base)]
            if not wrong or not tracks.is_right(ends[0], moment.map_from_base):
                continue
            values = np.array([_values(field, corrector, points, pose) for pose in [ends[0], *wrong]])
            better.append(values[0] > values[1:][np.argmax(values[1:, 0])])  # the wrong one that fits best
        shares = np.mean(better, axis=0)
        print(f"| {name} | {len(better)} | " + " | ".join(f"{share:.3f}" for share in shares) + " |", flush=True)
    print()
    return True


def _values(field: DistanceField, corrector: SegmentCorrector, points: np.ndarray, pose: np.ndarray) -> List[float]:
    quality = corrector.quality(points, pose)
    return [
        float(scan_alignment.fit(field, points, pose[None])[0]),
        quality.classification_factor,
        quality.combined,
        -quality.mse_m2,
    ]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--tasks",
        nargs="+",
        choices=TASKS,
        default=list(TASKS[:3]),
        help="default: quality basin speed; the others take long",
    )
    parser.add_argument("--logs", nargs="*", choices=sorted(replay_logs.PEERS), default=list(replay_logs.PEERS))
    parser.add_argument("--buildings", nargs="+", default=drives.buildings())
    parser.add_argument("--lidar", default="sensitive", choices=drives.lidars())
    parser.add_argument("--seed", type=int, default=200)
    parser.add_argument("--places", type=int, default=20, help="along each drive (default 20)")
    parser.add_argument("--starts", type=int, default=10, help="at each place (default 10)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="for the pictures of the measures")
    arguments = parser.parse_args()
    run = {"quality": quality, "basin": basin, "speed": speed, "judge": judge}
    missed = [task for task in arguments.tasks if not run[task](arguments)]
    print(f"missed: {', '.join(missed)}" if missed else "all bars met")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
