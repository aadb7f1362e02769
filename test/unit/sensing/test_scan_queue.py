"""Scans that wait for their transforms: the newest that has them wins, and where each scan went is counted."""

from __future__ import annotations

from typing import List, Optional

import numpy as np
import pytest
from made_transforms import STAMP_NS, MadeTransforms, raw_scan

from glass_nav.sensing import scan_queue
from glass_nav.sensing.mounting import Mounting
from glass_nav.sensing.scan import ScanError
from glass_nav.sensing.scan_placement import ScanPlacement
from glass_nav.sensing.scan_queue import ReadyScan, ScanQueue

MAX_WAIT_S = 1.0


class Queue(ScanQueue):
    """With the transforms and the warnings at hand; stamps in ns after STAMP_NS."""

    def __init__(self, grace_s: float = 0.0) -> None:
        self.transforms = MadeTransforms()
        self.warnings: List[str] = []
        placement = ScanPlacement(self.transforms)
        super().__init__(placement, MAX_WAIT_S, 0.0, lambda text, period_s: self.warnings.append(text), grace_s)

    def come(self, *stamps: int, lidar: str = "laser", now_s: float = 0.0) -> "List[Optional[str]]":
        return [self.add(raw_scan(STAMP_NS + stamp, lidar), now_s) for stamp in stamps]

    def ready(self, now_s: float, until: int) -> List[int]:
        """The stamps of the scans that are ready when transforms are known up to that one."""
        self.transforms.known_until_ns = STAMP_NS + until
        return [scan.raw.stamp_ns - STAMP_NS for scan in self.take_ready(now_s)]


def test_the_newest_scan_with_transforms_wins_and_older_ones_go():
    queue = Queue()
    queue.come(10, 20, 30, 40)
    assert queue.ready(0.1, until=30) == [30]
    assert (queue.counts.superseded, queue.counts.waiting, queue.is_waiting) == (2, 1, True)
    assert queue.ready(0.2, until=39) == []
    assert queue.ready(0.2, until=40) == [40]
    assert not queue.is_waiting


@pytest.mark.parametrize("stamp", [30, 29, 1])
def test_stamps_of_one_lidar_only_ascend(stamp):
    queue = Queue()
    queue.come(30)
    queue.ready(0.0, until=100)
    queue.come(stamp, now_s=0.1)
    assert queue.counts.refused == 1
    assert queue.trouble == "scan refused: its stamp 1000.000 s is not after that of the last one used"
    queue.come(31, now_s=0.1)
    assert queue.ready(0.1, until=100) == [31]


def test_a_scan_without_transforms_is_dropped_after_the_limit_even_if_others_flow():
    queue = Queue()
    queue.come(99)  # its stamp is ahead of all transforms
    for number in range(5):
        queue.come(number, now_s=0.25 * number)
        assert queue.ready(0.25 * number, until=50) == [number]
    queue.come(5, now_s=1.25)
    assert queue.ready(1.25, until=50) == [5]
    assert queue.counts.dropped_no_transform == 1 and not queue.is_waiting
    assert queue.trouble == "no transform odom <- base"
    assert queue.warnings == ["scan dropped after 1 s: no transform odom <- base"]


def test_a_transform_that_comes_after_the_limit_is_reported():
    queue = Queue()
    queue.come(10, 20)
    queue.add(raw_scan(STAMP_NS + 30), 5.0)
    queue.transforms.known_until_ns = STAMP_NS + 9
    known = iter([STAMP_NS + 9] * 3)  # three scans are looked at; after that the transforms are there

    def odom_from_base(stamp_ns: int) -> np.ndarray:
        queue.transforms.known_until_ns = next(known, STAMP_NS + 100)
        return MadeTransforms.odom_from_base(queue.transforms, stamp_ns)

    queue.transforms.odom_from_base = odom_from_base  # type: ignore[assignment]
    assert queue.take_ready(5.0) == []
    assert queue.warnings == ["scan dropped: its transforms came later than 1 s"]


def test_no_more_scans_wait_than_there_is_room_for():
    queue = Queue()
    queue.come(*range(1000))
    assert queue.counts.waiting == scan_queue.MAX_WAITING
    assert queue.counts.dropped_no_transform == 1000 - scan_queue.MAX_WAITING
    assert queue.ready(0.0, until=1000) == [999]


def test_two_lidars_are_counted_together_and_handed_out_by_their_stamps():
    queue = Queue()
    queue.transforms.mountings["rear"] = Mounting(np.zeros(3))
    queue.come(10, 20, 30)
    queue.come(15, lidar="rear")
    assert queue.ready(0.1, until=100) == [15, 30]
    assert queue.lidars == ["laser", "rear"]
    assert (queue.counts.waiting, queue.counts.superseded) == (0, 2)
    queue.come(9, lidar="rear")  # each by its own clock
    assert queue.counts.refused == 1
    queue.come(16, lidar="rear")
    assert queue.ready(0.1, until=100) == [16]


def test_after_a_restart_earlier_stamps_are_taken():
    queue = Queue()
    queue.come(50)
    queue.ready(0.0, until=50)
    queue.come(60)
    queue.restart(7.0)
    assert (queue.counts.dropped_no_transform, queue.lidars, queue.last_arrival_s) == (1, [], 7.0)
    queue.come(1)
    assert queue.ready(0.0, until=100) == [1]


def test_a_clock_that_was_set_back_is_noticed_after_some_scans():
    queue = Queue()
    queue.come(1000)
    queue.ready(0.0, until=1000)
    told = queue.come(*range(scan_queue.STALE_SCANS))
    assert told[:-1] == [None] * (scan_queue.STALE_SCANS - 1)
    assert told[-1] == f"the last {scan_queue.STALE_SCANS} scans are older than the one before them"


