#!/usr/bin/env python3
"""Glass that the map lacks: how much of it is found, how much is invented, and what that does for cases and costmaps.

    python test/benchmark/unmapped_glass.py                                   all sections, all buildings
    python test/benchmark/unmapped_glass.py glass --buildings glass_office random --lidars weak --seeds 2
    python test/benchmark/unmapped_glass.py false logs real cpu --first-seed 300

Sections:
    glass  all panes are erased from the map (or, with --mapper erasing, by a mapper that lets beams pass); the robot
           drives its path there and back. Found: share of the visible pane length within 0.1 m and 3 degrees of a pane
           of probability 0.9 after the way there, at the smoothed poses that `map panes` uses (--truth: with the ground
           truth where no pose is sure); a point of a pane is visible if the robot had it head-on within 6 m. Glass: share
           of what was found that is. Cases, pose and cut beams of the way there with the true map, the lacking one, and
           the lacking one with what was found drawn in; live: the same share found while driving, and cut beams of the
           way back.
    false  pane length that is found where the map lacks none: with film on all glass, and with a third of the furniture
           moved and ten people.
    logs   the same on real logs, whose maps have their walls.
    real   a real floor with its see-through walls (glass_3dref's mask) erased from the map: the share of their length
           that comes back within 0.15 m, with and without the intensities of the lidar.
    cpu    per scan, with and without the search for panes.

Seeds from 0 to 49 were used in development. Exit code 1 when a bar is missed.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Callable, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):  # a process a core: threads would fight for them
    os.environ.setdefault(name, "1")

import numpy as np
from scipy import ndimage

sys.path.append(str(Path(__file__).resolve().parent))

import free_paths
from glass_nav.evaluation.metrics import case_scores, pose_errors
from glass_nav.evaluation.metrics.case_scores import SurfaceScores
from glass_nav.geometry import se2
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.localization.beam_classification.unmapped_panes import PaneUse
from glass_nav.localization.localizer import Localizer
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.panes.pane_finder import PaneFinderParams
from glass_nav.recording import log_file
from glass_nav.recording.recording import LogOptions, Step
from glass_nav.replay.replay_panes import PaneSearch
from glass_nav.replay.smoother import Smoother
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.simulation import (
    building_file,
    building_map,
    erased_glass,
    lidar,
    occupancy_mapper,
    random_building,
    shipped_buildings,
)
from glass_nav.simulation.building import Building, Person, crosses, distances
from glass_nav.simulation.lidar import LidarModel
from glass_nav.simulation.simulation import Frame, Simulation
from glass_nav.world import drawn_panes, map_file
from glass_nav.world.grid_map import GridMap
from glass_nav.world.pane import Pane

DATA = Path(os.environ.get("GLASS_NAV_DATA", Path(__file__).resolve().parents[3] / "shared" / "data"))
SECTIONS = ("glass", "false", "logs", "real", "cpu")
RANDOM = "random"
LOGS = ("intel", "aces", "seattle", "acapulco", "mit_csail", "wean1", "wean2")
REAL = ("uob_trace0", "olin_mac")
SCAN_RATE_HZ = 5.0
HEAD_ON_RAD, HEAD_ON_M = np.radians(3.0), 6.0  # of a pane that is visible
NEAR_M, NEAR_RAD = 0.1, np.radians(3.0)  # of a pane that is found
REAL_NEAR_M = 0.15
STEP_M = 0.05  # between points on panes
START_DEVIATION = np.array([0.1, 0.1, np.radians(3.0)])  # of the pose that the localizer is given
LEAST_FOUND = {"sensitive": 0.9, "coated": 0.9, "weak": 0.6}
PEOPLE = 10


class Bar(NamedTuple):
    """A figure and what it should be."""

    what: str
    found: Optional[float]
    least: float = -np.inf
    most: float = np.inf

    @property
    def kept(self) -> bool:
        return self.found is not None and self.least <= self.found <= self.most

    def row(self) -> str:
        asked = f">= {self.least:g}" if np.isfinite(self.least) else f"<= {self.most:g}"
        found = "nothing to measure" if self.found is None else f"{self.found:.3f}"
        return f"| {self.what} | {asked} | {found} | {'kept' if self.kept else 'MISSED'} |"


class Followed(NamedTuple):
    """What a localizer made of some frames."""

    accuracy: float
    position_m: float  # rmse
    yaw_deg: float  # mean
    cut: float  # share of the beams at panes that are cut within 0.15 m of them
    cpu_ms: float  # per scan


# -- drives


def building_of(name: str, seed: int) -> Building:
    """A shipped building, or the random floor of a seed with a path through it."""
    if name != RANDOM:
        return building_file.load(shipped_buildings.find(name))
    building = random_building.build(seed)
    return replace(building, paths={"tour": free_paths.tour(building, np.random.default_rng([seed, 5]))})


def there_and_back(building: Building, model: LidarModel, seed: int, changed: float = 0.0) -> Tuple[List[Frame], ...]:
    """Frames of the way along the first path, and of the way back."""
    simulation = Simulation(building, model, seed=seed, scan_rate_hz=SCAN_RATE_HZ, changed_share=changed)
    path_m = next(iter(building.paths.values()))
    return list(simulation.drive(path_m)), list(simulation.drive(path_m[::-1]))


def crowded(building: Building, seed: int) -> Building:
    """Ten people walk up and down along pieces of the path."""
    rng, path_m = np.random.default_rng([seed, 6]), next(iter(building.paths.values()))
    people = []
    for _ in range(PEOPLE):
        leg = int(rng.integers(len(path_m) - 1))
        share = np.sort(rng.uniform(0.0, 1.0, 2))
        ends = path_m[leg] + share[:, None] * (path_m[leg + 1] - path_m[leg]) + rng.normal(0.0, 0.3, 2)
        if np.hypot(*(ends[1] - ends[0])) > 1.0:
            people.append(Person(ends, float(rng.uniform(0.5, 1.4))))
    return replace(building, people=(*building.people, *people))


def started(grid_map: GridMap, pose: np.ndarray, seed: int, find_panes: bool = True) -> Localizer:
    params = LocalizerParams(pane_use=PaneUse(find_panes=find_panes))
    localizer = Localizer(params, grid_map, np.random.default_rng(seed))
    start = pose + START_DEVIATION * np.random.default_rng([seed, 1]).standard_normal(3)
    localizer.set_pose(start, np.diag(START_DEVIATION**2))
    return localizer


def follow(localizer: Localizer, frames: Sequence[Frame], smoother: Optional[Smoother] = None) -> Followed:
    """The localizer goes on with frames; a smoother listens."""
    cases, surfaces, cpu_s = case_scores.none_yet(), SurfaceScores(), 0.0
    poses: List[np.ndarray] = []
    for frame in frames:
        began_s = time.process_time()
        estimate = localizer.update(frame.scan, frame.odom_from_base)
        cpu_s += time.process_time() - began_s
        poses.append(estimate.map_from_base)
        if smoother is not None:
            smoother.listen(Step(frame.scan, frame.odom_from_base), estimate)
        cases += case_scores.of_cases(frame.truth.case, estimate.cases.case, frame.scan.answered)
        surface = estimate.surface_scan
        surfaces += case_scores.of_surfaces(frame.truth.crossing_m, surface.ranges_m, surface.cut, surface.trusted)
    true = truth_of(frames)
    errors = pose_errors.summary(pose_errors.of(true.stamps_ns, np.array(poses), true))
    return Followed(
        _number(cases.metrics()["accuracy"]),
        _number(errors["position_rmse_m"]),
        _number(errors["yaw_mean_deg"]),
        _number(surfaces.metrics()["cut_at_pane_share"]),
        1e3 * cpu_s / len(frames),
    )


def truth_of(frames: Sequence[Frame]) -> Trajectory:
    stamps = np.array([frame.scan.stamp_ns for frame in frames])
    return Trajectory(stamps, np.array([frame.map_from_base for frame in frames]))


def by_command(grid_map: GridMap, frames: Sequence[Frame], smoother: Smoother, with_truth: bool) -> List[Pane]:
    """The panes that `map panes` draws after a drive that the smoother listened to."""
    search = PaneSearch(grid_map, PaneFinderParams())
    search.add_drive(smoother, lambda: (frame.scan for frame in frames), truth_of(frames) if with_truth else None)
    return [pane for pane in search.panes() if pane.probability >= PaneUse().pane_min_probability]


def _number(value: Optional[float]) -> float:
    return np.nan if value is None else float(value)


# -- panes: which were visible, which are found


def points_along(line_m: np.ndarray) -> np.ndarray:
    """(N, 2) points on a line (2, 2), one for each STEP_M."""
    count = max(1, round(float(np.hypot(*(line_m[1] - line_m[0]))) / STEP_M))
    return line_m[0] + ((np.arange(count) + 0.5) / count)[:, None] * (line_m[1] - line_m[0])


def visible(building: Building, number: int, frames: Sequence[Frame], half_view_rad: float) -> np.ndarray:
    """(N,) bool: points along a pane that the lidar had head-on, with nothing before them."""
    line_m = building.panes[number].line_m
    points = points_along(line_m)
    direction = (line_m[1] - line_m[0]) / np.hypot(*(line_m[1] - line_m[0]))
    surfaces = building.surfaces
    before = surfaces.present & (surfaces.glazing != number)
    from_m, to_m = surfaces.from_m[before], surfaces.to_m[before]
    seen = np.zeros(len(points), bool)
    for frame in frames:
        laser = se2.compose(frame.map_from_base, frame.scan.base_from_laser)
        ray = points - laser[:2]
        range_m = np.hypot(*ray.T)
        bearing = np.arctan2(ray[:, 1], ray[:, 0]) - laser[2]
        head_on = np.abs(ray @ direction) <= np.sin(HEAD_ON_RAD) * range_m
        in_view = np.abs(np.arctan2(np.sin(bearing), np.cos(bearing))) <= half_view_rad
        at = np.flatnonzero(head_on & in_view & (range_m <= HEAD_ON_M) & ~seen)
        if len(at):
            starts = np.tile(laser[:2], (len(at), 1))
            seen[at] = ~crosses(starts, points[at] - 0.02 * ray[at], from_m, to_m).any(axis=1)
    return seen


def covered(points: np.ndarray, direction: np.ndarray, lines_m: np.ndarray, near_m: float = NEAR_M) -> np.ndarray:
    """(N,) bool: points (N, 2) of a line in that direction lie near a line of (L, 2, 2), and along it."""
    if not len(lines_m):
        return np.zeros(len(points), bool)
    along = lines_m[:, 1] - lines_m[:, 0]
    along = along / np.hypot(*along.T)[:, None]
    parallel = np.abs(along[:, 0] * direction[1] - along[:, 1] * direction[0]) <= np.sin(NEAR_RAD)
    return (parallel & (distances(points, lines_m[:, 0], lines_m[:, 1]) <= near_m)).any(axis=1)


def _direction(line_m: np.ndarray) -> np.ndarray:
    return (line_m[1] - line_m[0]) / np.hypot(*(line_m[1] - line_m[0]))


def lines_of(panes: Sequence[Pane]) -> np.ndarray:
    """(L, 2, 2)."""
    return np.array([[pane.start_m, pane.end_m] for pane in panes], float).reshape(-1, 2, 2)


def length_of(panes: Sequence[Pane]) -> float:
    return sum((pane.length_m for pane in panes), 0.0)


# -- sections: each prints its table and gives its bars


def glass(arguments: argparse.Namespace) -> Iterator[Bar]:
    print(
        f"\nGlass erased from the map, mapper {arguments.mapper}\n\n| building | lidar | seed | visible m | found | "
        "live | found m | glass | accuracy true / lacking / written | position m | yaw deg | cut | live cut |\n"
        + "|---" * 13
        + "|"
    )
    rows: Dict[str, List[Tuple[float, float]]] = {}
    found_m = glass_m = 0.0
    written: List[Tuple[Followed, Followed, Followed]] = []
    for name, preset, seed in _runs(arguments, [each for each in arguments.buildings if each != "opaque_office"]):
        building, model = building_of(name, seed), lidar.preset(preset)
        there, back = there_and_back(building, model, seed)
        panes = [number for number, pane in enumerate(building.panes) if not pane.film]
        true_map = building_map.draw(building)
        if arguments.mapper == "erasing":
            path_m = next(iter(building.paths.values()))
            lacking = occupancy_mapper.draw(building, model, path_m, 0.05, np.random.default_rng([seed, 2]))
        else:
            lacking = building_map.draw(building, erased=erased_glass.choose(building, 1.0, seed))
        localizer = started(lacking, there[0].map_from_base, seed)
        smoother = Smoother(DistanceField(lacking))
        without = follow(localizer, there, smoother)
        drawn = by_command(lacking, there, smoother, arguments.truth)
        live_lines = lines_of(localizer.unmapped_panes)
        live = follow(localizer, back)
        with_true, with_drawn = (
            follow(started(each, there[0].map_from_base, seed, find_panes=False), there)
            for each in (true_map, drawn_panes.drawn(lacking, drawn))
        )
        true_lines, found_lines = np.array([building.panes[number].line_m for number in panes]), lines_of(drawn)
        seen_m = hit_m = live_m = 0.0
        for number in panes:
            line_m, seen = (
                building.panes[number].line_m,
                visible(building, number, there, model.field_of_view_rad / 2.0),
            )
            hit, live_hit = (
                covered(points_along(line_m), _direction(line_m), lines) for lines in (found_lines, live_lines)
            )
            seen_m, hit_m = seen_m + STEP_M * seen.sum(), hit_m + STEP_M * (seen & hit).sum()
            live_m += STEP_M * (seen & live_hit).sum()
        real = [covered(points_along(line), _direction(line), true_lines) for line in found_lines]
        own_m, own_glass_m = STEP_M * sum(map(len, real)), STEP_M * float(sum(each.sum() for each in real))
        rows.setdefault(preset, []).append((seen_m, hit_m))
        found_m, glass_m = found_m + own_m, glass_m + own_glass_m
        written.append((with_true, with_drawn, live))
        print(
            f"| {name} | {preset} | {seed} | {seen_m:.1f} | {_share(hit_m, seen_m)} | {_share(live_m, seen_m)} | {own_m:.1f} | "
            f"{_share(own_glass_m, own_m)} | {with_true.accuracy:.3f} / {without.accuracy:.3f} / "
            f"{with_drawn.accuracy:.3f} | {with_true.position_m:.3f} / {without.position_m:.3f} / "
            f"{with_drawn.position_m:.3f} | {with_true.yaw_deg:.2f} / {without.yaw_deg:.2f} / {with_drawn.yaw_deg:.2f} | "
            f"{with_true.cut:.3f} / {without.cut:.3f} / {with_drawn.cut:.3f} | {live.cut:.3f} |",
            flush=True,
        )
    for preset, lengths in rows.items():
        seen_m, hit_m = np.sum(lengths, axis=0)
        yield Bar(f"found of the visible length, {preset}", hit_m / seen_m if seen_m else None, LEAST_FOUND[preset])
    yield Bar("glass of what is found", glass_m / found_m if found_m else None, 0.95)
    if written:
        true, drawn_in, live = (np.nanmean([each[index] for each in written], axis=0) for index in range(3))
        yield Bar("case accuracy, true map less written one", true[0] - drawn_in[0], most=0.02)
        yield Bar("position rmse, written map over true one", drawn_in[1] / true[1], most=1.1)
        yield Bar("yaw, written map over true one", drawn_in[2] / true[2], most=1.1)
        yield Bar("cut at panes with the written map", drawn_in[3], 0.9)
        yield Bar("cut at panes live, after the first pass", live[3], 0.8)


def false(arguments: argparse.Namespace) -> Iterator[Bar]:
    print("\nPanes where the map lacks none\n\n| building | lidar | seed | m | where |\n|---|---|---|---|---|")
    worst = {"film on all glass": 0.0, "moved furniture and ten people": 0.0}
    for name, preset, seed in _runs(arguments, arguments.buildings):
        whole = building_of(name, seed)
        for what, building, changed in (
            ("film on all glass", whole.opaque(), 0.0),
            ("moved furniture and ten people", crowded(whole, seed), 1.0 / 3.0),
        ):
            there, back = there_and_back(building, lidar.preset(preset), seed, changed)
            localizer = started(building_map.draw(building), there[0].map_from_base, seed)
            for frame in (*there, *back):
                localizer.update(frame.scan, frame.odom_from_base)
            worst[what] = max(worst[what], length_of(localizer.unmapped_panes))
            print(f"| {name}, {what} | {preset} | {seed} | {_listed(localizer.unmapped_panes)} |", flush=True)
    for what, length_m in worst.items():
        yield Bar(f"false panes [m], {what}", length_m, most=0.0)


def logs(arguments: argparse.Namespace) -> Iterator[Bar]:
    print("\nLogs\n\n| log | scans | m | where |\n|---|---|---|---|")
    for name in LOGS:
        folder = arguments.data / "logs" / name
        localizer, scans, _ = replayed(folder / f"{name}.bag", map_file.load(folder / "map.yaml"), arguments)
        print(f"| {name} | {scans} | {_listed(localizer.unmapped_panes)} |", flush=True)
        yield Bar(f"false panes [m], {name}", length_of(localizer.unmapped_panes), most=0.5)


def real(arguments: argparse.Namespace) -> Iterator[Bar]:
    print("\nReal glass erased\n\n| log | intensities | mask m | back | found m | glass |\n" + "|---" * 6 + "|")
    for name in REAL:
        folder = arguments.data / "logs" / name
        grid_map = map_file.load(folder / "map.yaml")
        erased = see_through(folder, grid_map)
        occupancy = np.where(erased, np.int8(0), grid_map.occupancy)
        for use in (True, False):
            localizer, _, has = replayed(
                folder / f"{name}.bag", replace(grid_map, occupancy=occupancy), arguments, intensities=use
            )
            if not (use or has):
                continue
            rows, columns = np.nonzero(erased)
            lines = lines_of(localizer.unmapped_panes)
            points = grid_map.centres(rows, columns)
            back = near_any(points, lines)
            found = np.concatenate([np.zeros((0, 2)), *map(points_along, lines)])
            off_m = ndimage.distance_transform_edt(~erased) * grid_map.resolution_m
            glassy = off_m[grid_map.cells(found)] <= REAL_NEAR_M
            print(
                f"| {name} | {'used' if use and has else 'none'} | {len(points) * grid_map.resolution_m:.0f} | "
                f"{back.mean():.3f} | {length_of(localizer.unmapped_panes):.1f} | {_share(glassy.sum(), len(glassy))} |",
                flush=True,
            )
            words = "" if not has else " with intensities" if use else " without intensities"
            yield Bar(f"see-through walls that come back, {name}{words}", float(back.mean()), 0.5)


def cpu(arguments: argparse.Namespace) -> Iterator[Bar]:
    print("\nCPU per scan\n\n| building | without ms | with ms |\n|---|---|---|")
    ratios = []
    for name in [each for each in arguments.buildings if each != RANDOM][:3]:
        building = building_of(name, 0)
        there, _ = there_and_back(building, lidar.preset("sensitive"), arguments.first_seed)
        lacking = building_map.draw(building, erased=erased_glass.choose(building, 1.0, 0))
        took: Dict[bool, List[float]] = {False: [], True: []}
        for find in (False, True, False, True):
            took[find].append(follow(started(lacking, there[0].map_from_base, 0, find), there).cpu_ms)
        without, with_panes = min(took[False]), min(took[True])
        ratios.append(with_panes / without)
        print(f"| {name} | {without:.2f} | {with_panes:.2f} |", flush=True)
    yield Bar("CPU per scan, with panes over without", float(np.mean(ratios)), most=1.1)


# -- logs


def replayed(
    bag: Path, grid_map: GridMap, arguments: argparse.Namespace, intensities: bool = True
) -> Tuple[Localizer, int, bool]:
    """A localizer after a log, how many scans that were, and whether they had intensities."""
    recording = log_file.open_log(bag, LogOptions())
    localizer: Optional[Localizer] = None
    scans, has = 0, False
    for entry in recording:
        scan = entry.scan
        has = has or scan.intensities is not None
        if not intensities:
            scan = replace(scan, intensities=None)
        if localizer is None:
            localizer = Localizer(LocalizerParams(), grid_map, np.random.default_rng(arguments.first_seed))
            truth = recording.ground_truth
            if truth is None:
                localizer.scatter()
            else:
                localizer.set_pose(truth.at(np.int64(scan.stamp_ns)), np.diag(START_DEVIATION**2))
        localizer.update(scan, entry.odom_from_base)
        scans += 1
        if arguments.max_scans is not None and scans >= arguments.max_scans:
            break
    assert localizer is not None
    return localizer, scans, has


def see_through(folder: Path, grid_map: GridMap) -> np.ndarray:
    """(H, W) bool: wall cells of a log's map that the mask beside it marks as seen through."""
    mask = map_file.load(folder / "see_through_mask.yaml")
    marked = np.zeros(grid_map.occupancy.shape, bool)
    rows, columns = grid_map.cells(mask.centres(*np.nonzero(mask.occupied)))
    inside = grid_map.contains(rows, columns)
    marked[rows[inside], columns[inside]] = True
    off_m = ndimage.distance_transform_edt(~marked) * grid_map.resolution_m
    return grid_map.occupied & (off_m <= mask.resolution_m)


