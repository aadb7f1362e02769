#!/usr/bin/env python3
"""A robot that drives off its map and comes back: a third of the map of a real log is unknown.

    python test/benchmark/off_the_map.py
    python test/benchmark/off_the_map.py --tracks aces seattle --sides left --first-seed 20

Each way of at least 2 m through the unknown third is a row: the largest error of the pose there, and of odometry alone
from the last pose before; the share of scans LOCALIZED and more than 0.5 m off; and, back on the map, the distance to
the first pose that is LOCALIZED and right within 0.5 m. Exit code 1 if a pose is misleading.
"""

from __future__ import annotations

import argparse
import os
import sys
from dataclasses import replace
from typing import Iterator, NamedTuple, Optional, Tuple

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):  # a process a core: threads would fight for them
    os.environ.setdefault(name, "1")

import numpy as np

import tracks
from glass_nav.geometry import se2
from glass_nav.localization.localizer import Localizer
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.vocabulary import LocalizationState
from glass_nav.world.grid_map import UNKNOWN, GridMap

SIDES = ("left", "right", "lower", "upper")
TRACKS = ("intel", "mit_csail", "aces", "acapulco", "seattle")
LEAST_M = 2.0  # of a way off the map
RIGHT_M = 0.5
START_COVARIANCE = np.diag([0.05, 0.05, 0.01])


class Away(NamedTuple):
    """One way off the map."""

    way_m: float
    most_m: float  # that the pose was off
    reckoned_m: float  # that odometry alone was off
    misled: float  # share of the scans
    back_m: Optional[float]  # on the map until the pose was right; None: until the next way off it, or the end
    ahead_m: float  # way on the map until then


def cut(grid_map: GridMap, side: str) -> Tuple[GridMap, np.ndarray]:
    """The map with a third of what it shows unknown, and (H, W) which cells these are."""
    shown = grid_map.occupancy != UNKNOWN
    third = np.zeros_like(shown)
    cells = np.flatnonzero(shown.any(axis=0 if side in ("left", "right") else 1))
    width = (cells[-1] - cells[0]) // 3
    chosen = slice(0, cells[0] + width) if side in ("left", "lower") else slice(cells[-1] - width, None)
    third[(slice(None), chosen) if side in ("left", "right") else (chosen, slice(None))] = True
    occupancy = grid_map.occupancy.copy()
    occupancy[third] = UNKNOWN
    return replace(grid_map, occupancy=occupancy), third


def ways_off(track: tracks.Track, side: str, seed: int) -> Iterator[Away]:
    """One drive on the cut map; nothing if it starts off the map."""
    grid_map, third = cut(track.grid_map, side)
    truth = np.array([moment.map_from_base for moment in track.moments])
    rows, columns = grid_map.cells(truth[:, :2])
    away = third[rows.clip(0, third.shape[0] - 1), columns.clip(0, third.shape[1] - 1)]
    if away[0] or not away.any():
        return
    localizer = Localizer(LocalizerParams(), grid_map, np.random.default_rng(seed))
    localizer.set_pose(truth[0], START_COVARIANCE)
    estimates = [localizer.update(moment.scan, moment.odom_from_base) for moment in track.moments]
    poses = np.array([each.map_from_base for each in estimates])
    localized = np.array([each.state == LocalizationState.LOCALIZED for each in estimates])
    error_m = np.hypot(*(poses - truth)[:, :2].T)
    driven_m = tracks.ways(track.moments)
    changes = np.flatnonzero(np.diff(np.concatenate([[0], away.astype(int), [0]])))
    begins = np.append(changes[::2], len(away))
    for number, end in enumerate(changes[1::2].tolist()):
        here, there = slice(begins[number], end), slice(end, begins[number + 1])
        way_m = float(driven_m[end - 1] - driven_m[here.start])
        if way_m < LEAST_M:
            continue
        last = max(here.start - 1, 0)
        map_from_odom = se2.compose(poses[last], se2.inverse(track.moments[last].odom_from_base))
        odom = np.array([moment.odom_from_base for moment in track.moments[here]])
        reckoned = se2.compose(map_from_odom, odom)
        right = np.flatnonzero(localized[there] & (error_m[there] < RIGHT_M))
        ahead_m = driven_m[there] - driven_m[end - 1]
        yield Away(
            way_m,
            float(error_m[here].max()),
            float(np.hypot(*(reckoned - truth[here])[:, :2].T).max()),
            float(np.mean(localized[here] & (error_m[here] > RIGHT_M))),
            float(ahead_m[right[0]]) if len(right) else None,
            float(ahead_m[-1]) if len(ahead_m) else 0.0,
        )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tracks", nargs="+", choices=tracks.names(), default=TRACKS, metavar="NAME")
    parser.add_argument("--sides", nargs="+", choices=SIDES, default=SIDES)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--seeds", type=int, default=1)
    arguments = parser.parse_args()
    print("| track, unknown third | off the map, m | most off, m | odometry, m | misleading | right again after, m |")
    print("|---|---|---|---|---|---|")
    misled = False
    for name in arguments.tracks:
        for side in arguments.sides:
            for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds):
                for each in ways_off(tracks.load(name, seed if name not in tracks.LOGS else 0), side, seed):
                    misled = misled or each.misled > 0.0
                    back = f"not in {each.ahead_m:.1f}" if each.back_m is None else f"{each.back_m:.1f}"
                    print(
                        f"| {name}, {side} | {each.way_m:.0f} | {each.most_m:.2f} | {each.reckoned_m:.2f} | "
                        f"{each.misled:.1%} | {back} |",
                        flush=True,
                    )
    return int(misled)


if __name__ == "__main__":
    sys.exit(main())
