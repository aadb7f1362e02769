"""panes.yaml: what it means, and what it says when it cannot be used."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from glass_nav.world import panes_file
from glass_nav.world.grid_map import GridMap
from glass_nav.world.pane import Pane
from glass_nav.world.panes_file import PanesFileError

FLOOR = GridMap(np.zeros((100, 200), np.int8), 0.05, np.array([-1.0, 2.0, 0.3]))
PANE = {"from": [0.0, 4.0], "to": [1.0, 4.5]}


def written(tmp_path: Path, **changes: Any) -> Path:
    path = tmp_path / "panes.yaml"
    path.write_text(yaml.safe_dump({"map": FLOOR.fingerprint, "panes": [PANE], **changes}))
    return path


@pytest.mark.parametrize("seed", range(10))
def test_what_is_saved_is_loaded(seed: int, tmp_path: Path) -> None:
    """Property: any panes inside the map come back, to a tenth of a millimetre."""
    rng = np.random.default_rng(seed)
    panes = [
        Pane(
            FLOOR.centres(*rng.integers(1, 99, 2)),
            FLOOR.centres(*rng.integers(1, 99, 2)) + 0.01,
            float(rng.random()),
            int(rng.integers(1000)),
            int(rng.integers(1000)),
            float(rng.random()),
        )
        for _ in range(rng.integers(0, 5))
    ]
    arrays = {"odds": rng.normal(size=(2, 50)).astype(np.float32)} if seed % 2 else {}
    panes_file.save(tmp_path / "panes.yaml", FLOOR, panes, arrays)
    loaded = panes_file.load(tmp_path / "panes.yaml", FLOOR)
    assert len(loaded.panes) == len(panes)
    for pane, expected in zip(loaded.panes, panes):
        np.testing.assert_allclose([pane.start_m, pane.end_m], [expected.start_m, expected.end_m], atol=1e-4)
        assert pane.probability == pytest.approx(expected.probability, abs=1e-4)
        assert (pane.returns, pane.passes) == (expected.returns, expected.passes)
    assert loaded.arrays.keys() == arrays.keys()
    for name in arrays:
        np.testing.assert_array_equal(loaded.arrays[name], arrays[name])


def test_the_file_lists_what_a_person_wants_to_know(tmp_path: Path) -> None:
    panes_file.save(tmp_path / "panes.yaml", FLOOR, [Pane(np.array([0.0, 4.0]), np.array([3.0, 8.0]), 0.9, 5, 7, 2.0)])
    (entry,) = yaml.safe_load((tmp_path / "panes.yaml").read_text())["panes"]
    assert entry == {
        "from": [0.0, 4.0],
        "to": [3.0, 8.0],
        "probability": 0.9,
        "length_m": 5.0,
        "returns": 5,
        "passes": 7,
        "seen_from_m": 2.0,
    }


def test_a_file_by_hand_needs_only_the_ends(tmp_path: Path) -> None:
    (tmp_path / "panes.yaml").write_text("panes:\n  - {from: [0, 4], to: [1, 4.5]}\n")
    (pane,) = panes_file.load(tmp_path / "panes.yaml", FLOOR).panes
    assert pane.probability == 1.0
    assert pane.length_m == pytest.approx(np.hypot(1.0, 0.5))


def test_no_file_is_told_from_a_bad_one(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        panes_file.load(tmp_path / "panes.yaml", FLOOR)


@pytest.mark.parametrize(
    "changes, message",
    [
        ({"map": "0123456789abcdef0"}, "of another map: fingerprint 0123456789abcdef, this map has"),
        ({"panes": None}, "must hold a list `panes`, got NoneType"),
        ({"panes": [3]}, "pane 1 must have the keys from and to, got 3"),
        ({"panes": [PANE, {**PANE, "from": [1.0]}]}, r"pane 2: from must be \[x, y\] in m, got \[1.0\]"),
        ({"panes": [{**PANE, "to": [float("nan"), 1.0]}]}, r"pane 1: to must be \[x, y\] in m, got \[nan, 1.0\]"),
        ({"panes": [{**PANE, "to": PANE["from"]}]}, "pane 1: a pane needs a length > 0 m"),
        ({"panes": [{**PANE, "to": [99.0, 4.0]}]}, r"pane 1, from \(0, 4\) to \(99, 4\) m, lies outside the map"),
        ({"panes": [{**PANE, "probability": 2.0}]}, r"pane 1: the probability of a pane must be in \[0, 1\], got 2.0"),
        ({"panes": [{**PANE, "returns": "many"}]}, "pane 1: returns must be a finite number, got 'many'"),
        ({"arrays": [1]}, "arrays must be a mapping of names to text, got list"),
        ({"arrays": {"odds": "AAAA"}}, "the array 'odds' is damaged"),
    ],
)
def test_a_bad_file_is_refused_in_one_line(changes: "dict[str, Any]", message: str, tmp_path: Path) -> None:
    with pytest.raises(PanesFileError, match=message) as raised:
        panes_file.load(written(tmp_path, **changes), FLOOR)
    assert "\n" not in str(raised.value)
    assert str(raised.value).startswith(str(tmp_path))


@pytest.mark.parametrize(
    "content, message", [(b"[1, 2", "is not yaml"), (b"\xff\xfe\x00", "cannot be read"), (b"4", "is no file of panes")]
)
def test_what_is_no_file_of_panes_is_refused(content: bytes, message: str, tmp_path: Path) -> None:
    (tmp_path / "panes.yaml").write_bytes(content)
    with pytest.raises(PanesFileError, match=message):
        panes_file.load(tmp_path / "panes.yaml", FLOOR)


def test_a_write_that_fails_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path)
    before = path.read_text()

    def fail(source: Any, target: Any) -> None:
        raise OSError(28, "No space left on device", str(target))

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(OSError, match="No space left"):
        panes_file.save(path, FLOOR, [])
    assert path.read_text() == before
    assert list(tmp_path.iterdir()) == [path]