def near_any(points: np.ndarray, lines_m: np.ndarray) -> np.ndarray:
    """(N,) bool."""
    if not len(lines_m):
        return np.zeros(len(points), bool)
    return distances(points, lines_m[:, 0], lines_m[:, 1]).min(axis=1) <= REAL_NEAR_M


# -- output


def _share(part: float, whole: float) -> str:
    return f"{part / whole:.3f}" if whole else ""


def _listed(panes: Sequence[Pane]) -> str:
    where = "; ".join(
        f"({pane.start_m[0]:.1f}, {pane.start_m[1]:.1f}) to ({pane.end_m[0]:.1f}, {pane.end_m[1]:.1f}), "
        f"{pane.probability:.2f}"
        for pane in panes
    )
    return f"{length_of(panes):.2f} | {where}"


def _runs(arguments: argparse.Namespace, buildings: Sequence[str]) -> Iterator[Tuple[str, str, int]]:
    """Building, preset and seed of each drive; random floors have one preset each, in turn."""
    for name in buildings:
        for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds):
            presets = arguments.lidars if name != RANDOM else [arguments.lidars[seed % len(arguments.lidars)]]
            for preset in presets:
                yield name, preset, seed
    if RANDOM in buildings:
        for seed in range(arguments.first_seed + arguments.seeds, arguments.first_seed + arguments.floors):
            yield RANDOM, arguments.lidars[seed % len(arguments.lidars)], seed


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sections", nargs="*", metavar="SECTION", help=f"{' '.join(SECTIONS)}; default: all")
    parser.add_argument(
        "--buildings",
        nargs="+",
        default=[*shipped_buildings.shipped(), RANDOM],
        metavar="NAME",
        help="shipped ones, and random; default: all",
    )
    parser.add_argument("--lidars", nargs="+", default=["sensitive", "weak"], choices=lidar.PRESETS, metavar="PRESET")
    parser.add_argument("--first-seed", type=int, default=300)
    parser.add_argument("--seeds", type=int, default=1, help="drives of each building and lidar")
    parser.add_argument("--floors", type=int, default=10, help="random floors, if there are any")
    parser.add_argument("--mapper", choices=("complete", "erasing"), default="complete")
    parser.add_argument("--truth", action="store_true", help="as if the drives had a ground truth")
    parser.add_argument("--max-scans", type=int, metavar="N", help="of each log")
    parser.add_argument("--data", type=Path, default=DATA, metavar="FOLDER", help="default: GLASS_NAV_DATA")
    arguments = parser.parse_args()
    unknown = [section for section in arguments.sections if section not in SECTIONS]
    if unknown:
        parser.error(f"unknown section {unknown[0]!r}, known are {', '.join(SECTIONS)}")
    sections: Dict[str, Callable[[argparse.Namespace], Iterator[Bar]]] = {
        "glass": glass,
        "false": false,
        "logs": logs,
        "real": real,
        "cpu": cpu,
    }
    bars: List[Bar] = []
    for section in arguments.sections or SECTIONS:
        bars += sections[section](arguments)
    print("\nBars\n\n| figure | asked | found | |\n|---|---|---|---|")
    for bar in bars:
        print(bar.row())
    return 0 if all(bar.kept for bar in bars) else 1


if __name__ == "__main__":
    sys.exit(main())
