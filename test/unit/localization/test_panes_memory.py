"""What is told of the glass that the map lacks, and what of it is kept in a file."""

from __future__ import annotations

import logging

import numpy as np
import pytest

from glass_nav.localization.beam_classification.glass_map import GlassEvidence, GlassMap
from glass_nav.localization.panes_memory import PanesFilePath, PanesMemory
from glass_nav.world.grid_map import GridMap
from glass_nav.world.pane import Pane

MAP = GridMap(np.zeros((80, 200), np.int8), 0.05, np.zeros(3))
OTHER_MAP = GridMap(np.zeros((80, 201), np.int8), 0.05, np.zeros(3))


class FakeLocalizer:
    """Found these panes."""

    def __init__(self, *lengths_m):
        self.unmapped_panes = self.found_panes = tuple(
            Pane(np.array([1.0, 1.0 + number]), np.array([1.0 + length_m, 1.0 + number]))
            for number, length_m in enumerate(lengths_m)
        )
        self.glass_map = GlassMap(MAP, GlassEvidence())
        self.remembered = None

    def remember(self, panes, glass):
        if "glass_cell" not in glass:
            raise ValueError("a glass map needs cells")
        self.remembered = panes


@pytest.fixture
def file(tmp_path):
    return tmp_path / "panes.yaml"


def memory(file="") -> PanesMemory:
    return PanesMemory(PanesFilePath(panes_file=str(file)))


def test_glass_is_reported_once_and_again_when_there_is_much_more(caplog):
    told = memory()
    for lengths_m in ((), (0.6,), (3.0,), (3.0,), (3.0, 1.2), (3.0, 3.0)):
        told.tell(FakeLocalizer(*lengths_m))
    assert [record.message.split(";")[0] for record in caplog.records] == [
        "the map lacks 3.0 m of glass (1 pane)",
        "the map lacks 6.0 m of glass (2 panes)",
    ]
    assert "; glass_nav map panes BAG --map MAP.yaml --out DIR draws it into the map" in caplog.records[0].message


def test_what_was_written_is_read_by_the_next_run(file, caplog):
    caplog.set_level(logging.INFO)
    first = FakeLocalizer(2.0, 1.0)
    said = memory(file).save(first, MAP)
    assert said == f"2 panes (3.0 m in use) and the glass map written to {file}"
    second = FakeLocalizer()
    memory(file).recall(second, MAP)
    assert [pane.length_m for pane in second.remembered] == [2.0, 1.0]
    assert caplog.records[-1].message.startswith(f"{file}: 2 panes that the map lacks")


def test_a_file_of_another_map_is_refused_and_stays_as_it_is(file, caplog):
    memory(file).save(FakeLocalizer(2.0), MAP)
    before, localizer = file.read_bytes(), FakeLocalizer(1.0)
    memory(file).recall(localizer, OTHER_MAP)
    memory(file).keep(localizer, OTHER_MAP)
    assert localizer.remembered is None and file.read_bytes() == before
    refused, kept = (record.message for record in caplog.records)
    assert "its panes are of another map" in refused and refused.endswith("; it is not used")
    assert kept.startswith("panes are not kept: ") and kept.endswith("; it is left as it is")


def test_a_file_with_another_glass_map_is_refused_in_one_line(file, caplog):
    from glass_nav.world import panes_file

    panes_file.save(file, MAP, [], {"other": np.zeros(3)})
    memory(file).recall(FakeLocalizer(), MAP)
    assert caplog.records[-1].message == f"{file}: a glass map needs cells; it is not used"


def test_without_a_file_nothing_is_kept(file, caplog):
    caplog.set_level(logging.INFO)
    memory(file).recall(FakeLocalizer(), MAP)
    assert "does not exist yet" in caplog.records[-1].message
    memory().recall(FakeLocalizer(), MAP)
    memory().keep(FakeLocalizer(2.0), MAP)
    with pytest.raises(ValueError, match="~panes_file is not set: there is nowhere to write the panes to"):
        memory().save(FakeLocalizer(2.0), MAP)


def test_a_file_that_cannot_be_written_is_said_in_one_line(file, monkeypatch, caplog):
    def refuse(*_):
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr("glass_nav.world.panes_file.save", refuse)
    memory(file).keep(FakeLocalizer(2.0), MAP)
    assert caplog.records[-1].message == f"panes are not kept: {file}: cannot be written: Read-only file system"


def test_the_folder_of_the_file_must_exist(tmp_path):
    with pytest.raises(ValueError, match="~panes_file must lie in a folder that exists, got "):
        PanesFilePath(panes_file=str(tmp_path / "no" / "panes.yaml"))
