#!/usr/bin/env python3
"""Glass that the map lacks: how much of it is found, how much is invented, and what that does for cases and costmaps.

    python test/benchmark/unmapped_glass.py                                   all sections, all buildings
    python test/benchmark/unmapped_glass.py glass --buildings glass_office random --lidars weak --seeds 2
    python test/benchmark/unmapped_glass.py false logs real cpu memory --first-seed 300

Sections:
    glass   all panes are erased from the map, or left out by a mapper that erases what beams pass (--mappers); the robot
            drives its path there and back. Found: share of the visible pane length within 0.1 m and 3 degrees of a pane
            of probability 0.9 after the path there, at the smoothed poses that `map panes` uses (--truth: with the ground
            truth where no pose is sure); a point of a pane is visible if the robot had it head-on within 6 m, and lacking
            unless the map shows it in a group of cells of at least 0.4 m. Glass: share of what was found that is. Cases, pose and cut beams of the path there with the true map, the lacking one, and
            the lacking one with what was found drawn in; live: the same share found while driving, and cut beams of the
            path back. Beams are counted at all panes and, for the bars, at those that were visible on the path there.
    false   pane length that is found where the map lacks none, live and by `map panes`: with film on all glass, and with a
            third of the furniture moved and ten people.
    logs    the same on real logs, whose maps have their walls.
    real    a real floor with its see-through walls (glass_3dref's mask) erased from the map: the share of their length
            that comes back within 0.15 m, with and without the intensities of the lidar.
    cpu     per scan, with over without the search for panes, on maps without and with their glass.
    memory  on a map of 5000 x 5000 cells: what the search adds, and how that grows in an hour among ever new panes.

Seeds from 0 to 49 were used in development. Exit code 1 when a bar is missed.
"""

from __future__ import annotations

import argparse
import gc
import multiprocessing
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Callable, Dict, Iterable, Iterator, List, NamedTuple, Optional, Sequence, Tuple, TypeVar

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):  # a process a core: threads would fight for them
    os.environ.setdefault(name, "1")

import numpy as np
from scipy import ndimage, spatial

sys.path.append(str(Path(__file__).resolve().parent))

import free_paths
from glass_nav.evaluation.metrics import case_scores, pose_errors
from glass_nav.evaluation.metrics.case_scores import SurfaceScores
from glass_nav.geometry import se2
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.localization.beam_classification.unmapped_panes import PaneUse, UnmappedPanes
from glass_nav.localization.localizer import Localizer
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.panes.mapped_surfaces import MappedSurfaces
from glass_nav.panes.pane_finder import PaneFinderParams
from glass_nav.recording import log_file
from glass_nav.recording.recording import LogOptions, Step
from glass_nav.replay.replay_panes import PaneSearch
from glass_nav.replay.smoother import Smoother
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.scan import Scan
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
SECTIONS = ("glass", "false", "logs", "real", "cpu", "memory")
MAPPERS = ("complete", "erasing")
RANDOM = "random"
LOGS = ("intel", "aces", "seattle", "acapulco", "mit_csail", "wean1", "wean2")
REAL = ("uob_trace0", "olin_mac")
SCAN_RATE_HZ, RESOLUTION_M = 5.0, 0.05
HEAD_ON_RAD, HEAD_ON_M = np.radians(3.0), 6.0  # of a pane that is visible
NEAR_M, NEAR_RAD = 0.1, np.radians(3.0)  # of a pane that is found
REAL_NEAR_M = 0.15
SPECK_M = 0.4  # a group of cells that is shorter shows no pane
STEP_M = 0.05  # between points on panes
START_DEVIATION = np.array([0.1, 0.1, np.radians(3.0)])  # of the pose that the localizer is given
LEAST_FOUND = {"sensitive": 0.9, "coated": 0.9, "weak": 0.6}
PEOPLE = 10
LARGE_CELLS = 5000
_T = TypeVar("_T")


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
    cut_at_seen: float  # the same, of those at given points


# -- drives


def building_of(name: str, seed: int) -> Building:
    """A shipped building, or the random floor of a seed with a path through it."""
    if name != RANDOM:
        return building_file.load(shipped_buildings.find(name))
    building = random_building.build(seed)
    return replace(building, paths={"tour": free_paths.tour(building, np.random.default_rng([seed, 5]))})


