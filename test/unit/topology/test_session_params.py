"""The parameters of a search session: what is refused."""

from __future__ import annotations

from typing import Any

import pytest

from glass_nav.topology.session_params import SessionParams


@pytest.mark.parametrize(
    "fields, line",
    [
        ({"listed_candidates": 0}, "~listed_candidates must be >= 1, got 0"),
        ({"pairing_tolerance_s": 0.0}, "~pairing_tolerance_s must be finite and > 0, got 0.0"),
        ({"pairing_tolerance_s": float("inf")}, "~pairing_tolerance_s must be finite and > 0, got inf"),
        ({"visits_file": "visits.yaml"}, "~visits_file must be a .json or a .npz, got 'visits.yaml'"),
    ],
)
def test_parameters_that_mean_nothing_are_refused(fields: Any, line: str) -> None:
    with pytest.raises(ValueError) as refused:
        SessionParams(**fields)
    assert str(refused.value) == line
