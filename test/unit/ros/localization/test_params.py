"""The node's parameters: AMCL's names and defaults, and one clear line for what cannot be used."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from glass_nav import amcl_parameters
from glass_nav.params import as_mapping
from glass_nav.ros.localization.params import (
    LocalizationParams,
    ParamError,
    as_amcl_reads,
    changeable,
    changed,
    localization_params,
    without_unknown,
)

REPO = Path(__file__).parents[4]

# AMCL 1.17.3, by its documentation; what the node takes beyond it has no such default.
AMCL_DEFAULTS = {
    "odom_frame_id": "odom",
    "base_frame_id": "base_link",
    "global_frame_id": "map",
    "tf_broadcast": True,
    "transform_tolerance": 0.1,
    "use_map_topic": False,
    "first_map_only": False,
    "initial_pose_x": 0.0,
    "initial_pose_y": 0.0,
    "initial_pose_a": 0.0,
    "initial_cov_xx": 0.25,
    "initial_cov_yy": 0.25,
    "initial_cov_aa": (math.pi / 12) ** 2,
    "gui_publish_rate": -1.0,
    "save_pose_rate": 0.5,
    "laser_min_range": -1.0,
    "laser_max_range": -1.0,
    "force_update_after_initialpose": False,
    "force_update_after_set_map": False,
    "std_warn_level_x": 0.2,
    "std_warn_level_y": 0.2,
    "std_warn_level_yaw": 0.1,
}


def test_the_nodes_defaults_are_those_of_amcl():
    p, unused = localization_params({}, "/node")
    values = as_mapping(p)
    assert {name: values[name] for name in AMCL_DEFAULTS} == AMCL_DEFAULTS
    assert unused == []


def test_the_file_shows_every_parameter_with_its_default():
    given = yaml.safe_load((REPO / "config" / "localization.yaml").read_text(encoding="utf-8"))
    p, unused = localization_params(given, "config/localization.yaml")
    assert unused == []
    assert as_mapping(p) == as_mapping(LocalizationParams())
    assert sorted(given) == sorted(as_mapping(p))


def test_parameters_of_amcl_that_mean_nothing_here_are_taken_and_named():
    given = {"laser_likelihood_max_dist": 2.0, "do_beamskip": False, "initial_pose_x": 3, "laser_z_short": 0.1}
    p, unused = localization_params(given, "/amcl")
    assert unused == ["do_beamskip", "laser_likelihood_max_dist", "laser_z_short"]
    assert p.start.initial_pose_x == 3.0
    assert isinstance(p.start.initial_pose_x, float)


WRONG = {
    bool: (1, 0, "true", 1.0, []),
    int: ("100", True, [1], {}),
    float: ("0.5*0.5", "0.5", True, [1.0]),
    str: (1, 2.0),
}


@pytest.mark.parametrize(
    "name", sorted(set(as_mapping(LocalizationParams())) - {"scan_topics", "wheel_topics", "wheel_joints"})
)
def test_a_value_of_another_type_is_ignored_as_amcl_and_refused_otherwise(name):
    default = as_mapping(LocalizationParams())[name]
    for value in WRONG[type(default)]:
        kept, lines = as_amcl_reads({name: value}, "/amcl")
        assert kept == {}
        assert lines == [
            f"/amcl: ~{name} must be {type(default).__name__}, got {value!r}; not used, as by amcl: the default is "
            f"{default!r}"
        ]
        with pytest.raises(ParamError, match=f"^/node: ~{name} must be "):
            localization_params({name: value}, "/node")


def test_what_amcl_reads_is_left_as_it_is():
    given = {
        "update_min_d": 1,
        "max_particles": 300.0,
        "odom_frame_id": "/odom",
        "laser_z_short": "?",
        "tf_broadcast": False,
    }
    assert as_amcl_reads(given, "/amcl") == (given, [])


@pytest.mark.parametrize(
    "given, taken, said",
    [
        ({"max_particles": 1500.6}, {"max_particles": 1501}, "rounded to 1501, as by amcl"),
        ({"initial_pose_x": math.nan}, {}, "not used, as by amcl: the default is 0.0"),
        ({"odom_model_type": "ackermann"}, {"odom_model_type": "diff"}, "got 'ackermann'; diff, as by amcl"),
    ],
)
def test_amcls_answers_to_other_odd_values(given, taken, said):
    kept, (line,) = as_amcl_reads(given, "/amcl")
    assert kept == taken and line.endswith(said)
    assert localization_params(kept, "/amcl")


def test_all_of_amcls_parameters_are_known_at_once():
    p, unused = localization_params(
        {name: None for name in amcl_parameters.NAMES if name not in as_mapping(LocalizationParams())}, "/amcl"
    )
    assert p == LocalizationParams()
    assert "kld_err" in unused or "kld_err" in as_mapping(p)


@pytest.mark.parametrize(
    "given, text",
    [
        ({"min_particle": 3}, "/n: unknown parameter ~min_particle; did you mean ~min_particles?"),
        ({"polish_with_segments": True}, "/n: unknown parameter ~polish_with_segments"),  # removed
        ({"odom_frame": "odom"}, "did you mean ~odom_frame_id?"),
        ({"tf_broadcast": 1}, "/n: ~tf_broadcast must be bool, got 1"),
        ({"save_pose_rate": "0.5"}, "/n: ~save_pose_rate must be float, got '0.5'"),
        ({"random_seed": 1.5}, "/n: ~random_seed must be int, got 1.5"),
        ({"initial_pose_x": math.nan}, "/n: ~initial_pose_x must be finite, got nan"),
        ({"initial_cov_aa": -0.1}, "/n: ~initial_cov_aa must be finite and >= 0, got -0.1"),
        ({"transform_tolerance": -1}, "/n: ~transform_tolerance must be in [0, 100], got -1.0"),
        ({"laser_max_range": 0}, "/n: ~laser_max_range must be above 0 and ~laser_min_range"),
        ({"laser_max_range": 2.0, "laser_min_range": 2.0}, "or < 0 for the scan's own, got 2.0"),
        ({"base_frame_id": ""}, "/n: ~base_frame_id must name a frame, got ''"),
        ({"odom_frame_id": "/map"}, "must differ, got 'map', 'base_link', 'map'"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(given, text):
    with pytest.raises(ParamError) as error:
        localization_params(given, "/n")
    assert text in str(error.value)
    assert "\n" not in str(error.value)


def test_frames_of_old_launch_files_lose_their_slash():
    p, _ = localization_params({"odom_frame_id": "/odom", "global_frame_id": "/map"}, "/n")
    assert (p.node.odom_frame_id, p.node.global_frame_id) == ("odom", "map")


def test_the_same_seed_gives_the_same_numbers_and_a_negative_one_new_ones():
    fixed, _ = localization_params({"random_seed": 7}, "/n")
    assert np.array_equal(fixed.rules.rng.random(5), fixed.rules.rng.random(5))
    free, _ = localization_params({"random_seed": -1}, "/n")
    assert not np.array_equal(free.rules.rng.random(5), free.rules.rng.random(5))


def test_the_start_is_given_as_pose_and_covariance():
    p, _ = localization_params({"initial_pose_x": 1, "initial_pose_a": 0.5, "initial_cov_yy": 4.0}, "/n")
    assert p.start.pose.tolist() == [1.0, 0.0, 0.5]
    assert np.diag(p.start.covariance)[1] == 4.0


def test_names_that_nobody_knows_are_taken_off_and_reported():
    ours, lines = without_unknown({"receive_map_topic": True, "max_particles": 5, "laser_z_short": 0.1}, "/amcl")
    assert ours == {"max_particles": 5, "laser_z_short": 0.1}
    assert lines == ["/amcl: unknown parameter ~receive_map_topic; did you mean ~use_map_topic?; not used, as by amcl"]


def test_all_parameters_of_the_filter_may_change_and_no_frame():
    p = LocalizationParams()
    values = changeable(p)
    assert set(as_mapping(p.localizer)) <= set(values)
    assert {"transform_tolerance", "tf_broadcast"} <= set(values)
    assert not {"odom_frame_id", "scan_topics", "random_seed", "initial_pose_x"} & set(values)


def test_changed_values_reach_their_struct_and_the_rest_stays():
    before, _ = localization_params({"odom_frame_id": "o", "max_particles": 100}, "/n")
    after = changed(before, {"laser_z_hit": 0.5, "transform_tolerance": 0.3}, "/n")
    assert (after.localizer.mixture.laser_z_hit, after.node.transform_tolerance) == (0.5, 0.3)
    assert (after.node.odom_frame_id, after.localizer.count) == ("o", before.localizer.count)
    with pytest.raises(ParamError, match="/n: ~laser_z_hit must be > 0, got 0.0"):
        changed(before, {"laser_z_hit": 0.0}, "/n")


@pytest.mark.parametrize(
    "topics, text",
    [
        (["a", "a"], "~scan_topics must name each topic once, got ['a', 'a']"),
        (["a", ""], "~scan_topics must name each topic once, got ['a', '']"),
        ("a", "~scan_topics must be a list of str, got 'a'"),
    ],
)
def test_topics_of_lidars_are_names(topics, text):
    with pytest.raises(ParamError) as error:
        localization_params({"scan_topics": topics}, "/n")
    assert str(error.value) == f"/n: {text}"
