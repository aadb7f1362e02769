"""What /diagnostics says in one sentence, and how loud."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.health import Level
from glass_nav.localization import health
from glass_nav.localization.beam_classification.surface_scan import SurfaceScan
from glass_nav.localization.beam_report import BeamReport
from glass_nav.localization.health import LocalizationHealth, Situation
from glass_nav.localization.localizer import BeamCases, Estimate
from glass_nav.sensing.scan import Scan
from glass_nav.sensing.scan_queue import ScanCounts
from glass_nav.world.grid_map import GridMap

OK, WARN, ERROR = Level.OK, Level.WARN, Level.ERROR
GRID = GridMap(np.array([[0, 100, -1], [0, 0, 100]], np.int8), 0.05, np.array([1.0, -2.0, 0.5]))


@pytest.fixture
def reporter():
    return LocalizationHealth(np.array([0.2, 0.2, 0.1]), ScanCounts())


def estimate(state="LOCALIZED", std=0.05, used_share=0.9, beams=100):
    case = np.ones(beams, np.uint8)
    case[: beams // 4] = 3
    cases = BeamCases(case, *(np.ones(beams),) * 3)
    surfaces = SurfaceScan(np.ones(beams), np.zeros(beams, bool), True)
    return Estimate(
        7,
        np.zeros(3),
        np.eye(3) * std**2,
        np.zeros(3),
        lambda: BeamReport(cases, used_share, lambda: surfaces),
        np.zeros((5, 3)),
        state,
        "why",
        True,
        confidence=0.8,
    )


def scan(answered=100, beams=100):
    ranges_m = np.where(np.arange(beams) < answered, 1.0, np.inf)
    return Scan(7, ranges_m, np.linspace(-1.0, 1.0, beams), 0.1, 10.0, np.zeros(3))


def said(reporter, part, **changes):
    """Level and sentence of one entry."""
    values = dict(
        estimate=estimate(),
        scan=scan(),
        trouble=None,
        grid_map=GRID,
        map_origin="service /static_map",
        scan_period_s=0.1,
        lidars=["laser"],
    )
    entry = reporter.report(Situation(**{**values, **changes}))[part]
    return entry.level, entry.message, entry.values


@pytest.mark.parametrize(
    "given, level, text",
    [
        (estimate(), OK, "LOCALIZED: why"),
        (estimate(std=0.3), WARN, "LOCALIZED: why; standard deviation of x, y, yaw above ~std_warn_level"),
        (estimate("UNCERTAIN"), WARN, "UNCERTAIN: why"),
        (estimate("LOST"), ERROR, "LOST: why"),
        (None, WARN, "no pose yet"),
    ],
)
def test_the_pose_says_its_state(reporter, given, level, text):
    assert said(reporter, "pose", estimate=given)[:2] == (level, text)


def test_scans_say_where_they_went_since_the_last_report(reporter):
    counts = reporter._counts
    counts.received, counts.used, counts.superseded = 12, 10, 2
    assert said(reporter, "scans")[:2] == (OK, "10 scans used since the last report, 2 passed over for newer ones")
    counts.used += 3
    counts.refused += 1
    counts.dropped_no_transform += 2
    level, text, values = said(reporter, "scans")
    assert (level, text) == (WARN, "3 scans used since the last report, 1 refused, 2 dropped without a transform")
    assert (values["used"], values["lidars"]) == (13, "laser")
    assert said(reporter, "scans", trouble="no scan on /scan")[:2] == (ERROR, "no scan on /scan")


def test_beams_say_how_many_are_explained_and_which_case_they_are(reporter):
    level, text, values = said(reporter, "beams")
    assert (level, text) == (OK, "100 of 100 beams returned, the map explains 90% of those it covers")
    assert list(values.items()) == [
        ("1 first surface", "75.0%"),
        ("2 mirrored", "0.0%"),
        ("3 behind one pane", "25.0%"),
        ("4 behind two panes", "0.0%"),
        ("0 uncertain", "0.0%"),
    ]
    few = "only 12 of 100 beams returned: odometry leads"
    assert said(reporter, "beams", scan=scan(answered=12))[:2] == (WARN, few)
    assert said(reporter, "beams", scan=None)[:2] == (OK, "no scan used yet")


@pytest.mark.parametrize(
    "wall_s, period_s, level, text",
    [
        ([0.02, 0.04], 0.1, OK, "an update takes 30 ms, a scan comes every 100 ms"),
        ([0.2], 0.1, WARN, "an update takes 200 ms, a scan comes every 100 ms: not all of them are used"),
        ([0.2], None, OK, "an update takes 200 ms"),
        ([], 0.1, OK, "no update since the last report"),
    ],
)
def test_the_time_of_updates_is_told_against_the_period_of_scans(reporter, wall_s, period_s, level, text):
    for each_s in wall_s:
        reporter.add_update(0.5 * each_s, each_s)
    assert said(reporter, "timing", scan_period_s=period_s)[:2] == (level, text)
    assert said(reporter, "timing")[1] == "no update since the last report"


def test_the_map_says_what_it_is(reporter):
    level, text, values = said(reporter, "map")
    assert (level, text) == (OK, "3 x 2 cells of 0.05 m from service /static_map")
    assert values == {
        "digest": GRID.digest,
        "origin": "x 1.000 m, y -2.000 m, yaw 0.5000 rad",
        "occupied": 2,
        "free": 3,
    }
    assert said(reporter, "map", grid_map=None, map_origin="no map: there is no service /static_map")[:2] == (
        ERROR,
        "no map: there is no service /static_map",
    )


def test_glass_that_the_map_lacks_is_a_warning_about_the_map(reporter):
    level, text, _ = said(reporter, "map", lacking_glass="the map lacks 3.0 m of glass (2 panes); draw it in")
    assert level == WARN
    assert text.endswith("from service /static_map; the map lacks 3.0 m of glass (2 panes); draw it in")


def test_a_report_has_all_entries_before_there_is_anything_to_report(reporter):
    nothing = Situation(None, None, None, None, "no map yet", None, [])
    assert tuple(reporter.report(nothing)) == health.ENTRIES
