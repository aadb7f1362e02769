"""Names and values -> a dataclass, or one line that says what is wrong."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Tuple

import pytest

from glass_nav import params
from glass_nav.params import ParamError


@dataclass(frozen=True)
class Wheel:
    wheel_radius_m: float = 0.1
    wheel_count: int = 2

    def __post_init__(self) -> None:
        if not self.wheel_radius_m > 0.0:
            raise ValueError(f"~wheel_radius_m must be > 0 m, got {self.wheel_radius_m}")


@dataclass(frozen=True)
class Cart:
    name: str = "cart"
    loaded: bool = False
    wheel: Wheel = field(default_factory=Wheel)

    def __post_init__(self) -> None:
        if self.loaded and self.wheel.wheel_count < 2:
            raise ParamError("a loaded cart needs 2 wheels")


def test_nothing_given_leaves_the_defaults():
    assert params.load(Cart, {}, "/node") == Cart()


def test_values_reach_the_struct_that_has_their_name():
    given = {"name": "tub", "loaded": True, "wheel_radius_m": 0.25, "wheel_count": 4}
    assert params.load(Cart, given, "/node") == Cart("tub", True, Wheel(0.25, 4))


def test_names_are_flat():
    assert params.names(Cart) == ["name", "loaded", "wheel_radius_m", "wheel_count"]


@pytest.mark.parametrize("cart", [Cart(), Cart("tub", True, Wheel(0.25, 4))])
def test_what_is_written_down_loads_again(cart):
    assert params.load(Cart, params.as_mapping(cart), "/node") == cart


def test_a_whole_number_is_a_length():
    radius_m = params.load(Cart, {"wheel_radius_m": 1}, "/node").wheel.wheel_radius_m
    assert radius_m == 1.0 and isinstance(radius_m, float)


@pytest.mark.parametrize(
    "given, text",
    [
        ({"wheel_raduis_m": 0.2}, "/node: unknown parameter ~wheel_raduis_m; did you mean ~wheel_radius_m?"),
        ({"zzz": 1}, "/node: unknown parameter ~zzz"),
        ({7: 1}, "/node: unknown parameter ~7"),
        ({"loaded": "0"}, "/node: ~loaded must be bool, got '0'"),
        ({"loaded": 1}, "/node: ~loaded must be bool, got 1"),
        ({"wheel_count": True}, "/node: ~wheel_count must be int, got True"),
        ({"wheel_count": 2.5}, "/node: ~wheel_count must be int, got 2.5"),
        ({"wheel_radius_m": True}, "/node: ~wheel_radius_m must be float, got True"),
        ({"wheel_radius_m": "0.1"}, "/node: ~wheel_radius_m must be float, got '0.1'"),
        ({"wheel_radius_m": None}, "/node: ~wheel_radius_m must be float, got None"),
        ({"name": 3}, "/node: ~name must be str, got 3"),
        ({"wheel_radius_m": -1.0}, "/node: ~wheel_radius_m must be > 0 m, got -1.0"),
        ({"loaded": True, "wheel_count": 1}, "a loaded cart needs 2 wheels"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(given, text):
    with pytest.raises(ParamError) as err:
        params.load(Cart, given, "/node")
    assert str(err.value) == text


def test_a_struct_is_not_a_value():
    with pytest.raises(ParamError, match="^/node: unknown parameter ~wheel(;|$)"):
        params.load(Cart, {"wheel": {}}, "/node")


@dataclass(frozen=True)
class Train:
    carts: Tuple[str, ...] = ()
    count: int = 0


def test_a_list_of_names_is_a_tuple_and_writes_down_as_a_list():
    train = params.load(Train, {"carts": ["a", "b"]}, "/node")
    assert train.carts == ("a", "b")
    assert params.as_mapping(train) == {"carts": ["a", "b"], "count": 0}


def test_a_whole_float_is_a_count():
    assert type(params.load(Train, {"count": 3.0}, "/node").count) is int


@pytest.mark.parametrize(
    "given, text",
    [
        ({"carts": "a"}, "/node: ~carts must be a list of str, got 'a'"),
        ({"carts": ["a", 1]}, "/node: ~carts must be a list of str, got ['a', 1]"),
        ({"count": 3.5}, "/node: ~count must be int, got 3.5"),
    ],
)
def test_other_lists_and_counts_are_refused(given, text):
    with pytest.raises(ParamError) as err:
        params.load(Train, given, "/node")
    assert str(err.value) == text
