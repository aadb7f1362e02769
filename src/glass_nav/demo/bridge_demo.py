"""A drive over a bridge of glass, tracked by glass_nav and by a plain likelihood field from the same scans.

Outside of the bridge nothing is on the map: beams that pass its panes end where the map has nothing, and the panes
themselves answer only at normal incidence. A likelihood field takes each beam for the end of a wall.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice
from typing import Dict, Iterator, Optional, Protocol, Union

import numpy as np

from glass_nav.demo.plain_localization import BEST_FIELD, LikelihoodField, PlainEstimate, PlainMcl
from glass_nav.geometry import angles
from glass_nav.localization.localizer import Estimate, Localizer
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.sensing.scan import Scan
from glass_nav.simulation import building_file, building_map, lidar, shipped_buildings
from glass_nav.simulation.simulation import Simulation

BUILDING = "glass_bridge"
SCAN_RATE_HZ = 5.0  # a scan every 0.12 m: enough for each to be an update
LOST_M = 1.0  # a pose so far off is lost
START_COVARIANCE = np.diag([0.1**2, 0.1**2, 0.05**2])  # of a person who points at the robot on a map
START_ERROR = np.array([0.1, -0.1, 0.05])  # m, m, rad
OURS, FIELD = "glass_nav", "likelihood field"


class _Tracker(Protocol):
    def update(self, scan: Scan, odom_from_base: np.ndarray) -> Union[Estimate, PlainEstimate]:
        """The pose at a scan."""


@dataclass(frozen=True)
class Tracked:
    """How well one localizer followed the drive."""

    position_m: np.ndarray  # (N,) error at each scan
    yaw_rad: np.ndarray  # (N,) absolute

    @property
    def row(self) -> str:
        """A row of figures, under HEADER."""
        off_m = self.position_m
        return (
            f"{np.mean(off_m):9.3f}{np.percentile(off_m, 95):9.3f}{off_m.max():9.3f}"
            f"{np.degrees(self.yaw_rad.mean()):12.2f}{100.0 * np.mean(off_m > LOST_M):10.0f} %"
        )


HEADER = "     mean     95 %      max    yaw, deg   > 1 m off"


def drive(seed: int, max_scans: Optional[int] = None) -> Dict[str, Tracked]:
    """Both localizers over one drive along the building's path.

    Args:
        seed: of everything random.
        max_scans: stop after this many.
    """
    building = building_file.load(shipped_buildings.find(BUILDING))
    grid_map = building_map.draw(building)
    params = LocalizerParams()
    trackers: Dict[str, Union[Localizer, PlainMcl]] = {
        OURS: Localizer(params, grid_map, np.random.default_rng([seed, 1])),
        FIELD: PlainMcl(params, grid_map, np.random.default_rng([seed, 2]), LikelihoodField(grid_map, BEST_FIELD)),
    }
    simulation = Simulation(building, lidar.preset("sensitive"), seed=seed, scan_rate_hz=SCAN_RATE_HZ)
    errors: Dict[str, "list[np.ndarray]"] = {name: [] for name in trackers}
    for number, frame in enumerate(islice(simulation.drive(next(iter(building.paths))), max_scans)):
        for name, tracker in trackers.items():
            if not number:
                tracker.set_pose(frame.map_from_base + START_ERROR, START_COVARIANCE)
            errors[name].append(_off(tracker, frame.scan, frame.odom_from_base, frame.map_from_base))
    return {name: Tracked(*np.array(off).T) for name, off in errors.items()}


def _off(tracker: _Tracker, scan: Scan, odom_from_base: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """Error of the position [m] and of the heading [rad], as (2,)."""
    off = tracker.update(scan, odom_from_base).map_from_base - truth
    return np.array([np.hypot(off[0], off[1]), abs(angles.wrap(off[2]))])


def lines(seeds: int) -> Iterator[str]:
    """A table of so many drives, row by row, as they are done."""
    yield f"A drive over a bridge of glass ({BUILDING}): error against the simulator's truth [m], the same scans for both"
    yield f"  seed  {'localizer':18s}{HEADER}"
    for seed in range(1, seeds + 1):
        for name, tracked in drive(seed).items():
            yield f"  {seed:4d}  {name:18s}{tracked.row}"
