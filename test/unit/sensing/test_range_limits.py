"""A lidar whose driver sets no range_max: min(range_max, laser_max_range), else what its scans show."""

from __future__ import annotations

import numpy as np
import pytest
from made_transforms import MadeTransforms, raw_scan

from glass_nav.sensing.mounting import Mounting
from glass_nav.sensing.range_limits import RangeLimits
from glass_nav.sensing.scan import ScanError
from glass_nav.sensing.scan_placement import ScanPlacement
from glass_nav.sensing.scan_queue import ReadyScan, ScanQueue

RANGES_M = np.array([2.0, np.inf, 7.5, np.nan, 0.05])
FLOAT_MAX = float(np.finfo(np.float32).max)  # what the largest float becomes in a message


@pytest.mark.parametrize(
    "range_max_m, laser_max_range_m, limit_m",
    [
        pytest.param(np.inf, 25.0, 25.0, id="inf, a parameter"),
        pytest.param(FLOAT_MAX, 25.0, 25.0, id="the largest float, a parameter"),
        pytest.param(1e30, 25.0, 25.0, id="1e30, a parameter"),
        pytest.param(np.inf, 5.0, 5.0, id="a parameter below the longest range"),
        pytest.param(np.inf, -1.0, 7.51, id="inf alone"),
        pytest.param(FLOAT_MAX, -1.0, 7.51, id="the largest float alone"),
        pytest.param(501.0, -1.0, 7.51, id="farther than any lidar sees"),
        pytest.param(np.inf, 1e30, 7.51, id="a parameter that is no limit either"),
        pytest.param(30.0, -1.0, 30.0, id="a limit alone"),
        pytest.param(30.0, 25.0, 30.0, id="both: the filter takes the lower one"),
    ],
)
def test_the_limit_of_a_lidar(range_max_m, laser_max_range_m, limit_m):
    raw = raw_scan(range_max_m=range_max_m, ranges_m=RANGES_M)
    scan = ScanPlacement(MadeTransforms(), limits=RangeLimits(laser_max_range_m)).place(raw).scan
    assert scan.range_max_m == pytest.approx(limit_m)
    assert scan.ranges_m[2] == (7.5 if limit_m > 7.5 else np.inf)
    assert scan.limited(-1.0, laser_max_range_m).range_max_m == pytest.approx(
        min(limit_m, laser_max_range_m if laser_max_range_m > 0.0 else limit_m)
    )


def test_the_longest_range_of_each_lidar_is_remembered():
    transforms = MadeTransforms(front=Mounting(np.zeros(3)), rear=Mounting(np.zeros(3)))
    placement = ScanPlacement(transforms)

    def limit_m(lidar, ranges_m):
        return placement.place(raw_scan(lidar=lidar, range_max_m=np.inf, ranges_m=np.array(ranges_m))).scan.range_max_m

    assert limit_m("front", [3.0, 12.0]) == pytest.approx(12.01)
    assert limit_m("front", [3.0, np.inf]) == pytest.approx(12.01)
    assert limit_m("rear", [3.0, np.inf]) == pytest.approx(3.01)


@pytest.mark.parametrize("nothing", [np.inf, np.nan, 0.0, 65535.0, FLOAT_MAX])
def test_a_lidar_that_has_not_met_anything_yet_is_used(nothing):
    scan = ScanPlacement(MadeTransforms()).place(raw_scan(range_max_m=np.inf, ranges_m=np.full(5, nothing))).scan
    assert not scan.answered.any()
    assert scan.range_min_m < scan.range_max_m < 1.0


@pytest.mark.parametrize(
    "fields, text",
    [
        (dict(range_max_m=np.nan), "range_max must be finite and > 0 m, got nan"),
        (dict(range_max_m=-np.inf), "range_max must be finite and > 0 m, got -inf"),
        (dict(range_max_m=np.inf, range_min_m=np.inf), "range_min must be in [0, range_max = 2.01) m, got inf"),
        (dict(range_max_m=np.inf, range_min_m=-1.0), "range_min must be in [0, range_max = 2.01) m, got -1.0"),
        (dict(range_max_m=np.inf, range_min_m=np.nan), "range_min must be in [0, range_max = 2.01) m, got nan"),
    ],
)
def test_limits_that_are_wrong_are_refused_all_the_same(fields, text):
    with pytest.raises(ScanError) as err:
        ScanPlacement(MadeTransforms()).place(raw_scan(**fields))
    assert err.value.reason == text


def test_a_running_node_warns_of_each_such_lidar_once():
    said = []
    queue = ScanQueue(ScanPlacement(MadeTransforms()), 1.0, 0.0, lambda text, period_s: said.append((text, period_s)))
    queue.place(ReadyScan(raw_scan(range_max_m=np.inf)))
    assert said == [
        (
            "range_max of lidar 'laser' is inf m, which is no limit: the longest range seen so far is used instead; "
            "set range_max in its driver, or laser_max_range",
            np.inf,
        )
    ]
    queue.use(ScanPlacement(MadeTransforms(), limits=RangeLimits(25.0)), 1.0)
    queue.place(ReadyScan(raw_scan(range_max_m=np.inf)))
    assert len(said) == 1


def test_another_parameter_holds_from_the_next_scan_on():
    limits = RangeLimits()
    assert limits.range_max_m("laser", np.inf, 0.1, RANGES_M) == pytest.approx(7.51)
    limits.use(25.0)
    assert limits.range_max_m("laser", np.inf, 0.1, RANGES_M) == 25.0
    limits.use(-1.0)
    assert limits.range_max_m("laser", np.inf, 0.1, np.zeros(2)) == pytest.approx(7.51)
