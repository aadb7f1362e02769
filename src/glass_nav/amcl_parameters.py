"""Every parameter that AMCL 1.17 reads.

Those that no dataclass of ours has are accepted where a launch or parameter file names them, and not
used; so files written for amcl load.
"""

from __future__ import annotations

from typing import Any, Callable, Dict, List, Mapping, Tuple

from glass_nav import params

NAMES = frozenset(
    """
    base_frame_id bag_scan_period beam_skip_distance beam_skip_error_threshold beam_skip_threshold do_beamskip
    first_map_only force_update_after_initialpose force_update_after_set_map global_frame_id
    gui_publish_rate initial_cov_aa initial_cov_xx initial_cov_yy initial_pose_a initial_pose_x
    initial_pose_y kld_err kld_z laser_lambda_short laser_likelihood_max_dist laser_max_beams
    laser_max_range laser_min_range laser_model_type laser_sigma_hit laser_z_hit laser_z_max
    laser_z_rand laser_z_short max_particles min_particles odom_alpha1 odom_alpha2 odom_alpha3
    odom_alpha4 odom_alpha5 odom_frame_id odom_model_type recovery_alpha_fast recovery_alpha_slow
    resample_interval restore_defaults save_pose_rate selective_resampling std_warn_level_x
    std_warn_level_y std_warn_level_yaw tf_broadcast transform_tolerance update_min_a update_min_d
    use_map_topic""".split()
)

# Ours that is left to its default, the parameter of AMCL that goes before it, and which of the two holds.
_GIVES_WAY: "Tuple[Tuple[str, str, Callable[[Any, Any], Any]], ...]" = (
    ("min_particles", "max_particles", min),
    ("max_particles", "min_particles", max),
    ("laser_sigma_hit_max", "laser_sigma_hit", max),
)


def adapted(mapping: Mapping[str, Any], cls: type) -> Dict[str, Any]:
    """The mapping, with those defaults of cls that a file written for amcl would contradict without naming them.

    Two values that are both in the mapping are left as they are: to refuse them is the dataclass's business.

    Args:
        mapping: flat names -> values.
        cls: dataclass that params.load() will fill.
    """
    defaults = params.as_mapping(cls())
    changed = dict(mapping)
    for ours, theirs, which in _GIVES_WAY:
        given = mapping.get(theirs)
        if ours not in mapping and ours in defaults and type(given) in (int, float):
            changed[ours] = which(defaults[ours], given)
    return changed


def without_unused(
    mapping: Mapping[str, Any], cls: type, also_unused: "frozenset[str]" = frozenset()
) -> "Tuple[Dict[str, Any], List[str]]":
    """The entries of the mapping that the dataclass cls has, and the sorted names of the others.

    Args:
        mapping: flat names -> values.
        cls: dataclass that params.load() will fill.
        also_unused: names beside AMCL's that are known and mean nothing to cls.
    """
    unused = sorted((NAMES | also_unused).intersection(mapping).difference(params.names(cls)))
    return {name: value for name, value in mapping.items() if name not in unused}, unused
