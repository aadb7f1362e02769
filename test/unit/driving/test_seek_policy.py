"""Who is stuck in a search goes on from another meetpoint, but not for ever."""

from __future__ import annotations

import pytest

from glass_nav.driving.seek_policy import SeekPolicy


@pytest.fixture
def policy():
    return SeekPolicy(3)


def test_at_the_start_it_seeks_once(policy):
    assert policy.is_due(waits=False, searching=False) and not policy.sought
    policy.seeks()
    assert policy.sought and not policy.is_due(waits=False, searching=False)


def test_it_seeks_for_a_search_that_waits(policy):
    policy.seeks()
    assert policy.is_due(waits=True, searching=False)


def test_where_an_edge_of_a_search_led_nowhere_it_seeks_another_meetpoint(policy):
    policy.seeks()
    policy.succeeds()
    assert not policy.is_due(waits=False, searching=True)  # moved away by hand: somebody steers
    policy.fails()
    assert policy.is_due(waits=False, searching=True)
    assert not policy.is_due(waits=False, searching=False)  # nobody searches


def test_after_so_many_failures_in_a_row_it_waits_for_a_request(policy):
    for _ in range(3):
        assert policy.is_due(waits=True, searching=True)
        policy.seeks()
        policy.fails()
    assert not policy.is_due(waits=True, searching=True)
    policy.succeeds()
    assert policy.is_due(waits=True, searching=False)


def test_what_others_asked_for_they_go_on_with(policy):
    policy.seeks()
    policy.leave_to_others()
    assert not policy.is_due(waits=True, searching=True)
    policy.reset()
    assert policy.is_due(waits=False, searching=False)
