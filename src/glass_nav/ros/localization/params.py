"""The private parameters of the localization node, from the parameter server to validated dataclasses.

Names and defaults are AMCL's where AMCL has the parameter. Parameters of AMCL without a meaning for
this filter are removed first, so that launch files written for amcl load. Other unknown names are rejected with the
nearest known name; started as amcl, which ignores such names, the node skips them with a warning.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Any, Dict, List, Mapping, Tuple

import numpy as np

from glass_nav import amcl_parameters, params
from glass_nav.localization.initial_pose import StartPose, StartRules
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.localization.method import Method
from glass_nav.localization.panes_memory import PanesFilePath
from glass_nav.localization.particle_filter.motion import MODELS
from glass_nav.localization.saved_pose import PoseFile
from glass_nav.localization.session import SessionParams
from glass_nav.params import ParamError, number
from glass_nav.sensing.deskew import Deskew
from glass_nav.sensing.wheel_odometry import WheelParams

__all__ = ["LocalizationNodeParams", "LocalizationParams", "ParamError", "localization_params"]


@dataclass(frozen=True)
class LocalizationNodeParams:
    """Parameters of the node itself: frames, map, initial pose, rates. Units by REP 103."""

    odom_frame_id: str = "odom"
    base_frame_id: str = "base_link"
    global_frame_id: str = "map"
    scan_topics: Tuple[str, ...] = ()  # of several lidars; empty: scan
    tf_broadcast: bool = True
    publish_tf_before_localized: bool = True  # False: map -> odom is published once the state has been LOCALIZED
    transform_tolerance: float = number(
        0.1, 0.0, 100.0
    )  # [s] how far ahead of the scan map -> odom is stamped, at least
    transform_wait_s: float = number(1.0, 0.0, 100.0)  # [s] how long a scan waits for odom <- base <- laser
    publish_wheel_tf: bool = False  # odom -> base as the wheels tell it, with wheel_topics
    use_map_topic: bool = False
    first_map_only: bool = False
    # [Hz] of particlecloud, ~beam_cloud, ~beam_markers; <= 0: no limit
    gui_publish_rate: float = number(-1.0, -1.0, 1000.0)
    glass_map_period_s: float = number(2.0, 0.0, 3600.0)  # [s] shortest time between messages of ~glass_map
    save_pose_rate: float = number(0.5, -1.0, 1000.0)  # [Hz]; <= 0: only at shutdown
    std_warn_level_x: float = number(0.2, 0.0, 1e6)  # [m]
    std_warn_level_y: float = number(0.2, 0.0, 1e6)  # [m]
    std_warn_level_yaw: float = number(0.1, 0.0, 1e6)  # [rad]
    landmark_file: str = ""  # landmarks.yaml; "": bearings are not used

    def __post_init__(self) -> None:
        if len(set(self.scan_topics)) < len(self.scan_topics) or not all(self.scan_topics):
            raise ValueError(f"~scan_topics must name each topic once, got {list(self.scan_topics)}")
        for name in ("odom_frame_id", "base_frame_id", "global_frame_id"):
            frame = getattr(self, name)
            object.__setattr__(self, name, frame.lstrip("/"))  # tf2 has no "/" in front; tf1 files do
            if not frame.strip("/ "):
                raise ValueError(f"~{name} must name a frame, got {frame!r}")
        frames = self.odom_frame_id, self.base_frame_id, self.global_frame_id
        if len(set(frames)) < 3:
            raise ValueError(
                "~odom_frame_id, ~base_frame_id and ~global_frame_id must differ, "
                f"got {frames[0]!r}, {frames[1]!r}, {frames[2]!r}"
            )
        for name, kind in [(f.name, f.type) for f in dataclasses.fields(self)]:
            if kind in (float, "float") and not math.isfinite(getattr(self, name)):
                raise ValueError(f"~{name} must be finite, got {getattr(self, name)}")
        for name in (
            "transform_tolerance",
            "transform_wait_s",
            "glass_map_period_s",
            "std_warn_level_x",
            "std_warn_level_y",
            "std_warn_level_yaw",
        ):
            if not getattr(self, name) >= 0.0:
                raise ValueError(f"~{name} must be >= 0, got {getattr(self, name)}")

    @property
    def warn_deviations(self) -> np.ndarray:
        """(3,) ~std_warn_level of x [m], y [m], yaw [rad]."""
        return np.array([self.std_warn_level_x, self.std_warn_level_y, self.std_warn_level_yaw])


@dataclass(frozen=True)
class LocalizationParams:
    """All parameters of the node, its own and the filter's, one flat set of names."""

    node: LocalizationNodeParams = field(default_factory=LocalizationNodeParams)
    start: StartPose = field(default_factory=StartPose)
    rules: StartRules = field(default_factory=StartRules)
    pose_file: PoseFile = field(default_factory=PoseFile)
    panes_file: PanesFilePath = field(default_factory=PanesFilePath)
    deskew: Deskew = field(default_factory=Deskew)
    wheels: WheelParams = field(default_factory=WheelParams)
    method: Method = field(default_factory=Method)
    localizer: LocalizerParams = field(default_factory=LocalizerParams)

    @property
    def session(self) -> SessionParams:
        """Parameters of the session."""
        return SessionParams(self.localizer, self.start, self.rules, self.pose_file, self.panes_file, self.method)


