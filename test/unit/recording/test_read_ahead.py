"""Reading ahead: the same items, an error in its place, and no thread that is left over."""

from __future__ import annotations

import threading
from contextlib import closing

import pytest

from glass_nav.recording.read_ahead import read_ahead

TIMEOUT_S = 10.0


def readers():
    return [thread for thread in threading.enumerate() if thread.name == "read_ahead"]


@pytest.mark.parametrize("count", [1, 3, 100])
def test_the_items_are_the_same_in_the_same_order(count):
    assert list(read_ahead(range(50), count)) == list(range(50))
    assert not readers()


def test_items_are_made_before_they_are_asked_for_and_only_so_many():
    made, four_are_made = [], threading.Event()

    def items():
        for number in range(100):
            made.append(number)
            if len(made) == 4:
                four_are_made.set()
            yield number

    with closing(read_ahead(items(), count=2)) as entries:
        assert next(entries) == 0
        assert four_are_made.wait(TIMEOUT_S)  # one taken, two waiting, one that finds no room
        assert len(made) == 4
    assert not readers()


def test_an_error_comes_after_the_items_before_it():
    def items():
        yield "first"
        raise ValueError("the file ends here")

    entries = read_ahead(items())
    assert next(entries) == "first"
    with pytest.raises(ValueError, match="the file ends here"):
        next(entries)
    assert not readers()


def test_who_stops_early_leaves_no_thread():
    entries = read_ahead(iter(int, 1), count=1)  # zeros without end
    assert next(entries) == 0
    entries.close()
    assert not readers()
