"""The decisions of the localization node: when a localizer starts and where, when it restarts, what is missing."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Callable, Optional

import numpy as np

from glass_nav.localization import initial_pose
from glass_nav.localization.initial_pose import PoseGuess, StartPose, StartRules
from glass_nav.localization.initial_poses import InitialPoses, OdometryAt
from glass_nav.localization.localizer import Estimate
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.localization.method import Method, PoseFilter
from glass_nav.localization.panes_memory import PanesFilePath, PanesMemory
from glass_nav.localization.saved_pose import PoseFile
from glass_nav.localization.state_log import StateLog
from glass_nav.sensing.scan import Scan
from glass_nav.vocabulary import LocalizationState
from glass_nav.world.grid_map import GridMap

SILENCE_S = 3.0  # without a used scan for that long, something is missing

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class SessionParams:
    """Parameters of a session."""

    localizer: LocalizerParams
    start: StartPose
    rules: StartRules
    pose_file: PoseFile
    panes_file: PanesFilePath = PanesFilePath()
    method: Method = Method()


@dataclass(frozen=True)
class Inputs:
    """The state of the node's inputs, for missing()."""

    now_s: float  # ROS time; 0: nothing publishes /clock yet
    last_scan_s: float  # when the last scan arrived
    silence: str  # what to say if none arrives
    scan_trouble: str  # why the last scan that was not used was not
    map_trouble: Optional[str]  # why there is no map; None: there is one, or none is due


