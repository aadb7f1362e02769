"""Turns a goal in the map into the task that drives there, or says in one line why it cannot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Optional

import numpy as np

from glass_nav.driving.driver_params import DriveParams
from glass_nav.driving.edge_tracking.edge_driver import EdgeDriver
from glass_nav.driving.route import RoutePlanner
from glass_nav.driving.tasks import GoTask, Task
from glass_nav.topology.atlas.atlas import Atlas, AtlasError
from glass_nav.world.grid_map import GridMap

TaskTo = Callable[[np.ndarray], Task]  # the task that drives to a pose (3,) of the map


@dataclass(frozen=True)
class PlaceGoal:
    """A goal: a node of the atlas, or a pose."""

    node: int  # < 0: the pose
    pose: Optional[np.ndarray] = None  # (3,) in the frame
    frame: str = ""
    with_heading: bool = False  # stand there as the pose looks; else as the robot comes
    pose_fault: str = "a pose must be given"  # if there is none

    @property
    def name(self) -> str:
        """The goal as text."""
        return str(self.node) if self.node >= 0 else "pose"


class PlaceTasks:
    """Makes tasks for goals in the map of one atlas."""

    def __init__(
        self, p: DriveParams, driver: EdgeDriver, map_frame: str, atlas: Optional[Atlas], backend: Optional[TaskTo]
    ) -> None:
        """
        Args:
            p: of the driver.
            driver: that sees the obstacles.
            map_frame: in which poses must be given.
            atlas: None: there is none.
            backend: drives to poses in place of our own route follower; None: ours does.
        """
        self._p, self._driver, self._map_frame, self._atlas, self._backend = p, driver, map_frame, atlas, backend
        self._map: Optional[GridMap] = None
        self._map_fault = ""
        self._planner: Optional[RoutePlanner] = None

    def map_served(self, grid_map: GridMap, name: str) -> str:
        """A map is served: straight drives go where it is free.

        Args:
            grid_map: it.
            name: for people, as "that of topic /map".

        Returns:
            A warning where the atlas is of a map that differs in a few cells, else "".

        Raises:
            AtlasError: the atlas is of another map; goals are refused from now on.
        """
        self._map, self._planner, self._map_fault = grid_map, None, ""
        if self._atlas is None:
            return ""
        try:
            return self._atlas.check_map(grid_map, name)
        except AtlasError as err:
            self._map_fault = f"the atlas {err}"
            raise AtlasError(f"goto_node cannot be used: {self._map_fault}") from err

    def task(self, goal: PlaceGoal, map_from_base: Optional[np.ndarray]) -> Task:
        """The task that drives to a goal.

        Args:
            goal: it.
            map_from_base: (3,) where the robot is, if that is known.

        Raises:
            ValueError: it cannot be a goal; one line.
        """
        self._refuse(goal)
        yaw_rad = float(goal.pose[2]) if goal.with_heading and goal.pose is not None else None
        if self._backend is not None:
            return self._backend(self._target(goal, yaw_rad, map_from_base))
        if self._atlas is None:
            raise ValueError("routes to goals follow an atlas: ~atlas is ''")
        if self._planner is None:
            self._planner = RoutePlanner(self._atlas, self._p.edge.limits, self._map)
        return GoTask(
            self._planner,
            self._driver,
            self._p.follower,
            self._p.recovery,
            self._p.edge.limits,
            goal.node if goal.node >= 0 or goal.pose is None else goal.pose[:2],
            yaw_rad,
        )

    def _refuse(self, goal: PlaceGoal) -> None:
        if goal.node < 0:
            if goal.frame != self._map_frame:
                raise ValueError(f"the pose must be given in frame {self._map_frame!r}, got {goal.frame!r}")
        elif self._atlas is None:
            raise ValueError("a goal by node needs an atlas: ~atlas is ''")
        elif goal.node >= len(self._atlas.nodes):
            raise ValueError(
                f"node {goal.node}: the atlas {self._atlas.name} has nodes 0 to {len(self._atlas.nodes) - 1}"
            )
        if goal.pose is None and (goal.node < 0 or goal.with_heading):
            raise ValueError(goal.pose_fault)
        if self._map_fault:
            raise ValueError(self._map_fault)

    def _target(self, goal: PlaceGoal, yaw_rad: Optional[float], map_from_base: Optional[np.ndarray]) -> np.ndarray:
        """(3,) goal pose; without a heading of its own it gets the robot's present one."""
        if goal.node < 0 and goal.pose is not None:
            return goal.pose
        assert self._atlas is not None  # a goal by node was refused without one
        if yaw_rad is None:
            yaw_rad = 0.0 if map_from_base is None else float(map_from_base[2])
        return np.append(self._atlas.nodes.position_m[goal.node], yaw_rad)
