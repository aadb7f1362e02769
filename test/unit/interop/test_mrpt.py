"""Our maps, scans and poses as MRPT's and back; against the real bindings wherever they are, else against stand-ins."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from glass_nav.interop import mrpt as interop
from glass_nav.sensing.raycast import RayCaster
from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import GridMap

REPO = Path(__file__).parents[3]


class Grid:
    """COccupancyGridMap2D: chances to be free, by column and row."""

    def __init__(self, x_min, x_max, y_min, y_max, cell_m):
        self._place = x_min, y_min, cell_m
        self._free = np.full((round((y_max - y_min) / cell_m), round((x_max - x_min) / cell_m)), 0.5, np.float32)

    def setCell(self, x, y, value):
        self._free[y, x] = value

    def getCell(self, x, y):
        return float(self._free[y, x])

    getXMin = property(lambda self: lambda: self._place[0])
    getYMin = property(lambda self: lambda: self._place[1])
    getResolution = property(lambda self: lambda: self._place[2])
    getSizeX = property(lambda self: lambda: self._free.shape[1])
    getSizeY = property(lambda self: lambda: self._free.shape[0])


class RangeScan:
    """CObservation2DRangeScan."""

    def resizeScan(self, count):
        self._ranges, self._valid = [0.0] * count, [False] * count

    def getScanSize(self):
        return len(self._ranges)

    def setScanRange(self, index, value):
        self._ranges[index] = value

    def getScanRange(self, index):
        return self._ranges[index]

    def setScanRangeValidity(self, index, valid):
        self._valid[index] = valid

    def getScanRangeValidity(self, index):
        return self._valid[index]


def pose_2d(x, y, phi):
    return SimpleNamespace(x=lambda: x, y=lambda: y, phi=lambda: phi)  # MRPT 2


def pose_3d(x, y, z, yaw, pitch, roll):
    return SimpleNamespace(x=x, y=y, yaw=yaw)  # MRPT 3


STAND_IN = SimpleNamespace(
    maps=SimpleNamespace(COccupancyGridMap2D=Grid),
    obs=SimpleNamespace(CObservation2DRangeScan=RangeScan),
    poses=SimpleNamespace(CPose2D=pose_2d, CPose3D=pose_3d),
)


def stand_in(monkeypatch):
    package, module = ModuleType("mrpt"), ModuleType("mrpt.pymrpt")
    module.mrpt = STAND_IN
    monkeypatch.setitem(sys.modules, "mrpt", package)
    monkeypatch.setitem(sys.modules, "mrpt.pymrpt", module)


@pytest.fixture(params=["stand-in", "mrpt.pymrpt"])
def bindings(request, monkeypatch):
    if request.param == "stand-in":
        stand_in(monkeypatch)
    else:
        pytest.importorskip("mrpt.pymrpt", reason="the official bindings are not installed")
    return interop.bindings()


def room():
    cells = np.zeros((60, 80), np.int8)
    cells[0], cells[-1], cells[:, 0], cells[:, -1], cells[20:26, 50:60], cells[40:50, 10:14] = (
        100,
        100,
        100,
        100,
        100,
        -1,
    )
    return GridMap(cells, 0.05, np.array([-1.0, 2.0, 0.0]))


def test_a_map_comes_back_cell_by_cell(bindings):
    ours = room()
    back = interop.grid_from_mrpt(interop.grid_to_mrpt(ours))
    np.testing.assert_array_equal(back.occupancy, ours.occupancy)
    np.testing.assert_allclose(back.map_from_grid, ours.map_from_grid, atol=1e-6)
    assert back.resolution_m == pytest.approx(ours.resolution_m)
    with pytest.raises(ValueError, match="a map of MRPT cannot be turned, got an origin with yaw 0.5 rad"):
        interop.grid_to_mrpt(GridMap(ours.occupancy, 0.05, np.array([0.0, 0.0, 0.5])))


@pytest.mark.parametrize("first_rad, last_rad", [(-2.0, 2.0), (-0.5, 1.5), (1.0, -2.0)])
def test_a_scan_comes_back_with_its_points_where_they_were(bindings, first_rad, last_rad):
    ranges_m = np.linspace(1.0, 6.0, 31)
    ranges_m[[3, 7]] = np.inf, np.nan
    ours = Scan(5, ranges_m, np.linspace(first_rad, last_rad, 31), 0.1, 20.0, np.array([0.2, -0.1, 0.3]))
    back = interop.scan_from_mrpt(interop.scan_to_mrpt(ours), 5, 0.1)
    np.testing.assert_allclose(back.points_in_base(), ours.points_in_base(), atol=1e-5)
    assert back.range_max_m == pytest.approx(20.0) and np.isinf(back.ranges_m[[3, 7]]).all()


def test_a_scan_with_gaps_is_refused(bindings):
    uneven = Scan(5, np.ones(3), np.array([0.0, 0.1, 0.5]), 0.1, 20.0, np.zeros(3))
    with pytest.raises(ValueError, match="two or more evenly spaced beams"):
        interop.scan_to_mrpt(uneven)


def test_a_pose_comes_back(bindings):
    pose = np.array([1.5, -2.0, 0.7])
    np.testing.assert_allclose(interop.pose_from_mrpt(interop.pose_to_mrpt(pose)), pose)


def test_who_lacks_the_bindings_is_told_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "mrpt.pymrpt", None)  # as if it could not be found
    with pytest.raises(ImportError, match=r"apt install python3-pymrpt \(Debian 13\) or ros-noetic-python-mrpt"):
        interop.bindings()


@pytest.mark.parametrize("backend", ["exact", "mrpt"])
def test_mrpt_simulates_the_scan_that_we_cast(backend):
    """Their scan holds samples up to one step late."""
    pytest.importorskip("mrpt.pymrpt", reason="the official bindings are not installed")
    mrpt, world, pose = interop.bindings(), room(), np.array([1.0, 3.5, 0.3])
    observation = mrpt.obs.CObservation2DRangeScan()
    observation.aperture, observation.maxRange, observation.rightToLeft = 2.0 * np.pi, 20.0, True
    interop.grid_to_mrpt(world).laserScanSimulator(observation, interop.pose_to_mrpt(pose), 0.5, 181, 0.0, 1, 0.0)
    theirs = interop.scan_from_mrpt(observation, 0)
    ours_m = RayCaster(world, backend).cast(pose[None], theirs.angles_rad, 16.0)[0]
    assert np.median(np.abs(theirs.ranges_m - ours_m)) < 0.05


def test_the_tutorial_prints_what_it_says(capsys, monkeypatch):
    pytest.importorskip("mrpt.pymrpt", reason="the official bindings are not installed")
    monkeypatch.chdir(REPO)
    (code,) = re.findall(r"```python\n(.*?)```", (REPO / "doc" / "mrpt.md").read_text(encoding="utf-8"), re.DOTALL)
    exec(code, {})
    beams, median_m = capsys.readouterr().out.split()
    assert int(beams) == 177 and float(median_m) == pytest.approx(0.024, abs=0.0005)
