"""Runs a replay and writes its files: results, glass map, pictures, a bag, nodes passed."""

from __future__ import annotations

import platform
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional

import numpy as np

from glass_nav import params
from glass_nav.evaluation.metrics import replay_result, smoothed_score
from glass_nav.evaluation.metrics.passed_nodes import TopologyScore
from glass_nav.evaluation.metrics.replay_result import ReplayResult
from glass_nav.evaluation.metrics.smoothed_score import SmoothedScore
from glass_nav.evaluation.plots import run_pictures
from glass_nav.localization.localizer import Estimate
from glass_nav.recording import trajectory_file
from glass_nav.recording.recording import Step
from glass_nav.replay import replay_bag, replay_topology
from glass_nav.replay.prepared_replay import Listener, PreparedReplay
from glass_nav.replay.smoother import Smoother
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap


@dataclass(frozen=True)
class Outputs:
    """The files to write."""

    folder: Path
    bag: Optional[Path] = None  # for rviz and PlotJuggler
    topology: Optional[str] = None  # name of an atlas, see replay_topology.atlas_of()
    pictures: bool = True
    smooth: bool = False  # also smoothed.tum, and the filter scored against it


class FiledReplay:
    """A replay with its files: run(), then write()."""

    def __init__(self, ready: PreparedReplay, outputs: Outputs) -> None:
        """Makes the folders.

        Raises:
            AtlasError, ValueError, OSError: no such atlas, or one of another map; no folder can be made there.
        """
        self._ready, self._outputs = ready, outputs
        self._watch = None
        if outputs.topology is not None:
            atlas = replay_topology.atlas_of(outputs.topology, ready.options.map, ready.grid_map)
            self._watch = replay_topology.Watch(atlas, ready.grid_map)
        self._smoother = Smoother(DistanceField(ready.grid_map)) if outputs.smooth else None
        self.smoothed: Optional[SmoothedScore] = None  # after write()
        outputs.folder.mkdir(parents=True, exist_ok=True)
        if outputs.bag is not None:
            outputs.bag.parent.mkdir(parents=True, exist_ok=True)

    def run(self, step_done: Callable[[], None]) -> ReplayResult:
        """Runs all scans, and writes the bag.

        Raises:
            RecordingError: not one scan of the log can be used, or the bag cannot be written.
        """
        ready, path = self._ready, self._outputs.bag
        with ExitStack() as stack:
            listeners: List[Listener] = [] if self._watch is None else [self._watch.listen]
            if self._smoother is not None:
                listeners.append(self._smoother.listen)
            if path is not None:
                bag = replay_bag.listener(path, ready.recording, ready.localizer, ready.grid_map)
                listeners.append(stack.enter_context(bag))
            return ready.run(step_done, _all_of(listeners))

    def write(self, result: ReplayResult) -> Optional[TopologyScore]:
        """Writes all other files, including the nodes passed if there is an atlas."""
        ready, folder = self._ready, self._outputs.folder
        grid_map, options = ready.grid_map, ready.options
        topology = self._write_topology(result)
        self.smoothed = self._write_smoothed(result)
        about: Dict[str, Any] = {
            "log": " ".join(map(str, options.log)),
            "map": str(options.map),
            "start": ready.origin,
            "notes": ready.notes,
            "params": params.as_mapping(ready.settings.localizer),
            "versions": versions(),
            **({} if topology is None else {"topology": topology.metrics()}),
            **({} if self.smoothed is None else {"smoothed": self.smoothed.metrics()}),
        }
        replay_result.write(result, folder, about)
        glass = GridMap(ready.localizer.glass_map.occupancy(), grid_map.resolution_m, grid_map.map_from_grid)
        map_file.save(glass, folder / "glass_map.yaml", image_suffix=".png")
        if self._outputs.pictures:
            run_pictures.draw_trajectory(folder / "trajectory.png", grid_map, result, ready.recording.name)
            if result.case_scores is not None:
                run_pictures.draw_cases(folder / "cases.png", grid_map, result, ready.recording.name)
        return topology

    def _write_smoothed(self, result: ReplayResult) -> Optional[SmoothedScore]:
        if self._smoother is None:
            return None
        smoothed = self._smoother.smooth()
        trajectory_file.save_tum(self._outputs.folder / "smoothed.tum", smoothed)
        return smoothed_score.of(smoothed, result)

    def _write_topology(self, result: ReplayResult) -> Optional[TopologyScore]:
        if self._watch is None:
            return None
        topology = self._watch.finish(result)
        replay_topology.write(
            self._outputs.folder,
            topology,
            self._watch.atlas,
            self._ready.grid_map if self._outputs.pictures else None,
            replay_topology.poses(result)[:, :2],
            self._ready.recording.name,
        )
        return topology


def versions() -> Dict[str, str]:
    """Versions of the libraries that the figures depend on."""
    import scipy

    return {
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "machine": platform.machine(),
    }


def _all_of(listeners: List[Listener]) -> Listener:
    def listen(step: Step, estimate: Estimate) -> None:
        for each in listeners:
            each(step, estimate)

    return listen
