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
    monkeypatch.setattr(machine, "memory_bytes", lambda: 2_000_000_000)
    with pytest.raises(params.ParamError) as err:
        params.load(LocalizerParams, {"max_particles": 50_000}, "/node")
    assert str(err.value) == (
        "/node: ~max_particles must be <= 27778 on this computer: with 720 beams more take over 1.0 GB of memory, "
        "got 50000"
    )
    assert params.load(LocalizerParams, {"max_particles": 50_000, "laser_max_beams": 60}, "/node")


def test_the_defaults_start_on_any_computer(monkeypatch):
    monkeypatch.setattr(machine, "memory_bytes", lambda: 1)
    assert LocalizerParams().count.max_particles == 5000
