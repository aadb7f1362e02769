from __future__ import annotations

from glass_nav.evaluation.pages import replay_table


def test_an_infinite_error_is_no_number_in_the_table():
    assert replay_table._metres(None) == "infinite"
