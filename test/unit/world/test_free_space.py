"""The free space of a map, packed: what is counted, and that nothing is lost."""

import numpy as np
import pytest

from glass_nav.world.free_space import FreeSpace
from glass_nav.world.grid_map import GridMap


def random_map(seed: int, shape=(13, 21), x_m: float = 1.0) -> GridMap:
    rng = np.random.default_rng(seed)
    return GridMap(rng.choice(np.array([-1, 0, 100], np.int8), shape), 0.05, np.array([x_m, 2.0, 0.0]))


def test_every_cell_that_is_free_in_one_map_only_counts():
    first, second = random_map(1), random_map(2)
    space = FreeSpace.of(first)
    assert space.free_cells == first.free.sum()
    assert space.cells_that_differ(first) == 0
    assert space.cells_that_differ(second) == (first.free != second.free).sum()


@pytest.mark.parametrize("other", [random_map(1, x_m=1.05), random_map(1, (21, 13))])
def test_cells_elsewhere_are_not_counted(other):
    assert FreeSpace.of(random_map(1)).cells_that_differ(other) is None


def test_text_keeps_every_cell():
    space = FreeSpace.of(random_map(3))
    assert FreeSpace.from_text(space.place, space.text) == space


@pytest.mark.parametrize(
    "place, text, message",
    [
        ("2 x 0.05", "eJwDAAAAAAE=", "the place must begin with rows and columns, got '2 x 0.05'"),
        ("8 8 0.05", "eJwDAAAAAAE=", "8 x 8 cells need 8 bytes, got 0"),
        ("8 8 0.05", "*", "cells must be packed by zlib, in base64: "),
        ("8 8 0.05", "AAAA", "cells must be packed by zlib, in base64: "),
    ],
)
def test_what_cannot_be_the_cells_is_refused(place, text, message):
    with pytest.raises(ValueError) as refused:
        FreeSpace.from_text(place, text)
    assert str(refused.value).startswith(message)
