"""A part of test/benchmark/corrupted_files.py: no file, however damaged, ends in a traceback."""

from __future__ import annotations

from pathlib import Path

import pytest
from corrupted_files import COMMANDS, corrupted, fault, words

from glass_nav.cli import main as cli

REPO = Path(__file__).resolve().parents[3]
QUICK = {"map": "map show FILE --out OUT/x.png"}  # instead of the first one, which runs a replay
PANES = "panes:\n- line: [[1.0, 1.0], [1.0, 2.0]]\n"
LANDMARKS = "sigma: 0.05\nlandmarks:\n  - {id: 1, position: [1.0, 1.0]}\n  - {id: 2, position: [3.0, 1.0]}\n"
TRAJECTORY = "".join(f"{1000 + i / 10} {1 + i / 50} 1.0 0 0 0 0 1\n" for i in range(40))
PARAMETERS = "max_particles: 500\nlaser_max_beams: 60\nupdate_min_d: 0.1\nvote_mode: soft\n"


@pytest.fixture
def good(room_bag, room_map, tmp_path):
    """Role -> a good file, and what a command needs beside it."""
    atlas = REPO / "atlas" / "document_example" / "atlas.json"
    texts = {"panes": PANES, "landmarks": LANDMARKS, "parameters": PARAMETERS, "trajectory": TRAJECTORY}
    files = {role: tmp_path / f"{role}.{'txt' if role == 'trajectory' else 'yaml'}" for role in texts}
    for role, text in texts.items():
        files[role].write_text(text)
    return {**files, "bag": room_bag().write(), "map": room_map, "atlas": atlas}


@pytest.mark.parametrize("role", sorted(COMMANDS))
def test_a_damaged_file_is_one_line(role, good, tmp_path, capsys):
    command = QUICK.get(role, COMMANDS[role][0])
    for change, data in corrupted(good[role].read_bytes(), seed=1):
        broken = tmp_path / f"broken{good[role].suffix}"
        broken.write_bytes(data)
        paths = dict(FILE=broken, BAG=good["bag"], MAP=good["map"], OUT=tmp_path / "out")
        if role == "map":  # its image beside it
            (tmp_path / "map.pgm").write_bytes(good["map"].with_suffix(".pgm").read_bytes())
        code = cli.main(words(command, **paths))
        assert fault(code, capsys.readouterr().err) == "", f"{change}: {command}"


@pytest.mark.parametrize("role", ["atlas", "landmarks", "parameters", "trajectory", "panes", "map", "bag"])
def test_a_file_of_another_kind_is_one_line(role, good, tmp_path, capsys):
    for other in ("bag", "trajectory", "atlas"):
        if other == role:
            continue
        paths = dict(FILE=good[other], BAG=good["bag"], MAP=good["map"], OUT=tmp_path / "out")
        for command in COMMANDS[role][:1]:
            code = cli.main(words(command, **paths))
            printed = capsys.readouterr().err
            assert code in (2, 3) and fault(code, printed) == "", f"{other} as {role}: {command}: {printed}"