def driven(building: Building, model: LidarModel, seed: int, changed: float = 0.0) -> List[Frame]:
    """Frames of the way along the first path."""
    simulation = Simulation(building, model, seed=seed, scan_rate_hz=SCAN_RATE_HZ, changed_share=changed)
    return list(simulation.drive(next(iter(building.paths.values()))))


def there_and_back(building: Building, model: LidarModel, seed: int) -> Tuple[List[Frame], List[Frame]]:
    """Frames of the way along the first path, and of the way back."""
    simulation = Simulation(building, model, seed=seed, scan_rate_hz=SCAN_RATE_HZ)
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


def follow(
    localizer: Localizer,
    frames: Sequence[Frame],
    smoother: Optional[Smoother] = None,
    seen_m: Optional[np.ndarray] = None,
) -> Followed:
    """The localizer goes on with frames; a smoother listens; points (N, 2) of panes that count by
    themselves, default: all."""
    cases, surfaces, at_seen = case_scores.none_yet(), SurfaceScores(), SurfaceScores()
    poses: List[np.ndarray] = []
    seen = None if seen_m is None else spatial.cKDTree(seen_m)
    for frame in frames:
        estimate = localizer.update(frame.scan, frame.odom_from_base)
        poses.append(estimate.map_from_base)
        if smoother is not None:
            smoother.listen(Step(frame.scan, frame.odom_from_base), estimate)
        cases += case_scores.of_cases(frame.truth.case, estimate.cases.case, frame.scan.answered)
        surface, crossing_m = estimate.surface_scan, frame.truth.crossing_m
        surfaces += case_scores.of_surfaces(crossing_m, surface.ranges_m, surface.cut, surface.trusted)
        if seen is not None:
            crossing_m = np.where(_near_points(frame, seen), crossing_m, np.nan)
        at_seen += case_scores.of_surfaces(crossing_m, surface.ranges_m, surface.cut, surface.trusted)
    true = truth_of(frames)
    errors = pose_errors.summary(pose_errors.of(true.stamps_ns, np.array(poses), true))
    return Followed(
        _number(cases.metrics()["accuracy"]),
        _number(errors["position_rmse_m"]),
        _number(errors["yaw_mean_deg"]),
        _number(surfaces.metrics()["cut_at_pane_share"]),
        _number(at_seen.metrics()["cut_at_pane_share"]),
    )


def _near_points(frame: Frame, points: "spatial.cKDTree") -> np.ndarray:
    """(B,) bool: beams that crossed a pane at one of some points."""
    laser = se2.compose(frame.map_from_base, frame.scan.base_from_laser)
    beam_rad = laser[2] + frame.scan.angles_rad
    crossed = np.flatnonzero(np.isfinite(frame.truth.crossing_m))
    ends_m = laser[:2] + frame.truth.crossing_m[crossed, None] * np.stack(
        [np.cos(beam_rad[crossed]), np.sin(beam_rad[crossed])], axis=-1
    )
    near = np.zeros(len(beam_rad), bool)
    near[crossed] = np.isfinite(points.query(ends_m, distance_upper_bound=NEAR_M)[0])
    return near


def truth_of(frames: Sequence[Frame]) -> Trajectory:
    stamps = np.array([frame.scan.stamp_ns for frame in frames])
    return Trajectory(stamps, np.array([frame.map_from_base for frame in frames]))


def by_command(
    grid_map: GridMap, scans: Callable[[], Iterable[Scan]], smoother: Smoother, truth: Optional[Trajectory] = None
) -> List[Pane]:
    """The panes that `map panes` draws after a drive that the smoother listened to."""
    search = PaneSearch(grid_map, PaneFinderParams())
    search.add_drive(smoother, scans, truth)
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


class Lacking(NamedTuple):
    """What was found on a map without its panes."""

    visible_m: float  # of the panes, where the map lacks them
    hit_m: float  # of that, found
    live_m: float  # of that, found while driving
    found_m: float
    glass_m: float  # of that
    without: Followed
    written: Optional[Followed]
    live: Optional[Followed]


