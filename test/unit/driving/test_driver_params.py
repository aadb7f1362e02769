"""Rules of the driver that cannot be followed."""

from __future__ import annotations

import pytest

from glass_nav.driving.driver_params import DriverRules


@pytest.mark.parametrize(
    "given, text",
    [
        ({"seek_attempts": 0}, "~seek_attempts must be >= 1, got 0"),
        ({"control_rate_hz": 0.5}, "~control_rate_hz must be 1 to 200 Hz, got 0.5"),
        ({"patience_s": 0.0}, "~patience_s must be > 0 and finite, got 0.0"),
    ],
)
def test_rules_that_cannot_be_followed_are_refused(given, text):
    with pytest.raises(ValueError, match=f"^{text}$"):
        DriverRules(**given)
