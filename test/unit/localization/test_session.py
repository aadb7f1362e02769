"""What the localization node decides. The localizer is stood in for: what it works out is tested beside it."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np
import pytest

from glass_nav.localization import method
from glass_nav.localization import session as session_module
from glass_nav.localization.beam_classification.glass_map import GlassEvidence, GlassMap
from glass_nav.localization.initial_pose import PoseGuess, StartPose, StartRules
from glass_nav.localization.localizer import Estimate
from glass_nav.localization.localizer_params import LocalizerParams
from glass_nav.localization.panes_memory import PanesFilePath
from glass_nav.localization.saved_pose import PoseFile, SavedPose, save
from glass_nav.localization.session import Inputs, LocalizationSession, SessionParams
from glass_nav.sensing.scan import Scan
from glass_nav.vocabulary import LocalizationState
from glass_nav.world.grid_map import GridMap
from glass_nav.world.pane import Pane

GRID = GridMap(np.zeros((100, 100), np.int8), 0.1, np.zeros(3))
OTHER_GRID = GridMap(np.eye(100, dtype=np.int8) * 100, 0.1, np.zeros(3))
COVARIANCE = np.diag([0.04, 0.04, 0.01])
SCAN = Scan(2_000_000_000, np.ones(3), np.array([0.0, 0.1, 0.2]), 0.1, 10.0, np.zeros(3))


class FakeLocalizer:
    """Writes down what it is told, and answers each scan with an estimate of that state."""

    def __init__(self, params, grid_map, rng) -> None:
        self.told = []
        self.first_number = rng.random()
        self.pose = np.array([1.0, 2.0, 0.5])
        self.unmapped_panes = self.found_panes = ()
        self.glass_map = GlassMap(grid_map, GlassEvidence())

    def remember(self, panes, glass) -> None:
        self.unmapped_panes = self.found_panes = panes

    def set_pose(self, pose, covariance) -> None:
        self.told.append(("pose", *np.round(pose, 6)))

    def scatter(self, area=None) -> None:
        if area is not None and len(area) < 3:
            raise ValueError("no room")
        self.told.append(("scatter", None if area is None else len(area)))

    def set_map(self, grid_map) -> None:
        self.told.append(("map", grid_map.digest))

    def request_update(self) -> None:
        self.told.append("update")

    def reconfigure(self, params) -> None:
        self.told.append("parameters")

    def update(self, scan, odom_from_base):
        return Estimate(
            scan.stamp_ns,
            self.pose,
            COVARIANCE,
            np.zeros(3),
            no_beams,
            np.zeros((1, 3)),
            "LOCALIZED",
            "why",
            True,
            confidence=0.9,
        )


def no_beams():
    raise AssertionError("nobody looks at the beams")


def odometry_at(stamp_ns):
    if stamp_ns == 13:
        raise ValueError("too long ago")
    return np.array([1e-9 * stamp_ns, 0.0, 0.0])  # 1 m/s


class Bench:
    """A session with what it called back."""

    def __init__(self, simulated=False, pose_file="", panes_file="", **rules) -> None:
        self.starts_over = 0
        self.params = SessionParams(
            LocalizerParams(),
            StartPose(initial_pose_x=3.0),
            StartRules(**rules),
            PoseFile(pose_file=str(pose_file)),
            PanesFilePath(panes_file=str(panes_file)),
        )
        self.session = LocalizationSession(self.params, odometry_at, simulated, 10.0, self._count)

    def _count(self) -> None:
        self.starts_over += 1

    @property
    def told(self):
        return self.session.localizer.told

    def scan(self, scan=SCAN, now_s=11.0):
        """As the node does with each scan."""
        self.session.start_at_given_pose(scan.stamp_ns, odometry_at(scan.stamp_ns), now_s)
        return self.session.update(scan, odometry_at(scan.stamp_ns), now_s)


@pytest.fixture(autouse=True)
def _fake_localizer(monkeypatch):
    monkeypatch.setattr(method, "Localizer", FakeLocalizer)


@pytest.fixture
def lines(caplog):
    caplog.set_level(logging.INFO, logger="glass_nav")
    logging.getLogger("glass_nav").propagate = True
    return caplog


def guess(stamp_ns=0, x=5.0):
    return PoseGuess(stamp_ns, np.array([x, 5.0, 0.0]), COVARIANCE)


def test_the_first_map_begins_at_the_default_pose_and_a_later_one_leaves_the_particles():
    bench = Bench()
    assert bench.session.refusal == "there is no map yet"
    assert bench.session.use_map(GRID, "topic /map") and bench.session.refusal is None
    assert bench.session.use_map(OTHER_GRID, "topic /map")
    assert bench.told == [("pose", 3.0, 0.0, 0.0), ("map", OTHER_GRID.digest)]
    assert not bench.session.use_map(OTHER_GRID, "topic /map")
    assert (bench.starts_over, len(bench.told)) == (1, 2)


def test_without_a_guess_the_whole_map_is_searched():
    bench = Bench(start_without_guess=True)
    bench.session.use_map(GRID, "a file")
    assert bench.told == [("scatter", None)]


def test_a_map_without_room_is_started_in_at_the_default_pose(lines, monkeypatch):
    def refuse(self, area=None) -> None:
        raise ValueError("the map has no free cell")

    monkeypatch.setattr(FakeLocalizer, "scatter", refuse)
    bench = Bench(start_without_guess=True)
    bench.session.use_map(GRID, "a file")
    assert bench.told == [("pose", 3.0, 0.0, 0.0)]
    assert "no search of the whole map: the map has no free cell; starting at ~initial_pose_x" in lines.text


@pytest.mark.parametrize(
    "stamp_ns, x",
    [
        pytest.param(0, 5.0, id="of now"),
        pytest.param(500_000_000, 6.5, id="moved on by odometry from its stamp"),
        pytest.param(13, 5.0, id="no odometry at its stamp"),
    ],
)
def test_a_given_pose_is_taken_with_the_next_scan(stamp_ns, x):
    bench = Bench()
    bench.session.use_map(GRID, "a file")
    bench.session.pose_is_news = False
    bench.session.give(guess(stamp_ns), 10.5)
    bench.scan()
    assert bench.told[1:] == [("pose", x, 5.0, 0.0)]
    assert bench.session.pose_is_news


def test_a_given_pose_waits_for_a_scan_at_its_stamp_but_not_for_ever():
    bench = Bench(force_update_after_initialpose=True)
    bench.session.use_map(GRID, "a file")
    bench.session.give(guess(stamp_ns=3_000_000_000), 10.5)
    bench.scan(now_s=11.0)
    assert bench.told[1:] == []
    bench.scan(now_s=11.6)
    assert bench.told[1:] == [("pose", 4.0, 5.0, 0.0), "update"]


def test_a_pose_off_the_map_is_refused(lines):
    bench = Bench()
    bench.session.give(guess(x=20.0), 10.0)  # before there is a map
    bench.session.use_map(GRID, "a file")
    bench.scan()
    off = "the pose x 20.000 m, y 5.000 m lies outside the map"
    assert bench.told[1:] == [] and f"initialpose refused: {off}" in lines.text
    with pytest.raises(ValueError, match=off):
        bench.session.give(guess(x=20.0), 10.0)


def test_a_pose_that_came_with_a_map_forces_an_update_if_it_shall():
    for forced in (True, False):
        bench = Bench(force_update_after_set_map=forced)
        bench.session.use_map(GRID, "service set_map")
        bench.session.give_with_map(guess(), 10.0)
        assert bench.told[1:] == ["update"] * forced


def test_a_node_that_waits_for_a_pose_begins_with_it_or_with_a_search():
    for begin in (lambda session: session.give(guess(), 10.0), lambda session: session.search()):
        bench = Bench(wait_for_initialpose=True)
        bench.session.use_map(GRID, "a file")
        assert bench.session.refusal is not None and bench.session.waits_for_pose
        begin(bench.session)
        assert bench.session.refusal is None and not bench.session.waits_for_pose


def test_a_search_takes_the_place_of_a_pose_that_waits():
    bench = Bench()
    with pytest.raises(ValueError, match="there is no map yet"):
        bench.session.search()
    bench.session.use_map(GRID, "a file")
    bench.session.give(guess(), 10.0)
    bench.session.search(np.zeros((4, 2)))
    bench.scan()
    assert bench.told[1:] == [("scatter", 4)] and bench.starts_over == 2
    with pytest.raises(ValueError, match="no room"):
        bench.session.search(np.zeros((2, 2)))
    assert bench.starts_over == 2


def test_a_pose_that_is_not_finite_does_not_go_out():
    bench = Bench()
    bench.session.use_map(GRID, "a file")
    bench.session.localizer.pose = np.array([1.0, np.nan, 0.0])
    assert bench.scan() is None and bench.session.estimate is None
    bench.session.localizer.pose = np.zeros(3)
    assert bench.scan() is bench.session.estimate is not None


@pytest.mark.parametrize("field", ["map_from_base", "map_from_odom", "covariance"])
def test_an_estimate_with_nan_is_told_from_one_without(field):
    good = FakeLocalizer(None, GRID, np.random.default_rng(0)).update(SCAN, None)
    assert session_module.is_finite(good)
    bad = getattr(good, field).copy()
    bad.flat[0] = np.nan
    assert not session_module.is_finite(replace(good, **{field: bad}))


@pytest.mark.parametrize(
    "simulated, told",
    [
        pytest.param(False, ("pose", 1.0, 2.0, 0.5), id="a clock set back: the robot stays where it is"),
        pytest.param(True, ("pose", 3.0, 0.0, 0.0), id="a bag starts over: so does the robot"),
    ],
)
def test_after_a_jump_of_time_the_filter_starts_over_with_the_same_numbers(simulated, told):
    bench = Bench(simulated)
    bench.session.restart("time jumped back by 1 s", 5.0)  # before there is a map
    bench.session.use_map(GRID, "a file")
    first = bench.session.localizer.first_number
    bench.scan()
    bench.session.restart("time jumped back by 3 s", 5.0)
    assert bench.told == [told] and bench.session.localizer.first_number == first
    assert bench.session.estimate is None and bench.starts_over == 2


def test_a_given_pose_is_where_a_bag_starts_over(lines):
    bench = Bench(simulated=True)
    bench.session.use_map(GRID, "a file")
    bench.session.give(guess(), 10.0)
    bench.scan()
    bench.session.restart("time jumped back by 3 s", 5.0)
    assert bench.told == [("pose", 5.0, 5.0, 0.0)]
    assert "the filter restarts at the last pose it was given, x 5.000 m" in lines.text


def test_a_bag_that_starts_over_waits_for_a_pose_again_if_it_did():
    bench = Bench(simulated=True, wait_for_initialpose=True)
    bench.session.use_map(GRID, "a file")
    bench.session.give(guess(), 10.0)
    bench.scan()
    bench.session.restart("time jumped back by 3 s", 5.0)
    assert bench.session.localizer is None and bench.session.waits_for_pose


def saved(stamp_ns=1_000_000_000, digest=GRID.digest):
    return SavedPose(stamp_ns, np.array([4.0, 4.0, 0.0]), COVARIANCE, np.array([1.0, 0.0, 0.0]), digest, "LOCALIZED")


@pytest.mark.parametrize(
    "content, told, text",
    [
        (saved(), ("pose", 5.0, 4.0, 0.0), "of the pose file, 1 s old"),
        (saved(digest="of another map"), ("scatter", None), "the robot may be anywhere in the map"),
        (None, None, "no pose file"),
    ],
)
def test_the_pose_file_is_used_with_the_first_scan(tmp_path, lines, content, told, text):
    path = tmp_path / "pose.yaml"
    if content is not None:
        save(path, content)
    bench = Bench(pose_file=path)
    bench.session.use_map(GRID, "a file")
    bench.scan()
    bench.scan()
    assert bench.told[1:] == ([] if told is None else [told])
    assert text in lines.text


def test_a_given_pose_goes_before_the_pose_file(tmp_path):
    save(tmp_path / "pose.yaml", saved())
    bench = Bench(pose_file=tmp_path / "pose.yaml")
    bench.session.use_map(GRID, "a file")
    bench.session.give(guess(), 10.0)
    bench.scan()
    assert bench.told[1:] == [("pose", 5.0, 5.0, 0.0)]


def test_other_parameters_reach_the_localizer_that_there_is():
    bench = Bench()
    bench.session.reconfigure(replace(bench.params, rules=StartRules(wait_for_initialpose=True)))
    bench.session.use_map(GRID, "a file")
    bench.session.reconfigure(bench.params)
    assert bench.told[1:] == ["parameters"]


def test_what_is_missing_is_said_in_its_order():
    bench = Bench(wait_for_initialpose=True)
    inputs = Inputs(
        0.0, 10.0, "no scan on /scan for 4 s", "no scan used yet", "no map: there is no service /static_map"
    )
    assert bench.session.missing(inputs) == "no time: /use_sim_time is set, but nothing publishes /clock"
    inputs = replace(inputs, now_s=11.0)
    assert bench.session.missing(inputs) == "no map: there is no service /static_map"
    inputs = replace(inputs, map_trouble=None)
    assert bench.session.missing(inputs) == "no map yet"
    bench.session.use_map(GRID, "a file")
    assert bench.session.missing(inputs) == "waiting for an initial pose"
    bench.session.search()
    assert bench.session.missing(inputs) == "no scan used yet"
    assert bench.session.state_without_scans == LocalizationState.UNKNOWN
    bench.scan(now_s=11.0)
    assert bench.session.missing(inputs) is None
    assert bench.session.state_without_scans == LocalizationState.UNCERTAIN
    assert bench.session.missing(replace(inputs, now_s=14.5)) == "no scan on /scan for 4 s"
    late = replace(inputs, now_s=14.5, last_scan_s=14.4, scan_trouble="scan refused: it has no stamp")
    assert bench.session.missing(late) == "scan refused: it has no stamp"


# -- panes that the map lacks


PANE = Pane(np.array([0.2, 0.2]), np.array([0.2, 0.6]))


def test_panes_are_written_when_asked_when_the_map_changes_and_at_the_end_and_read_at_the_start(tmp_path):
    robot = Bench(panes_file=tmp_path / "panes.yaml")
    assert robot.session.lacking_glass is None
    robot.session.keep_panes()  # there is no map yet
    robot.session.use_map(GRID, "topic")
    assert robot.session.lacking_glass is None
    robot.session.keep_panes()  # nothing was found
    assert not (tmp_path / "panes.yaml").exists()
    robot.session.localizer.remember((PANE,), {})
    assert robot.session.lacking_glass.startswith("the map lacks 0.4 m of glass (1 pane); call ~save_panes, then ")
    robot.session.keep_panes()
    again = Bench(panes_file=tmp_path / "panes.yaml")
    again.session.use_map(GRID, "topic")
    assert len(again.session.localizer.unmapped_panes) == 1
    assert again.session.save_panes().startswith("1 panes (0.4 m in use) and the glass map written to ")


def test_panes_cannot_be_saved_without_a_map():
    with pytest.raises(ValueError, match="there is no map yet"):
        Bench().session.save_panes()
