"""Small buildings for a robot that follows edges, and the drive itself: simulation and driver step by step."""

from __future__ import annotations

import math
from typing import Callable, List, Optional, Sequence, Tuple

import numpy as np

from glass_nav.driving.edge_tracking.edge_driver import Arrival, EdgeDriver, EdgeDriverParams
from glass_nav.geometry import se2
from glass_nav.sensing.scan import Scan, scan_from_fields
from glass_nav.simulation import lidar
from glass_nav.simulation.building import Building, Pane, Wall
from glass_nav.simulation.lidar import LidarModel
from glass_nav.simulation.odometry import OdometryParams
from glass_nav.simulation.simulation import Simulation

CONTROL_S = 0.05
LASER = np.array([0.12, 0.0, 0.0])
COARSE = LidarModel(beams=181)
W = 2.0  # width of corridors [m]

# A T: a corridor along x from 0 to 12, one that leaves it southward at x = 6; inner faces, walls of 0.1 m around.
T_FACES = np.array([[0.0, 0.0], [5.0, 0.0], [5.0, -5.0], [7.0, -5.0], [7.0, 0.0], [12.0, 0.0], [12.0, W], [0.0, W]])
T_MEETPOINT = np.array([6.0, 0.375 * W])
T_R_M = 0.625 * W

SIDE_CORRIDOR_WALLS = (
    Wall(
        np.array(
            [
                [-0.1, -0.1],
                [12.1, -0.1],
                [12.1, 2.1],
                [6.1, 2.1],
                [6.1, 6.1],
                [3.9, 6.1],
                [3.9, 2.1],
                [-0.1, 2.1],
                [-0.1, -0.1],
            ]
        )
    ),
)


def walled(faces_m: np.ndarray, thickness_m: float = 0.1) -> Building:
    """Walls around a room, with their faces on a closed line (N, 2) that runs counterclockwise."""
    closed = np.concatenate([faces_m, faces_m[:1]])
    along = np.diff(closed, axis=0)
    outward = np.column_stack([along[:, 1], -along[:, 0]]) / np.hypot(*along.T)[:, None]
    middle = 0.5 * thickness_m * (outward + np.roll(outward, 1, axis=0))  # of right-angled corners
    corners = faces_m + middle
    return Building((Wall(np.concatenate([corners, corners[:1]]), thickness_m),))


def t_corridor(panes: Sequence[Pane] = ()) -> Building:
    return Building(walled(T_FACES).walls, panes=tuple(panes))


def glass_t() -> Building:
    """The T with panes for the long wall across, at y = W, and a hall behind them."""
    corners = [(7.05, -5.05), (7.05, -0.05), (12.05, -0.05), (12.05, W + 0.05)]
    left = [(-0.05, W + 0.05), (-0.05, -0.05), (4.95, -0.05), (4.95, -5.05), (7.05, -5.05)]
    behind = [(-0.05, W + 0.05), (-0.05, W + 3.0), (12.05, W + 3.0), (12.05, W + 0.05)]
    return Building(
        (Wall(np.array(corners), 0.1), Wall(np.array(left), 0.1), Wall(np.array(behind), 0.1)),
        panes=(Pane(np.array([[0.0, W], [5.9, W]])), Pane(np.array([[6.1, W], [12.0, W]]))),
    )


def scan_at(
    building: Building,
    pose: Sequence[float],
    rng: np.random.Generator,
    stamp_s: float = 0.0,
    model: LidarModel = COARSE,
) -> Scan:
    """What the lidar of a robot at that pose (3,) shows."""
    seen = lidar.scan(model, building, se2.compose(np.array(pose, float), LASER), stamp_s, rng)
    angles_rad = model.angles_rad
    return scan_from_fields(
        round(stamp_s * 1e9),
        seen.ranges_m,
        float(angles_rad[0]),
        float(angles_rad[1] - angles_rad[0]),
        model.range_min_m,
        model.range_max_m,
        LASER,
    )


class Drive:
    """A driver in a simulated building."""

    def __init__(
        self,
        building: Building,
        start: Sequence[float],
        model: LidarModel = COARSE,
        seed: int = 0,
        p: EdgeDriverParams = EdgeDriverParams(),
        odometry: OdometryParams = OdometryParams(),
        scan_rate_hz: float = 5.0,  # most drives need no more
    ) -> None:
        self.simulation = Simulation(
            building, model, odometry=odometry, seed=seed, start=np.array(start, float), scan_rate_hz=scan_rate_hz
        )
        self.driver = EdgeDriver(p)
        self.command = np.zeros(3)
        self.commands: List[np.ndarray] = []
        self.poses: List[np.ndarray] = []  # truth
        self.blocked = 0
        self.map_from_odom = se2.compose(
            self.simulation.map_from_base, se2.inverse(self.simulation.reading.odom_from_base)
        )  # at the start
        self.seen_map_from_base = self.simulation.map_from_base  # at the last scan

    def scan(self) -> None:
        """A scan, and the control steps until the next."""
        frame = self.simulation.look()
        self.seen_map_from_base = frame.map_from_base
        self.driver.see(frame.scan, frame.odom_from_base)
        for _ in range(round(self.simulation.scan_period_s / CONTROL_S)):
            self.command = self.driver.command(self.simulation.reading.odom_from_base, CONTROL_S)
            self.commands.append(self.command)
            self.simulation.move(CONTROL_S, self.command)
            self.poses.append(self.simulation.map_from_base)
            self.blocked += self.simulation.blocked

    def until(self, done: Callable[[], bool], limit_s: float = 90.0) -> None:
        for _ in range(round(limit_s / self.simulation.scan_period_s)):
            if done():
                return
            self.scan()
        assert done(), f"not after {limit_s} s: {self.driver.progress}"

    def arrival(self, limit_s: float = 90.0) -> Arrival:
        """Drive on to the next meetpoint."""
        found: List[Optional[Arrival]] = []

        def arrived() -> bool:
            found.append(self.driver.take_arrival())
            return found[-1] is not None or self.driver.progress.phase == "FAILED"

        self.until(arrived, limit_s)
        assert found[-1] is not None, self.driver.progress
        return found[-1]

    def where(self, arrival: Arrival) -> np.ndarray:
        """(2,) the meetpoint in the map, from where the robot truly stands: it stands since it was seen."""
        return se2.transform_points(self.simulation.map_from_base, arrival.meetpoint.centre_m)


def turned_to(bearing_rad: float, other_rad: float) -> float:
    return abs(math.remainder(bearing_rad - other_rad, 2.0 * math.pi))


def bounds(points: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    return points.min(axis=0), points.max(axis=0)