class LocalizationSession:
    """A sequence of localizers: a new one starts with the first map, and whenever time jumps back."""

    def __init__(
        self,
        params: SessionParams,
        odometry_at: OdometryAt,
        time_is_simulated: bool,
        now_s: float,
        on_start_over: Callable[[], None],
    ) -> None:
        """
        Args:
            params: as the node was started with.
            odometry_at: moves a given pose forward to the scan that it meets.
            time_is_simulated: a jump back means that the robot starts over too.
            now_s: ROS time.
            on_start_over: called whenever the pose that was known no longer holds.
        """
        self._params, self._time_is_simulated, self._on_start_over = params, time_is_simulated, on_start_over
        self._rng = params.rules.rng
        self._starts = InitialPoses(params.start, params.rules.start_without_guess, params.pose_file, odometry_at)
        self._panes = PanesMemory(params.panes_file)
        self.localizer: Optional[PoseFilter] = None
        self.grid_map: Optional[GridMap] = None
        self.map_origin = ""  # where it came from, in words
        self.waits_for_pose = params.rules.wait_for_initialpose  # with a map, without a localizer
        self.estimate: Optional[Estimate] = None
        self.scan: Optional[Scan] = None  # that the estimate was made of
        self.last_estimate_s = now_s
        self._state_log = StateLog()
        self.pose_is_news = True  # until the next estimate is out, even if that scan does not move the particles

    # -- maps, poses and parameters from outside

    def use_map(self, grid_map: GridMap, origin: str) -> bool:
        """Begin with the first map; a later one leaves the particles where they are. Whether it is another one."""
        if self.localizer is not None and self.grid_map is not None and grid_map.digest == self.grid_map.digest:
            _log.info(f"the map from {origin} is already in use: nothing changes")
            return False
        self.keep_panes()
        self.grid_map = grid_map
        if self.localizer is not None:
            self.localizer.set_map(grid_map)
            self._panes.recall(self.localizer, grid_map)
        elif not self.waits_for_pose:
            self._begin()
        self.map_origin = origin
        height, width = grid_map.occupancy.shape
        _log.info(f"map of {width} x {height} cells of {grid_map.resolution_m:g} m from {origin}")
        return True

    def give(self, guess: PoseGuess, now_s: float) -> None:
        """A pose from outside, for the next scan. ValueError if it is not on the map."""
        if self.grid_map is not None:
            initial_pose.refuse_outside(guess, self.grid_map)
        self._starts.give(guess, now_s)
        self._wait_no_more()

    def give_with_map(self, guess: PoseGuess, now_s: float) -> None:
        """A pose that came along with a map which is in use already."""
        self.give(guess, now_s)
        if self._params.rules.force_update_after_set_map:
            self.request_update()

    def search(self, area: Optional[np.ndarray] = None) -> None:
        """Start over anywhere in the map, or in an area (N, 2) of it. ValueError without a map or without room."""
        self._wait_no_more()
        self._running().scatter(area)
        self._starts.forget()
        self._start_over()
        where = "the map" if area is None else f"an area of {len(area)} corners"
        _log.info(f"global localization: the robot may be anywhere in {where}")

    def request_update(self) -> None:
        """Have the next scan move the particles, even if the robot stands. ValueError without a map."""
        self._running().request_update()

    def reconfigure(self, params: SessionParams) -> None:
        """Use other parameters from now on; the localizer keeps its state."""
        if self.localizer is not None:
            self.localizer.reconfigure(params.localizer)
        self._params = params

    # -- scans

    @property
    def refusal(self) -> Optional[str]:
        """Why no scan can be used; None if one can."""
        return "there is no map yet" if self.localizer is None else None

    def start_at_given_pose(self, scan_ns: int, odom_from_base: np.ndarray, now_s: float) -> None:
        """Before update() of each scan: start over at the pose that waits, if one does and it is its time."""
        assert self.grid_map is not None
        localizer = self._running()
        if self._starts.apply(localizer, self.grid_map, scan_ns, odom_from_base, now_s):
            self.pose_is_news = True
            if self._params.rules.force_update_after_initialpose:
                localizer.request_update()

    def update(self, scan: Scan, odom_from_base: np.ndarray, now_s: float) -> Optional[Estimate]:
        """Process a scan; None if the pose is not finite, which must not be published.

        Raises:
            ValueError: the scan cannot be used.
        """
        estimate = self._running().update(scan, odom_from_base)
        if not is_finite(estimate):
            return None
        self.estimate, self.scan, self.last_estimate_s = estimate, scan, now_s
        line = self._state_log.take(estimate)
        if line is not None:
            _log.log(line.level, line.text)
        self._panes.tell(self._running())
        return estimate

    # -- panes that the map lacks

    @property
    def lacking_glass(self) -> Optional[str]:
        """How much glass the map lacks, and the command that draws it into the map; None: none was found."""
        return None if self.localizer is None else self._panes.summary(self.localizer)

    def save_panes(self) -> str:
        """Write ~panes_file; what was written, in words. ValueError if it cannot be."""
        localizer = self._running()
        assert self.grid_map is not None
        return self._panes.save(localizer, self.grid_map)

    def keep_panes(self) -> None:
        """Write ~panes_file, if there is one, before this localizer ends."""
        if self.localizer is not None and self.grid_map is not None:
            self._panes.keep(self.localizer, self.grid_map)

    # -- time, and what is missing

    def restart(self, why: str, now_s: float) -> None:
        """Time jumped: forget stamps. In simulated time the robot starts over too, otherwise it stays."""
        self._starts.forget()
        self.last_estimate_s = now_s
        if not self._time_is_simulated and self.estimate is not None:
            self._starts.begin_at(self.estimate.map_from_base, self.estimate.covariance)
        self.estimate, self._state_log = None, StateLog()
        self._rng = self._params.rules.rng  # a bag that starts over gives the same poses again
        if self._time_is_simulated and self._params.rules.wait_for_initialpose:
            self.waits_for_pose, self.localizer = True, None
            _log.warning(f"{why}: waiting for an initial pose again")
        elif self.grid_map is not None:
            _log.warning(f"{why}: the filter restarts {self._begin()}")

    def missing(self, inputs: Inputs) -> Optional[str]:
        """Why no scan is being used; None while all is well."""
        if inputs.now_s == 0.0:
            return "no time: /use_sim_time is set, but nothing publishes /clock"
        if self.localizer is None:
            no_pose = "waiting for an initial pose" if self.grid_map is not None else "no map yet"
            return inputs.map_trouble or no_pose
        if inputs.now_s - inputs.last_scan_s > SILENCE_S:
            return inputs.silence
        if inputs.now_s - self.last_estimate_s > SILENCE_S or self.estimate is None:
            return inputs.scan_trouble
        return None

    @property
    def state_without_scans(self) -> LocalizationState:
        """The state to report while no scan is used."""
        return LocalizationState.UNKNOWN if self.estimate is None else LocalizationState.UNCERTAIN

    def _running(self) -> PoseFilter:
        if self.localizer is None:
            raise ValueError("there is no map yet")
        return self.localizer

    def _begin(self) -> str:
        """A new localizer, at the start that there is; where, in words."""
        assert self.grid_map is not None
        self.localizer = self._params.method.begin(self._params.localizer, self.grid_map, self._rng)
        self._panes.recall(self.localizer, self.grid_map)
        self._start_over()
        return self._starts.begin(self.localizer)

    def _wait_no_more(self) -> None:
        """Stop waiting: there is a pose, or a search was requested."""
        if self.waits_for_pose:
            self.waits_for_pose = False
            if self.grid_map is not None:
                self._begin()

    def _start_over(self) -> None:
        self.pose_is_news = True
        self._on_start_over()


def is_finite(estimate: Estimate) -> bool:
    """Whether the estimate may go out: no NaN on tf, ever."""
    return all(
        bool(np.all(np.isfinite(values)))
        for values in (estimate.map_from_base, estimate.map_from_odom, estimate.covariance)
    )
