"""What replay.launch says about its bag."""

from __future__ import annotations

import pytest

from glass_nav.recording.play_progress import PlayedPart, bags_of, played_part


def test_the_start_and_the_progress_are_reported():
    part = played_part(["--clock", "--rate=2", "run.bag"], [(100.0, 171.0)])
    assert part.started(["run.bag"]) == "playing run.bag: 71 s, 2 times as fast"
    assert part.progress(130.0) == "played 30 of 71 s (42 %), 20 s left"
    assert part.progress(99.0) == "played 0 of 71 s (0 %), 36 s left"
    assert part.progress(1e9) == "played 71 of 71 s (100 %), 0 s left"


@pytest.mark.parametrize(
    "arguments, part",
    [
        ([], PlayedPart(100.0, 70.0, 1.0)),
        (["--start=10", "--duration=60"], PlayedPart(110.0, 60.0, 1.0)),
        (["-s", "10", "-u", "500"], PlayedPart(110.0, 60.0, 1.0)),
        (["--start", "99"], PlayedPart(170.0, 0.0, 1.0)),
        (["--rate=0", "--start=x"], PlayedPart(100.0, 70.0, 1.0)),
    ],
)
def test_options_of_rosbag_play_choose_the_part(arguments, part):
    assert played_part(arguments, [(120.0, 170.0), (100.0, 130.0)]) == part


def test_the_speed_of_once_is_not_mentioned():
    assert PlayedPart(0.0, 12.0, 1.0).started(["a.bag", "b.bag"]) == "playing a.bag, b.bag: 12 s"


def test_a_part_without_length_is_over():
    assert PlayedPart(5.0, 0.0, 1.0).progress(5.0) == "played 0 of 0 s (100 %), 0 s left"


def test_bags_are_what_ends_like_one():
    assert bags_of(["--clock", "-r", "2", "a.bag", "--bags=x.bag", "b.bag"]) == ["a.bag", "b.bag"]
