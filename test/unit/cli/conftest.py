"""Runs the command as a user does."""

import pytest

from glass_nav.cli import main as cli
from glass_nav.cli import progress


@pytest.fixture
def run(tmp_path, capsys, monkeypatch):
    """run(command, option, ...): exit code, stdout, stderr, without the path of the folder."""
    monkeypatch.setattr(progress, "LINE_PERIOD_S", 3600.0)  # however slow the machine is, nothing is told on the way

    def command(*options):
        code = cli.main([str(option) for option in options])
        captured = capsys.readouterr()
        return code, captured.out.replace(f"{tmp_path}/", ""), captured.err.replace(f"{tmp_path}/", "")

    return command
