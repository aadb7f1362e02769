from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from glass_nav import params
from glass_nav.params import ParamError
from glass_nav.ros.driver.driver_params import DriverParams

CONFIG = Path(__file__).resolve().parents[4] / "config" / "driver.yaml"


def test_the_file_of_parameters_names_them_all_with_their_defaults():
    given = yaml.safe_load(CONFIG.read_text())
    assert given == params.as_mapping(DriverParams())
    assert params.load(DriverParams, given, "/driver") == DriverParams()


def test_the_radius_of_the_robot_is_that_of_base_graph_and_map():
    p = params.load(DriverParams, {"robot_radius_m": 0.3}, "/driver")
    assert (
        p.drive.edge.limits.robot_radius_m
        == p.drive.edge.graph.robot_radius_m
        == p.drive.edge.local_map.robot_radius_m
        == 0.3
    )


@pytest.mark.parametrize(
    "given, text",
    [
        ({"backend": "teb"}, "/driver: ~backend must be internal or move_base, got 'teb'"),
        ({"control_rate_hz": 0.5}, "/driver: ~control_rate_hz must be 1 to 200 Hz, got 0.5"),
        ({"seek_attempts": 0}, "/driver: ~seek_attempts must be >= 1, got 0"),
        ({"patience_s": 0.0}, "/driver: ~patience_s must be > 0 and finite, got 0.0"),
        (
            {"base_frame_id": "odom"},
            "/driver: ~odom_frame_id, ~base_frame_id and ~global_frame_id must differ, got 'odom', 'odom', 'map'",
        ),
        ({"max_speed_m_s": -1.0}, "/driver: ~max_speed_m_s must be > 0 and finite, got -1.0"),
        ({"seek": True}, "/driver: unknown parameter ~seek"),
    ],
)
def test_parameters_that_cannot_be_used_are_refused(given, text):
    with pytest.raises(ParamError) as caught:
        params.load(DriverParams, given, "/driver")
    assert str(caught.value).startswith(text)
