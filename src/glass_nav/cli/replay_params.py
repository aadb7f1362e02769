"""The file of --params: parameters of the filter, and where the robot starts, under AMCL's names.

The file of a running node serves as it is: what only a node can use is left aside, and said.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Dict, List, Tuple

import numpy as np

from glass_nav import params
from glass_nav.localization.glass_mcl import GlassMclParams
from glass_nav.params import ParamError

# Read by a node (ours or AMCL's), without a meaning for the replay of a log.
NODE_ONLY = frozenset("""
    bag_scan_period beam_skip_distance beam_skip_error_threshold beam_skip_threshold do_beamskip first_map_only
    force_update_after_initialpose force_update_after_set_map global_frame_id gui_publish_rate
    kld_err kld_z laser_lambda_short laser_likelihood_max_dist laser_max_range laser_min_range
    laser_model_type laser_z_max laser_z_short random_seed recovery_alpha_fast recovery_alpha_slow
    restore_defaults save_pose_rate selective_resampling std_warn_level_x std_warn_level_y
    std_warn_level_yaw tf_broadcast transform_tolerance transform_wait_s use_map_topic""".split())


@dataclass(frozen=True)
class StartParams:
    """Frames, and the start when neither the command nor a ground truth says it. Names and defaults: AMCL's."""
    odom_frame_id: str = "odom"
    base_frame_id: str = "base_link"
    initial_pose_x: float = 0.0            # [m]
    initial_pose_y: float = 0.0            # [m]
    initial_pose_a: float = 0.0            # [rad]
    initial_cov_xx: float = 0.25           # [m^2]
    initial_cov_yy: float = 0.25           # [m^2]
    initial_cov_aa: float = (math.pi / 12.0) ** 2  # [rad^2]

    @property
    def pose(self) -> np.ndarray:
        """map_from_base (3,)."""
        return np.array([self.initial_pose_x, self.initial_pose_y, self.initial_pose_a])

    @property
    def covariance(self) -> np.ndarray:
        """(3, 3) of x, y, yaw."""
        return np.diag([self.initial_cov_xx, self.initial_cov_yy, self.initial_cov_aa])


@dataclass(frozen=True)
class ReplayParams:
    """All that a file may set."""
    start: StartParams = field(default_factory=StartParams)
    mcl: GlassMclParams = field(default_factory=GlassMclParams)


def load(path: Path) -> "Tuple[ReplayParams, List[str]]":
    """The parameters of a yaml file, and the names in it that only a node uses.

    Raises:
        ParamError: no such file, no flat yaml, or a parameter that params.load() refuses.
    """
    import yaml

    try:
        mapping: Any = yaml.safe_load(path.read_text())
    except (OSError, UnicodeDecodeError) as err:
        reason = err.strerror if isinstance(err, OSError) and err.strerror else str(err)
        raise ParamError(f"{path}: cannot be read: {reason}") from err
    except yaml.YAMLError as err:
        raise ParamError(f"{path}: is no yaml: {' '.join(str(err).split())}") from err
    if mapping is None:
        mapping = {}
    if not isinstance(mapping, dict):
        raise ParamError(f"{path}: must hold names and values, got {type(mapping).__name__}")
    ours = params.names(ReplayParams)
    unused = [name for name in mapping if name in NODE_ONLY and name not in ours]
    kept: Dict[str, Any] = {name: value for name, value in mapping.items() if name not in unused}
    return params.load(ReplayParams, kept, str(path)), unused
