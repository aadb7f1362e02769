"""The node's parameters; the running node is in test/rostest/landmarks_node.test."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from glass_nav import params
from glass_nav.params import ParamError
from glass_nav.ros.landmarks.landmarks_node import LandmarksNodeParams, NodeParams

CONFIG = Path(__file__).resolve().parents[4] / "config" / "landmarks.yaml"


def load(**given):
    return params.load(LandmarksNodeParams, {"landmark_file": "tags.yaml", **given}, "/landmarks")


def test_the_file_of_parameters_names_them_all_with_their_defaults():
    given = yaml.safe_load(CONFIG.read_text())
    assert load(**given) == load() == LandmarksNodeParams(NodeParams("tags.yaml"))
    assert {"landmark_file", *given} == set(params.names(LandmarksNodeParams))


@pytest.mark.parametrize(
    "given, text",
    [
        ({"landmark_file": ""}, "~landmark_file must name a file of landmarks, got ''"),
        ({"method": "magic"}, "~method must be one of least_squares, document, got 'magic'"),
        ({"window_s": -1.0}, "~window_s must be >= 0 and finite, got -1.0"),
        (
            {"rescue_states": "LOST SAD"},
            "~rescue_states must be words of UNKNOWN, GLOBAL_SEARCH, LOCALIZED, UNCERTAIN, LOST, got 'SAD'",
        ),
        ({"odom_frame_id": "/"}, "~odom_frame_id must name a frame, got ''"),
        ({"max_misfit_chance": 0.0}, "~max_misfit_chance must be > 0 and < 1, got 0.0"),
        ({"bearing_drift_per_m": -0.1}, "~bearing_drift_per_m must be >= 0, got -0.1"),
    ],
)
def test_parameters_that_cannot_be_used_are_refused(given, text):
    with pytest.raises(ParamError) as caught:
        load(**given)
    assert str(caught.value) == f"/landmarks: {text}"


def test_no_states_are_no_rescue():
    assert load(rescue_states="").fixes.rescue_states.split() == []
