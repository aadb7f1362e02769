"""Makes the helpers beside the tests importable: pytest's import mode importlib does not. Runs the command."""

import sys
from pathlib import Path

import pytest

from glass_nav.cli import main as cli
from glass_nav.cli import progress

sys.path.append(str(Path(__file__).parent))


@pytest.fixture
def run(tmp_path, capsys, monkeypatch):
    """run(command, option, ...): exit code, stdout, stderr, without the path of the folder."""
    monkeypatch.setattr(progress, "LINE_PERIOD_S", 3600.0)  # however slow the machine is, nothing is told on the way

    def command(*options):
        code = cli.main([str(option) for option in options])
        captured = capsys.readouterr()
        return code, captured.out.replace(f"{tmp_path}/", ""), captured.err.replace(f"{tmp_path}/", "")

    return command