# The node's own parameters that may change while it runs; of the filter's, all may.
CHANGEABLE = (
    "tf_broadcast",
    "publish_tf_before_localized",
    "transform_tolerance",
    "transform_wait_s",
    "force_update_after_initialpose",
    "force_update_after_set_map",
    "gui_publish_rate",
    "glass_map_period_s",
    "save_pose_rate",
    "std_warn_level_x",
    "std_warn_level_y",
    "std_warn_level_yaw",
)


def changeable(p: LocalizationParams) -> Dict[str, Any]:
    """Name -> value of the parameters that may change while the node runs."""
    own = {**params.as_mapping(p.node), **params.as_mapping(p.rules)}
    return {**params.as_mapping(p.localizer), **params.as_mapping(p.deskew), **{name: own[name] for name in CHANGEABLE}}


def changed(p: LocalizationParams, values: Mapping[str, Any], owner: str) -> LocalizationParams:
    """The parameters with new values for those that may change.

    Raises:
        ParamError: a wrong type, or a value out of its range.
    """
    return params.load(LocalizationParams, {**params.as_mapping(p), **values}, owner)


def localization_params(mapping: Mapping[str, Any], owner: str) -> Tuple[LocalizationParams, List[str]]:
    """The parameters of the node, and the names in the mapping that are AMCL's and not used here.

    Args:
        mapping: names -> values as the parameter server has them under the node's name.
        owner: the node's name, the first word of an error.

    Raises:
        ParamError: an unknown name, a wrong type, a value out of its range.
    """
    ours, unused = amcl_parameters.without_unused(mapping, LocalizationParams)
    return params.load(LocalizationParams, amcl_parameters.adapted(ours, LocalizationParams), owner), unused


def as_amcl_reads(mapping: Mapping[str, Any], owner: str) -> Tuple[Dict[str, Any], List[str]]:
    """The mapping without the values that amcl ignores, and a line on each of them.

    As roscpp reads parameters: one of another type counts as not set, a number for a count is rounded. AMCL also ignores
    an initial pose of NaN, and takes an odometry model that it does not know for diff.
    """
    defaults = params.as_mapping(LocalizationParams())
    kept: Dict[str, Any] = {}
    lines: List[str] = []
    for name, value in mapping.items():
        fault = params.type_fault(LocalizationParams, name, value)
        if type(value) is float and math.isnan(value) and name.startswith("initial_"):
            fault = f"~{name} must be finite, got {value}"
        elif type(value) is float and math.isfinite(value) and type(defaults.get(name)) is int:
            kept[name] = math.floor(value + 0.5)
            lines += [f"{owner}: {fault}; rounded to {kept[name]}, as by amcl"] if fault else []
            continue
        elif name == "odom_model_type" and not fault and value not in MODELS:
            kept[name] = MODELS[0]
            lines.append(f"{owner}: ~{name} must be one of {', '.join(MODELS)}, got {value!r}; {MODELS[0]}, as by amcl")
            continue
        if fault:
            lines.append(f"{owner}: {fault}; not used, as by amcl: the default is {defaults[name]!r}")
        else:
            kept[name] = value
    return kept, lines


def without_unknown(mapping: Mapping[str, Any], owner: str) -> Tuple[Dict[str, Any], List[str]]:
    """The mapping without the names that neither this node nor AMCL has, and a line on each of them.

    AMCL ignores other names, so launch files of robots carry those of other nodes and of older versions.
    """
    known = {*params.names(LocalizationParams), *amcl_parameters.NAMES}
    unknown = [name for name in mapping if name not in known]
    return (
        {name: value for name, value in mapping.items() if name in known},
        [f"{params.unknown(name, known, owner)}; not used, as by amcl" for name in unknown],
    )


def on_server(p: LocalizationParams) -> Dict[str, Any]:
    """Name -> value of all parameters that the parameter server can hold."""
    held = {name: list(value) if isinstance(value, tuple) else value for name, value in params.as_mapping(p).items()}
    return {name: value for name, value in held.items() if isinstance(value, (bool, int, float, str, list))}
