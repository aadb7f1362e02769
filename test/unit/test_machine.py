"""What the computer has, and what of it the particles may take."""

from __future__ import annotations

import resource

import pytest

from glass_nav import machine, params
from glass_nav.localization.localizer_params import LocalizerParams


def test_the_memory_is_what_the_computer_has_or_ulimit_leaves(monkeypatch):
    whole = machine.memory_bytes()
    assert 10**8 < whole < 10**15
    monkeypatch.setattr(resource, "getrlimit", lambda which: (123_000_000, resource.RLIM_INFINITY))
    assert machine.memory_bytes() == min(123_000_000, whole)


@pytest.mark.parametrize("content, limit", [("400000000\n", 400_000_000), ("max\n", None)])
def test_a_container_may_leave_less(monkeypatch, tmp_path, content, limit):
    whole = machine.memory_bytes()
    (tmp_path / "memory.max").write_text(content)
    monkeypatch.setattr(machine, "_CGROUPS", (str(tmp_path / "memory.max"), str(tmp_path / "absent")))
    assert machine.memory_bytes() == limit if limit else machine.memory_bytes() >= whole


def test_more_particles_than_the_memory_holds_are_refused(monkeypatch):
    monkeypatch.setattr(machine, "memory_bytes", lambda: 200_000_000)
    with pytest.raises(params.ParamError) as err:
        params.load(LocalizerParams, {"max_particles": 50_001}, "/node")
    assert str(err.value) == (
        "/node: ~max_particles must be <= 50000 on this computer: more may take over 0.10 GB of memory, got 50001"
    )
    assert params.load(LocalizerParams, {"max_particles": 50_000}, "/node").count.max_particles == 50_000


def test_the_defaults_start_on_any_computer(monkeypatch):
    monkeypatch.setattr(machine, "memory_bytes", lambda: 1)
    assert LocalizerParams().count.max_particles == 5000


def test_memory_that_was_freed_goes_back_to_the_system():
    small = [bytearray(3000) for _ in range(10_000)]
    with_them = machine.resident_bytes()
    del small[:-1]  # the last one is above all others: only a trim gives these back
    machine.give_back_memory()
    assert machine.resident_bytes() < with_them - 20_000_000