class Drive:
    """A robot drives through a building, there and back."""

    def __init__(self, name: str, preset: str, seed: int) -> None:
        self.seed, self.building, self.model = seed, building_of(name, seed), lidar.preset(preset)
        self.there, self.back = there_and_back(self.building, self.model, seed)
        lines_m = [pane.line_m for pane in self.building.panes if not pane.film]
        numbers = [number for number, pane in enumerate(self.building.panes) if not pane.film]
        self.lines_m = np.array(lines_m, float).reshape(-1, 2, 2)
        half_rad = self.model.field_of_view_rad / 2.0
        self.seen_m = [
            points_along(line_m)[visible(self.building, number, self.there, half_rad)]
            for number, line_m in zip(numbers, lines_m)
        ]
        self.all_seen_m = np.concatenate([np.zeros((0, 2)), *self.seen_m])

    def map_of(self, mapper: str) -> GridMap:
        """The map without its panes."""
        if mapper == "erasing":
            path_m, rng = next(iter(self.building.paths.values())), np.random.default_rng([self.seed, 2])
            return occupancy_mapper.draw(self.building, self.model, path_m, RESOLUTION_M, rng)
        return building_map.draw(self.building, erased=erased_glass.choose(self.building, 1.0, self.seed))

    def follow(self, grid_map: GridMap) -> Followed:
        """Every other scan of the path there on a map, without looking for panes."""
        localizer = started(grid_map, self.there[0].map_from_base, self.seed, find_panes=False)
        return follow(localizer, self.there[::2], seen_m=self.all_seen_m)

    def search(self, mapper: str, with_truth: bool) -> Lacking:
        lacking = self.map_of(mapper)
        localizer = started(lacking, self.there[0].map_from_base, self.seed)
        smoother = Smoother(DistanceField(lacking))
        without = follow(localizer, self.there, smoother, self.all_seen_m)
        drawn = by_command(
            lacking,
            lambda: (frame.scan for frame in self.there),
            smoother,
            truth_of(self.there) if with_truth else None,
        )
        live_lines, found_lines = lines_of(localizer.unmapped_panes), lines_of(drawn)
        shown = MappedSurfaces(lacking, SPECK_M, NEAR_M)
        seen_m = [points[~shown.is_near(points)] for points in self.seen_m]
        hit_m, live_m = (
            STEP_M
            * float(sum(covered(seen, _direction(line), lines).sum() for seen, line in zip(seen_m, self.lines_m)))
            for lines in (found_lines, live_lines)
        )
        real = [covered(points_along(line), _direction(line), self.lines_m) for line in found_lines]
        written = live = None
        if mapper == "complete":
            live = follow(localizer, self.back[::2], seen_m=self.all_seen_m)
            written = self.follow(drawn_panes.drawn(lacking, drawn))
        return Lacking(
            STEP_M * sum(map(len, seen_m)),
            hit_m,
            live_m,
            STEP_M * sum(map(len, real)),
            STEP_M * float(sum(each.sum() for each in real)),
            without,
            written,
            live,
        )


def glass(arguments: argparse.Namespace) -> Iterator[Bar]:
    print(
        "\nGlass erased from the map\n\n| building | mapper | lidar | seed | visible m | found | live | found m | glass | "
        "accuracy true / lacking / written | position m | yaw deg | cut | cut at seen panes | live cut, all / seen |\n"
        + "|---" * 15
        + "|"
    )
    rows: Dict[Tuple[str, str], List[Lacking]] = {}
    on_true: List[Followed] = []
    for name, preset, seed in _runs(arguments, [each for each in arguments.buildings if each != "opaque_office"]):
        drive = Drive(name, preset, seed)
        true = drive.follow(building_map.draw(drive.building))
        for mapper in arguments.mappers:
            found = drive.search(mapper, arguments.truth)
            rows.setdefault((mapper, preset), []).append(found)
            print(_row(name, mapper, preset, seed, true, found), flush=True)
            if mapper == "complete":
                on_true.append(true)
    for (mapper, preset), found_in in rows.items():
        seen_m, hit_m, live_m, found_m, glass_m, *_ = zip(*found_in)
        words = f"{mapper} mapper, {preset}"
        yield Bar(f"found of the visible length, {words}", _ratio(sum(hit_m), sum(seen_m)), LEAST_FOUND[preset])
        yield Bar(f"glass of what is found, {words}", _ratio(sum(glass_m), sum(found_m)), 0.95)
    whole = [each for (mapper, _), found_in in rows.items() if mapper == "complete" for each in found_in]
    if whole:
        true_mean, written, live = (
            np.nanmean(each, axis=0)
            for each in (on_true, [each.written for each in whole], [each.live for each in whole])
        )
        yield Bar("case accuracy, true map less written one", true_mean[0] - written[0], most=0.02)
        yield Bar("position rmse, written map over true one", written[1] / true_mean[1], most=1.1)
        yield Bar("yaw, written map over true one", written[2] / true_mean[2], most=1.1)
        yield Bar("cut at panes seen, with the written map", written[4], 0.9)
        yield Bar("cut live on the path back, at panes seen on the path there", live[4], 0.8)


