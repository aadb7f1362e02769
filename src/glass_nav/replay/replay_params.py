"""The file of --params: parameters of the filter, and the initial pose, under AMCL's names.

The file of a running node serves as it is: what only a node can use is left aside, and said.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Dict, List, Tuple

from glass_nav import amcl_parameters, params
from glass_nav.localization.initial_pose import StartPose
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.localization.method import Method
from glass_nav.params import ParamError
from glass_nav.sensing.deskew import Deskew
from glass_nav.sensing.wheel_odometry import WheelParams

# Of localization_node, beside AMCL's: without a meaning for the replay of a log.
NODE_ONLY = frozenset(
    [
        "transform_wait_s",
        "random_seed",
        "glass_map_period_s",
        "scan_topics",
        "publish_tf_before_localized",
        "start_without_guess",
        "wait_for_initialpose",
        "pose_file",
        "pose_file_max_age_s",
        "pose_file_max_speed_m_s",
        "panes_file",
        "landmark_file",
        "publish_wheel_tf",
    ]
)


@dataclass(frozen=True)
class Frames:
    """Names of frames in the log."""

    odom_frame_id: str = "odom"
    base_frame_id: str = "base_link"


@dataclass(frozen=True)
class ReplayParams:
    """All parameters that a file may set."""

    frames: Frames = field(default_factory=Frames)
    start: StartPose = field(default_factory=StartPose)
    deskew: Deskew = field(default_factory=Deskew)
    wheels: WheelParams = field(default_factory=WheelParams)
    method: Method = field(default_factory=Method)
    localizer: LocalizerParams = field(default_factory=LocalizerParams)


def load(path: Path) -> "Tuple[ReplayParams, List[str]]":
    """The parameters of a yaml file, and the names in it that only a node uses.

    Raises:
        ParamError: no such file, no flat yaml, or a parameter that params.load() refuses.
    """
    mapping = read_mapping(path)
    ours, unused = amcl_parameters.without_unused(mapping, ReplayParams, NODE_ONLY)
    return params.load(ReplayParams, amcl_parameters.adapted(ours, ReplayParams), str(path)), unused


def read_mapping(path: Path) -> Dict[str, Any]:
    """Names and values of a yaml file.

    Raises:
        ParamError: no such file, or no flat yaml.
    """
    import yaml

    try:
        mapping: Any = yaml.safe_load(path.read_text())
    except (OSError, UnicodeDecodeError) as err:
        reason = err.strerror if isinstance(err, OSError) and err.strerror else str(err)
        raise ParamError(f"{path}: cannot be read: {reason}") from err
    except yaml.YAMLError as err:
        raise ParamError(f"{path}: is not yaml: {' '.join(str(err).split())}") from err
    if mapping is None:
        mapping = {}
    if not isinstance(mapping, dict):
        raise ParamError(f"{path}: must hold names and values, got {type(mapping).__name__}")
    return mapping
