from __future__ import annotations

import io

import pytest

from glass_nav.cli import progress
from glass_nav.cli.progress import Progress, clock


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def seconds(monkeypatch):
    """A clock in the hands of the test."""
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    return now


def test_a_terminal_shows_a_bar_that_fills(seconds):
    stream = Terminal()
    bar = Progress("replay", 4, stream)
    for _ in range(4):
        seconds[0] += 1.0
        bar.step()
    bar.finish()
    shown = stream.getvalue().split("\r")
    assert shown[1] == "[#######.......................] replay: 1 of 4 scans, 0:03 left\x1b[K"
    assert shown[-1] == "[##############################] replay: 4 of 4 scans, 0:00 left\x1b[K\n"


def test_a_file_gets_a_line_now_and_then(seconds):
    stream = io.StringIO()
    bar = Progress("replay", 100, stream)
    for _ in range(25):
        seconds[0] += 1.0
        bar.step()
    bar.finish()
    assert stream.getvalue() == "replay: 10 of 100 scans, 1:30 left\nreplay: 20 of 100 scans, 1:20 left\n"


def test_more_than_expected_or_nothing_at_all_does_no_harm(seconds):
    stream = Terminal()
    bar = Progress("replay", 0, stream)
    seconds[0] = 1.0
    bar.step()
    bar.finish()
    assert "1 of 0 scans, 0:00 left" in stream.getvalue()


@pytest.mark.parametrize("given, text", [(0, "0:00"), (59.6, "1:00"), (75.2, "1:15"), (3671, "1:01:11")])
def test_times_read_like_a_clock(given, text):
    assert clock(given) == text
