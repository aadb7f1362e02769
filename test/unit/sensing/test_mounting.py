"""A sensor is level, upright or upside down, or it is rejected."""

from __future__ import annotations

import math

import numpy as np
import pytest

from glass_nav.sensing.mounting import level_mounting
from glass_nav.sensing.scan import ScanError

PLACE = np.array([0.2, -0.1, 0.3])


@pytest.mark.parametrize("tilt_deg, upside_down", [(0.0, False), (19.0, False), (161.0, True), (180.0, True)])
def test_a_sensor_within_20_degrees_of_level_is_taken_upright_or_upside_down(tilt_deg, upside_down):
    mounting = level_mounting(PLACE, 0.4, math.cos(math.radians(tilt_deg)))
    assert mounting.upside_down == upside_down
    assert mounting.height_m == 0.4
    np.testing.assert_array_equal(mounting.base_from_laser, PLACE)


@pytest.mark.parametrize("tilt_deg, text", [(21.0, "21"), (90.0, "90"), (135.0, "45")])
def test_a_tilted_sensor_is_rejected_with_its_angle(tilt_deg, text):
    with pytest.raises(ScanError) as err:
        level_mounting(PLACE, 0.4, math.cos(math.radians(tilt_deg)))
    assert str(err.value) == (
        f"the laser is tilted by {text} degrees; level within 20 degrees is needed, upright or upside down"
    )
