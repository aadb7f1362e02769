from __future__ import annotations

from pathlib import Path

import pytest

from glass_nav.params import ParamError
from glass_nav.replay import replay_params

REPO = Path(__file__).resolve().parents[3]


@pytest.mark.parametrize(
    "text, reason",
    [
        ("- 1\n", "must hold names and values, got list"),
        ("a: [\n", "is not yaml: "),
        ("max_particles: many\n", "~max_particles must be int, got 'many'"),
    ],
)
def test_parameter_files_that_are_none_are_refused(tmp_path, text, reason):
    (tmp_path / "p.yaml").write_text(text)
    with pytest.raises(ParamError) as caught:
        replay_params.load(tmp_path / "p.yaml")
    assert str(caught.value).startswith(f"{tmp_path}/p.yaml: {reason}")


def test_a_missing_or_empty_parameter_file(tmp_path):
    with pytest.raises(ParamError, match="p.yaml: cannot be read: No such file or directory$"):
        replay_params.load(tmp_path / "p.yaml")
    (tmp_path / "p.yaml").write_bytes(b"\xff")
    with pytest.raises(ParamError, match="p.yaml: cannot be read: 'utf-8'"):
        replay_params.load(tmp_path / "p.yaml")
    (tmp_path / "p.yaml").write_text("")
    assert replay_params.load(tmp_path / "p.yaml") == (replay_params.ReplayParams(), [])


def test_the_parameters_of_the_node_serve_the_replay():
    settings, unused = replay_params.load(REPO / "config" / "localization.yaml")
    assert settings.start == replay_params.StartPose()
    assert "transform_tolerance" in unused
