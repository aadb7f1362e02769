"""The view of rviz on all of a map."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from glass_nav.ros.tools import fitted_rviz
from glass_nav.world.grid_map import GridMap

CONFIG = (Path(__file__).parents[4] / "rviz" / "wakeup.rviz").read_text(encoding="utf-8")


def grid_map() -> GridMap:
    """Unknown but for 20 m x 5 m from (3, 2) on."""
    cells = np.full((200, 600), -1, np.int8)
    cells[40:140, 60:460] = 0
    return GridMap(cells, 0.05, np.zeros(3))


def test_all_that_the_map_knows_is_in_sight() -> None:
    scale, x_m, y_m = fitted_rviz.view_of(grid_map(), (1360, 590))
    assert (x_m, y_m) == (pytest.approx(13.0), pytest.approx(4.5))
    assert scale == pytest.approx(fitted_rviz.SHARE * 1000 / 20.0)


def test_the_configuration_differs_in_the_view_only() -> None:
    before, after = yaml.safe_load(CONFIG), yaml.safe_load(fitted_rviz.fitted(CONFIG, grid_map()))
    view = after["Visualization Manager"]["Views"].pop("Current")
    before["Visualization Manager"]["Views"].pop("Current")
    assert after == before
    assert (view["Target Frame"], view["X"], view["Class"]) == ("map", pytest.approx(13.0), "rviz/TopDownOrtho")


def test_a_map_that_knows_nothing_is_shown_as_a_whole() -> None:
    empty = GridMap(np.full((100, 200), -1, np.int8), 0.1, np.zeros(3))
    assert fitted_rviz.view_of(empty, (1000, 700))[1:] == (pytest.approx(10.0), pytest.approx(5.0))


@pytest.mark.parametrize(
    "config, message",
    [
        ("{}", "is no configuration of rviz with a view and a window"),
        ("3", "is no configuration of rviz with a view and a window"),
        (CONFIG.replace("rviz/TopDownOrtho", "rviz/Orbit"), "the view must be rviz/TopDownOrtho, got rviz/Orbit"),
    ],
)
def test_another_file_is_refused(config: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        fitted_rviz.fitted(config, grid_map())