def _row(name: str, mapper: str, preset: str, seed: int, true: Followed, found: Lacking) -> str:
    cells = [name, mapper, preset, str(seed), f"{found.visible_m:.1f}"]
    cells += [_share(found.hit_m, found.visible_m), _share(found.live_m, found.visible_m), f"{found.found_m:.1f}"]
    cells += [_share(found.glass_m, found.found_m)]
    followed = [each for each in (true, found.without, found.written) if each is not None]
    for index, form in enumerate(("{:.3f}", "{:.3f}", "{:.2f}", "{:.3f}", "{:.3f}")):
        cells.append(" / ".join(form.format(each[index]) for each in followed))
    cells.append("" if found.live is None else f"{found.live.cut:.3f} / {found.live.cut_at_seen:.3f}")
    return f"| {' | '.join(cells)} |"


def false(arguments: argparse.Namespace) -> Iterator[Bar]:
    print("\nPanes where the map lacks none\n\n| building | lidar | seed | live m | where | map panes m | where |")
    print("|---" * 7 + "|")
    worst = {"film on all glass": 0.0, "moved furniture and ten people": 0.0}
    for name, preset, seed in _runs(arguments, arguments.buildings):
        whole = building_of(name, seed)
        for what, building, changed in (
            ("film on all glass", whole.opaque(), 0.0),
            ("moved furniture and ten people", crowded(whole, seed), 1.0 / 3.0),
        ):
            frames = driven(building, lidar.preset(preset), seed, changed)
            grid_map = building_map.draw(building)
            localizer = started(grid_map, frames[0].map_from_base, seed)
            smoother = Smoother(DistanceField(grid_map))
            for frame in frames:
                smoother.listen(
                    Step(frame.scan, frame.odom_from_base), localizer.update(frame.scan, frame.odom_from_base)
                )
            drawn = by_command(grid_map, lambda scans=[frame.scan for frame in frames]: scans, smoother)
            worst[what] = max(worst[what], length_of(localizer.unmapped_panes), length_of(drawn))
            print(
                f"| {name}, {what} | {preset} | {seed} | {_listed(localizer.unmapped_panes)} | {_listed(drawn)} |",
                flush=True,
            )
    for what, length_m in worst.items():
        yield Bar(f"false panes [m], {what}", length_m, most=0.0)


def logs(arguments: argparse.Namespace) -> Iterator[Bar]:
    print("\nLogs\n\n| log | scans | live m | where | map panes m | where |\n|---|---|---|---|---|---|")
    for name in arguments.logs:
        folder = arguments.data / "logs" / name
        replayed = Replayed(folder / f"{name}.bag", map_file.load(folder / "map.yaml"), arguments)
        drawn = replayed.by_command()
        print(f"| {name} | {len(replayed.scans)} | {_listed(replayed.live)} | {_listed(drawn)} |", flush=True)
        yield Bar(f"false panes [m], {name}", max(length_of(replayed.live), length_of(drawn)), most=0.5)


def real(arguments: argparse.Namespace) -> Iterator[Bar]:
    print("\nReal glass erased\n\n| log | intensities | mask m | back live / map panes | found m | glass |")
    print("|---" * 6 + "|")
    for name in REAL:
        folder = arguments.data / "logs" / name
        grid_map = map_file.load(folder / "map.yaml")
        erased = see_through(folder, grid_map)
        lacking = replace(grid_map, occupancy=np.where(erased, np.int8(0), grid_map.occupancy))
        for use in (True, False):
            replayed = Replayed(folder / f"{name}.bag", lacking, arguments, intensities=use)
            if not (use or replayed.has_intensities):
                continue
            drawn = replayed.by_command()
            points = grid_map.centres(*np.nonzero(erased))
            live_back, back = (float(near_any(points, lines_of(panes)).mean()) for panes in (replayed.live, drawn))
            found = np.concatenate([np.zeros((0, 2)), *map(points_along, lines_of(drawn))])
            off_m = ndimage.distance_transform_edt(~erased) * grid_map.resolution_m
            glassy = off_m[grid_map.cells(found)] <= REAL_NEAR_M
            has = replayed.has_intensities
            print(
                f"| {name} | {'used' if use and has else 'none'} | {len(points) * grid_map.resolution_m:.1f} | "
                f"{live_back:.3f} / {back:.3f} | {length_of(drawn):.1f} | {_share(glassy.sum(), len(glassy))} |",
                flush=True,
            )
            words = "" if not has else " with intensities" if use else " without intensities"
            yield Bar(f"see-through walls that come back, {name}{words}", back, 0.5)