def test_a_newer_scan_in_between_shows_that_the_clock_is_right():
    queue = Queue()
    queue.come(1000)
    queue.ready(0.0, until=1000)
    queue.come(*range(scan_queue.STALE_SCANS - 1))
    assert queue.come(1001, 5) == [None, None]


@pytest.mark.parametrize(
    "stamp_ns, lidar, unusable, why",
    [
        (0, "laser", None, "it has no stamp"),
        (STAMP_NS, "", None, "it has no frame_id"),
        (STAMP_NS, "laser", "there is no map yet", "there is no map yet"),
    ],
)
def test_a_scan_that_cannot_be_used_does_not_wait(stamp_ns, lidar, unusable, why):
    queue = Queue()
    assert queue.add(raw_scan(stamp_ns, lidar), 3.0, unusable) is None
    assert queue.trouble == f"scan refused: {why}" and queue.warnings == [queue.trouble]
    assert (queue.counts.received, queue.counts.refused, queue.is_waiting) == (1, 1, False)
    assert queue.last_arrival_s == 3.0


def test_made_up_frames_leave_room_for_real_ones():
    queue = Queue()
    queue.come(1)
    queue.ready(0.0, until=100)
    for number in range(100):
        queue.come(number, lidar=f"made_up_{number}")
    queue.come(2)
    queue.ready(0.0, until=100)
    assert queue.lidars == ["laser"]
    assert queue.counts.refused == 0 and queue.counts.waiting < scan_queue.MAX_LIDARS


def test_no_more_lidars_are_used_than_there_is_room_for():
    queue = Queue()
    for number in range(scan_queue.MAX_LIDARS + 1):
        queue.transforms.mountings[f"laser{number}"] = Mounting(np.zeros(3))
        queue.come(1, lidar=f"laser{number}")
        queue.ready(0.0, until=100)
    assert queue.trouble == "scan refused: its frame 'laser16' would be that of the lidar number 17, the most are 16"


def test_the_period_is_that_of_all_lidars_together():
    queue = Queue()
    queue.transforms.mountings["rear"] = Mounting(np.zeros(3))
    assert queue.period_s is None
    for lidar, step in (("laser", 100_000_000), ("rear", 50_000_000)):
        for number in range(1, 4):
            queue.come(number * step, lidar=lidar)
            assert queue.ready(0.0, until=10**12) == [number * step]
    assert queue.period_s == pytest.approx(1.0 / 30.0)
    queue.come(3600 * 10**9)  # a pause
    assert queue.period_s == pytest.approx(1.0 / 30.0)


def test_a_scan_is_placed_or_rejected_when_it_is_ready():
    queue = Queue()
    np.testing.assert_allclose(queue.place(ReadyScan(raw_scan(STAMP_NS + 10**9))).odom_from_base, [1.0, 0.0, 0.0])
    with pytest.raises(ScanError, match="range_max must be finite and > 0 m"):
        queue.place(ReadyScan(raw_scan(range_max_m=0.0)))
    assert queue.warnings == []
    queue.place(ReadyScan(raw_scan(time_increment_s=0.5)))
    assert queue.warnings == ["scans are not deskewed: time_increment 0.5 s times 5 beams is 2 s, allowed 1 s"]


def test_other_parameters_hold_for_scans_that_wait_already():
    queue = Queue()
    queue.come(10)
    queue.use(ScanPlacement(queue.transforms, deskews=False), max_wait_s=5.0)
    assert queue.ready(4.0, until=5) == []
    assert queue.ready(4.0, until=10) == [10]


def test_at_the_start_nothing_is_warned_about_before_a_grace_time():
    queue = Queue(grace_s=scan_queue.GRACE_S)
    queue.add(raw_scan(STAMP_NS), 100.0, "there is no map yet")
    queue.come(10, now_s=100.0)
    assert queue.ready(102.0, until=-100) == []
    assert (queue.warnings, queue.trouble) == ([], "no transform odom <- base")  # ~status says it at once
    queue.come(20, now_s=106.0)
    queue.ready(108.0, until=-100)
    queue.add(raw_scan(STAMP_NS), 109.0, "there is no map yet")
    assert queue.warnings == [
        "scan dropped after 1 s: no transform odom <- base",
        "scan refused: there is no map yet",
    ]


def test_a_malformed_scan_has_no_grace_time_and_neither_has_a_lidar_that_ran():
    queue = Queue(grace_s=scan_queue.GRACE_S)
    queue.add(raw_scan(0), 100.0)
    assert queue.warnings == ["scan refused: it has no stamp"]
    queue.come(10, now_s=100.1)
    assert queue.ready(100.2, until=100) == [10]
    queue.come(20, now_s=100.3)
    queue.ready(101.5, until=15)
    assert queue.warnings[1:] == ["scan dropped after 1 s: no transform odom <- base"]


def test_after_a_jump_of_time_there_is_a_grace_time_again():
    queue = Queue(grace_s=scan_queue.GRACE_S)
    queue.come(10, now_s=100.0)
    queue.ready(100.1, until=100)
    queue.restart(0.0)
    queue.add(raw_scan(STAMP_NS), 3.0, "there is no map yet")
    assert queue.warnings == []


def test_what_a_scan_waited_for_is_not_looked_up_again():
    queue = Queue()
    queue.come(10**9)
    (ready,) = queue.take_ready(0.0)
    queue.transforms.known_until_ns = 0
    np.testing.assert_allclose(queue.place(ready).odom_from_base, [1.0, 0.0, 0.0])
