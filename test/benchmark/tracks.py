"""Drives with ground truth, recorded and simulated, and events such as kidnapping.

A track is a map and frames of scan, odometry and true pose. Names: those of the logs in GLASS_NAV_DATA (default
../shared/data beside the repository), and those of the buildings in maps/.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

import drives
import replay_logs
from glass_nav.geometry import angles, se2
from glass_nav.recording.recording import Refusal
from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import GridMap

LOGS = tuple(replay_logs.PEERS)
RIGHT_M, RIGHT_RAD = 0.7, np.radians(20.0)  # the references of the Wean logs are good to 0.3 m


class Moment(NamedTuple):
    """One scan and where the robot was."""

    scan: Scan
    odom_from_base: np.ndarray  # (3,)
    map_from_base: np.ndarray  # (3,) the truth


class Track(NamedTuple):
    """A drive: a map and frames."""

    name: str
    grid_map: GridMap
    moments: List[Moment]
    copy_cells: Optional[Tuple[int, int]] = None  # rows and columns of one copy, if the map is repeated


def names() -> List[str]:
    """All available tracks."""
    return [*LOGS, *drives.buildings()]


@lru_cache(maxsize=4)
def load(name: str, seed: int) -> Track:
    """The track of that name; for a building, the seed determines drive, lidar and noise."""
    if name not in LOGS:
        presets = drives.lidars()
        grid_map, frames = drives.drive(name, presets[seed % len(presets)], seed)
        return Track(
            name, grid_map, [Moment(frame.scan, frame.odom_from_base, frame.map_from_base) for frame in frames]
        )
    recording, grid_map = replay_logs.load(name, False)
    truth = recording.ground_truth
    assert truth is not None
    return Track(
        name,
        grid_map,
        [
            Moment(entry.scan, entry.odom_from_base, truth.at(np.int64(entry.scan.stamp_ns)))
            for entry in recording
            if not isinstance(entry, Refusal)
        ],
    )


def repeated(track: Track, cells: Tuple[int, int]) -> Track:
    """The same drive on a map that is repeated until it has so many rows and columns."""
    occupancy = track.grid_map.occupancy
    times = [-(-wanted // length) for wanted, length in zip(cells, occupancy.shape)]
    large = np.ascontiguousarray(np.tile(occupancy, times)[: cells[0], : cells[1]])
    return track._replace(grid_map=replace(track.grid_map, occupancy=large), copy_cells=occupancy.shape)


def in_first_copy(track: Track, map_from_base: np.ndarray) -> np.ndarray:
    """The pose (3,) in the first copy of a repeated map; else the same."""
    if track.copy_cells is None:
        return map_from_base
    map_from_grid, resolution_m = track.grid_map.map_from_grid, track.grid_map.resolution_m
    grid_from_base = se2.compose(se2.inverse(map_from_grid), map_from_base)
    grid_from_base[:2] %= np.array(track.copy_cells[::-1]) * resolution_m
    return se2.compose(map_from_grid, grid_from_base)


def start_of(track: Track, rng: np.random.Generator, share: float = 1.0 / 3.0) -> int:
    """A moment of the first part of the track."""
    return int(rng.integers(max(1, int(share * len(track.moments)))))


def carried_away(
    track: Track, rng: np.random.Generator, before_m: float, least_m: float = 2.0
) -> Tuple[List[Moment], int]:
    """A drive in which the robot is kidnapped unnoticed, and the moment it is set down.

    Odometry and stamps continue as if nothing had happened.

    Args:
        track: the drive.
        rng: source of all randomness.
        before_m: distance driven before.
        least_m: least distance that it is moved, unless it is turned by more than half a right angle.
    """
    way = ways(track.moments)
    half = [index for index in range(len(way)) if way[index] >= before_m]
    lifted = int(rng.choice(half[: max(1, len(half) // 2)]))
    begin = int(np.searchsorted(way, way[lifted] - before_m))
    here = track.moments[lifted].map_from_base
    there = [
        index
        for index, moment in enumerate(track.moments[: int(0.8 * len(way))])
        if not _near(moment.map_from_base, here, least_m, np.radians(45.0))
    ]
    down = int(rng.choice(there))
    ahead = track.moments[lifted]
    shift_ns = ahead.scan.stamp_ns - track.moments[down].scan.stamp_ns + 1
    odom_from_odom = se2.compose(ahead.odom_from_base, se2.inverse(track.moments[down].odom_from_base))
    after = [
        Moment(
            replace(moment.scan, stamp_ns=moment.scan.stamp_ns + shift_ns),
            se2.compose(odom_from_odom, moment.odom_from_base),
            moment.map_from_base,
        )
        for moment in track.moments[down:]
    ]
    return track.moments[begin : lifted + 1] + after, lifted + 1 - begin


def ways(moments: Sequence[Moment]) -> np.ndarray:
    """(N,) distance driven [m] up to each moment."""
    points = np.array([moment.map_from_base[:2] for moment in moments])
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])


def is_right(map_from_base: np.ndarray, truth: np.ndarray) -> bool:
    """Whether the pose is at that place."""
    return _near(map_from_base, truth, RIGHT_M, RIGHT_RAD)


def moments_of(track: Track, start: int, most_m: float) -> Iterator[Tuple[float, Moment]]:
    """Distance since the start [m] and moment, up to that distance."""
    way = ways(track.moments[start:])
    for way_m, moment in zip(way, track.moments[start:]):
        if way_m > most_m:
            return
        yield float(way_m), moment


def _near(pose: np.ndarray, other: np.ndarray, reach_m: float, reach_rad: float) -> bool:
    off = pose - other
    return bool(np.hypot(off[0], off[1]) < reach_m and abs(angles.wrap(off[2])) < reach_rad)
