"""Reports of the robot: what they may say, and the words for turns."""

from __future__ import annotations

import math
from typing import Any, Dict

import numpy as np
import pytest

from glass_nav.topology.observations import Meetpoint, ObservationError, Traversal, refuse_rank, turn_name


@pytest.mark.parametrize(
    "degree, names",
    [
        (1, ["U_TURN"]),
        (2, ["U_TURN", "FORWARD"]),
        (3, ["U_TURN", "LEFT", "RIGHT"]),
        (5, ["U_TURN", "LEFT", "RANK_2", "RANK_3", "RIGHT"]),
    ],
)
def test_clockwise_from_behind_comes_left_and_right_is_last(degree: int, names: "list[str]") -> None:
    assert [turn_name(rank, degree) for rank in range(degree)] == names


def test_a_rank_that_no_edge_has_is_refused() -> None:
    refuse_rank(2, 3)
    with pytest.raises(ObservationError) as refused:
        refuse_rank(-1, 3)
    assert str(refused.value) == "turn of rank -1: the meetpoint it left has degree 3, allowed 0 to 2"


def test_gaps_count_clockwise_from_the_edge_behind() -> None:
    # The way back behind the robot, one to its left, one straight on, one to its right.
    seen = Meetpoint(4, 1.0, bearings_rad=np.array([math.pi, math.pi / 2, 0.0, -math.pi / 2]))
    np.testing.assert_allclose(seen.gaps_rad, [0.0, math.pi / 2, math.pi, 1.5 * math.pi])
    assert Meetpoint(4, 1.0).gaps_rad.shape == (0,)


@pytest.mark.parametrize(
    "fields, line",
    [
        ({"degree": 0}, "degree must be >= 1, got 0"),
        ({"r_m": math.inf}, "r must be finite and > 0 m, got inf"),
        ({"sigma_r_m": -1.0}, "sigma_r must be finite and >= 0 m, got -1.0"),
        ({"bearings_rad": np.zeros(2)}, "3 edges need 3 bearings or none, got 2"),
        ({"bearings_rad": np.array([0.0, np.nan, 1.0])}, "bearings must be finite, got [0.0, nan, 1.0]"),
        (
            {"bearings_rad": np.array([0.0, 1.0, 2.0])},
            "bearings must run clockwise from the first, got [0.0, 1.0, 2.0]",
        ),
        ({"centre_m": np.array([np.nan, 0.0])}, "its place needs finite x and y"),
    ],
)
def test_a_meetpoint_that_cannot_be_is_refused(fields: Dict[str, Any], line: str) -> None:
    with pytest.raises(ObservationError) as refused:
        Meetpoint(**{"degree": 3, "r_m": 1.0, **fields})
    assert str(refused.value).startswith("meetpoint: ") and line in str(refused.value)


@pytest.mark.parametrize(
    "fields, line",
    [
        ({"rank": -1}, "rank must be >= 0, got -1"),
        ({"length_m": 0.0}, "length must be finite and > 0 m, or NaN, got 0.0"),
        ({"chord_m": -0.5}, "chord must be >= 0 m, or NaN, got -0.5"),
        ({"chord_m": math.inf}, "chord must be >= 0 m, or NaN, got inf"),
        ({"sigma_length_m": math.nan}, "sigma_length must be finite and >= 0 m, got nan"),
        ({"sigma_chord_m": -1.0}, "sigma_chord must be finite and >= 0 m, got -1.0"),
        ({"turn_rad": math.inf}, "turn must be finite, or NaN, got inf"),
        ({"chord_bearing_rad": -math.inf}, "chord_bearing must be finite, or NaN, got -inf"),
        ({"segments_m": np.zeros((2, 3))}, "segments must be finite rows of x1 y1 x2 y2, got shape (2, 3)"),
    ],
)
def test_a_traversal_that_cannot_be_is_refused(fields: Dict[str, Any], line: str) -> None:
    with pytest.raises(ObservationError) as refused:
        Traversal(**{"rank": 1, "length_m": 5.0, "chord_m": 4.0, **fields})
    assert str(refused.value).startswith("edge traversal: ") and line in str(refused.value)


def test_the_odometry_of_a_meetpoint_must_be_finite() -> None:
    with pytest.raises(ObservationError, match="meetpoint: its odometry needs finite x, y and yaw, got "):
        Meetpoint(3, 1.0, odom_from_base=np.array([0.0, np.nan, 0.0]))