def cpu(arguments: argparse.Namespace) -> Iterator[Bar]:
    """Two localizers take turns, so that a busy machine slows both."""
    print("\nCPU per scan\n\n| building | map | without ms | with ms |\n|---|---|---|---|")
    ratios = []
    for name in [each for each in arguments.buildings if each not in (RANDOM, "opaque_office")]:
        building = building_of(name, 0)
        there = driven(building, lidar.preset("sensitive"), arguments.first_seed)
        erased = erased_glass.choose(building, 1.0, 0)
        for words, numbers in (("lacks its glass", erased), ("has its glass", ())):
            grid_map = building_map.draw(building, erased=numbers)
            both = [started(grid_map, there[0].map_from_base, 0, find) for find in (False, True)]
            took_s = np.zeros(2)
            for frame in there:
                for which, localizer in enumerate(both):
                    began_s = time.process_time()
                    localizer.update(frame.scan, frame.odom_from_base)
                    took_s[which] += time.process_time() - began_s
            without_ms, with_ms = 1e3 * took_s / len(there)
            ratios.append(with_ms / without_ms)
            print(f"| {name} | {words} | {without_ms:.2f} | {with_ms:.2f} |", flush=True)
    yield Bar("CPU per scan, with panes over without, worst", max(ratios), most=1.1)


