"""What scripts/demo prints of a real robot's log, once `glass_nav replay` has run over it: errors, and how well map and
ground truth agree. `python -m glass_nav.demo.replayed_log LOG MAP RESULTS...`, a folder of results for each seed.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Iterable, Iterator, List, Mapping, Optional

import numpy as np

from glass_nav.evaluation.metrics import replay_result
from glass_nav.evaluation.metrics.replay_result import ReplayResult
from glass_nav.geometry import se2
from glass_nav.recording import log_file
from glass_nav.recording.recording import Step
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.scan import Scan
from glass_nav.world import map_file

_ERRORS = ("median", "rmse", "p95", "max")
_DISAGREES = 2.0  # times as far from the walls as our poses


@dataclass(frozen=True)
class MapAgreement:
    """How far from the walls of the map scans end, from two poses each: the median over the beams of S scans [m]."""

    ours_m: np.ndarray  # (S,) from the pose of glass_nav
    reference_m: np.ndarray  # (S,) from the ground truth

    @property
    def lines(self) -> Iterator[str]:
        """In words."""
        ours_m, reference_m = float(np.median(self.ours_m)), float(np.median(self.reference_m))
        yield (
            f"From the poses of glass_nav the scans end {ours_m:.3f} m from the walls of the map in the median, from those"
        )
        yield (
            f"of the ground truth {reference_m:.3f} m; the former are nearer in {np.mean(self.ours_m < self.reference_m):.0%}"
            f" of {len(self.ours_m)} scans."
        )
        if reference_m > _DISAGREES * ours_m:
            yield "So the ground truth does not agree with the map, and causes most of the error above."
            yield '"misleading" counts the scans in which the two differ by more than the protection level of glass_nav.'


def map_agreement(scans: Iterable[Scan], result: ReplayResult, field: DistanceField) -> MapAgreement:
    """Distance of the beams' ends from the walls, at our poses and at those of the reference; medians of each scan."""
    reference, ours = result.reference, dict(zip(result.stamps_ns.tolist(), result.map_from_base))
    off_m: List[List[float]] = []
    for scan in scans:
        if reference is None or scan.stamp_ns not in ours or not reference.covers(scan.stamp_ns):
            continue
        points_m = scan.points_in_base()[scan.answered]
        if len(points_m):
            ends_m = (
                se2.transform_points(pose, points_m) for pose in (ours[scan.stamp_ns], reference.at(scan.stamp_ns))
            )
            off_m.append([float(np.median(field.distance(*ends.T))) for ends in ends_m])
    return MapAgreement(*np.array(off_m).reshape(-1, 2).T)


def error_table(metrics: "List[Mapping[str, Any]]") -> Iterator[str]:
    """A row for each seed from 1 on, and the worst of each column."""
    rows = [[*(run[f"position_{name}_m"] for name in _ERRORS), run["lost_share"]] for run in metrics]
    yield "  seed  median    rmse     p95     max  lost_share"
    for name, row in [*((f"{seed:6d}", row) for seed, row in enumerate(rows, 1)), (" worst", np.max(rows, axis=0))]:
        yield name + "".join(f"{error:8.3f}" for error in row[:-1]) + f"{row[-1]:12.3f}"


def lines(log: Path, map_of_log: Path, folders: "List[Path]") -> Iterator[str]:
    """All lines to print.

    Raises:
        ValueError, OSError: log, map or results cannot be read; one line.
    """
    results, metrics = zip(*(replay_result.read(folder) for folder in folders))
    yield "\nError against the ground truth [m], one line a seed:"
    yield from error_table(list(metrics))
    scans = (entry.scan for entry in log_file.open_log(log) if isinstance(entry, Step))
    yield ""
    yield from map_agreement(scans, results[0], DistanceField(map_file.load(map_of_log))).lines


def main(arguments: Optional[List[str]] = None) -> None:
    """Print them."""
    parser = argparse.ArgumentParser(prog="python -m glass_nav.demo.replayed_log", description=__doc__)
    parser.add_argument("log", type=Path)
    parser.add_argument("map", type=Path, help="of the log")
    parser.add_argument("results", type=Path, nargs="+", help="folders that glass_nav replay wrote, of seeds 1, 2, ...")
    given = parser.parse_args(arguments)
    for line in lines(given.log, given.map, given.results):
        sys.stdout.write(f"{line}\n")


if __name__ == "__main__":
    main()