def memory(arguments: argparse.Namespace) -> Iterator[Bar]:
    print(f"\nMemory and time on a map of {LARGE_CELLS} x {LARGE_CELLS} cells\n")
    without_mb, without_ms = _alone(_large_localizer, False, arguments.first_seed)
    with_mb, with_ms = _alone(_large_localizer, True, arguments.first_seed)
    hour = _alone(_large_hour, arguments.first_seed)
    print("| search | localizer MB | longest update ms |\n|---|---|---|")
    print(f"| off | {without_mb:.0f} | {without_ms:.0f} |\n| on | {with_mb:.0f} | {with_ms:.0f} |")
    print("\n| minutes | MB more than at the start | panes m | ms per scan |\n|---|---|---|---|")
    for minutes, grown_mb, found_m, scan_ms in hour[:: max(1, len(hour) // 6)]:
        print(f"| {minutes:.0f} | {grown_mb:.0f} | {found_m:.0f} | {scan_ms:.2f} |")
    half = hour[len(hour) // 2 - 1]
    yield Bar("memory of the search [MB]", with_mb - without_mb, most=200.0)
    yield Bar("memory after an hour less after half of it [MB]", hour[-1][1] - half[1], most=10.0)


# -- a large map


def _tiled(building: Building) -> Tuple[GridMap, np.ndarray]:
    """The map of a building without its panes over and over, and the shifts (N, 2) [m] of the copies."""
    one = building_map.draw(building, erased=erased_glass.choose(building, 1.0, 0))
    height, width = one.occupancy.shape
    rows, columns = LARGE_CELLS // height, LARGE_CELLS // width
    occupancy = np.full((LARGE_CELLS, LARGE_CELLS), -1, np.int8)
    occupancy[: rows * height, : columns * width] = np.tile(one.occupancy, (rows, columns))
    at = np.stack(np.meshgrid(np.arange(columns) * width, np.arange(rows) * height), axis=-1).reshape(-1, 2)
    return replace(one, occupancy=occupancy), at * one.resolution_m


def _alone(function: Callable[..., _T], *arguments: object) -> _T:
    """What a function returns in a process of its own, whose memory is not that of what ran before."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("fork")) as process:
        return process.submit(function, *arguments).result()


def _used_mb() -> float:
    """Memory of this process."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def _large_localizer(find_panes: bool, seed: int) -> Tuple[float, float]:
    """Memory [MB] of a localizer on a large map after a drive, and the time of its longest update [ms]."""
    building = building_of("glass_office", seed)
    there = driven(building, lidar.preset("sensitive"), seed)
    before_mb, longest_s = _used_mb(), 0.0
    grid_map, _ = _tiled(building)
    localizer = started(grid_map, there[0].map_from_base, seed, find_panes)
    for frame in there:
        began_s = time.process_time()
        localizer.update(frame.scan, frame.odom_from_base)
        longest_s = max(longest_s, time.process_time() - began_s)
    return _used_mb() - before_mb, 1e3 * longest_s


def _large_hour(seed: int) -> List[Tuple[float, float, float, float]]:
    """An hour of scans at known poses, each drive through a copy of the building where the robot was not before.

    Returns:
        after each drive: minutes, memory [MB] above that after the first, panes [m], time per scan [ms].
    """
    building = building_of("glass_office", seed)
    frames = driven(building, lidar.preset("sensitive"), seed)
    grid_map, shifts_m = _tiled(building)
    panes = UnmappedPanes(grid_map, PaneUse(), PaneFinderParams())
    covariance = np.diag([0.02, 0.02, 0.005]) ** 2
    rows: List[Tuple[float, float, float, float]] = []
    first_mb, minutes = _used_mb(), 0.0
    for shift_m in shifts_m:
        began_s = time.process_time()
        for frame in frames:
            panes.observe(frame.scan, frame.map_from_base + np.append(shift_m, 0.0), covariance)
        took_ms = 1e3 * (time.process_time() - began_s) / len(frames)
        minutes += len(frames) / SCAN_RATE_HZ / 60.0
        rows.append((minutes, _used_mb() - first_mb, length_of(panes.drawn), took_ms))
        if minutes >= 60.0:
            break
    return rows


# -- logs


class Replayed:
    """A localizer and a smoother after a log."""

    def __init__(self, bag: Path, grid_map: GridMap, arguments: argparse.Namespace, intensities: bool = True) -> None:
        recording = log_file.open_log(bag, LogOptions())
        self._grid_map = grid_map
        self._smoother = Smoother(DistanceField(grid_map))
        self.scans: List[Scan] = []
        self.has_intensities = False
        localizer = Localizer(LocalizerParams(), grid_map, np.random.default_rng(arguments.first_seed))
        for entry in recording:
            self.has_intensities |= entry.scan.intensities is not None
            scan = entry.scan if intensities else replace(entry.scan, intensities=None)
            if not self.scans:
                if recording.ground_truth is None:
                    localizer.scatter()
                else:
                    localizer.set_pose(recording.ground_truth.at(np.int64(scan.stamp_ns)), np.diag(START_DEVIATION**2))
            estimate = localizer.update(scan, entry.odom_from_base)
            self._smoother.listen(Step(scan, entry.odom_from_base), estimate)
            self.scans.append(scan)
            if arguments.max_scans is not None and len(self.scans) >= arguments.max_scans:
                break
        self.live = localizer.unmapped_panes

    def by_command(self) -> List[Pane]:
        return by_command(self._grid_map, lambda: self.scans, self._smoother)


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


def _ratio(part: float, whole: float) -> Optional[float]:
    return part / whole if whole else None


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
    """Building, preset and seed of each drive; the presets take turns."""
    seeds = range(arguments.first_seed, arguments.first_seed + arguments.seeds)
    floors = range(arguments.first_seed, arguments.first_seed + arguments.floors)
    drives = [(name, seed) for seed in seeds for name in buildings if name != RANDOM]
    drives += [(RANDOM, seed) for seed in floors if RANDOM in buildings]
    for number, (name, seed) in enumerate(drives):
        yield name, arguments.lidars[(number + seed) % len(arguments.lidars)], seed


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
    parser.add_argument("--seeds", type=int, default=1, help="drives of each building")
    parser.add_argument("--floors", type=int, default=10, help="random floors, if there are any")
    parser.add_argument("--mappers", nargs="+", choices=MAPPERS, default=list(MAPPERS), metavar="MAPPER")
    parser.add_argument("--logs", nargs="+", choices=LOGS, default=list(LOGS), metavar="LOG", help="default: all")
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
        "memory": memory,
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
