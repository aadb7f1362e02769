"""The command glass_nav as such: version, help with examples, suggestions, completion, and what --out means."""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from glass_nav.cli import main as cli
from glass_nav.cli import out_file

REPO = Path(__file__).parents[3]
COMMANDS = [
    ["atlas"],
    *(["atlas", name] for name in ("build", "show", "check", "explain", "wake-up")),
    ["compare"],
    ["doctor"],
    ["landmarks", "limits"],
    ["landmarks", "plan"],
    ["locate"],
    ["params"],
    ["replay"],
    ["report"],
    ["simulate"],
]


def test_the_version_is_that_of_the_package(run):
    version = re.search("<version>(.*)</version>", (REPO / "package.xml").read_text())[1]
    assert run("--version") == (0, f"glass_nav {version}\n", "")


def test_the_bare_command_prints_its_help(run):
    code, out, err = run()
    assert (code, err) == (2, "")
    assert out.startswith("usage: glass_nav") and "replay" in out


@pytest.mark.parametrize("command", [[], *COMMANDS], ids=" ".join)
def test_each_help_ends_with_two_examples_that_are_understood(command, run, monkeypatch):
    code, out, _ = run(*command, "--help")
    examples = out[out.index("\nexamples:\n") :].splitlines()[2:]
    assert (code, len(examples)) == (0, 2)
    parsed = []
    monkeypatch.setattr(cli, "_run", lambda program, module, arguments: parsed.append(arguments) or 0)
    for example in examples:
        words = example.split(" > ")[0].split()
        assert words[: 1 + len(command)] == ["glass_nav", *command]
        assert run(*words[1:])[0] == 0, example
    assert len(parsed) == 2


@pytest.mark.parametrize(
    "words, line",
    [
        (["replya", "x.bag"], "glass_nav: unknown command 'replya'; did you mean replay?"),
        (["atlas", "wakeup"], "glass_nav atlas: unknown command 'wakeup'; did you mean wake-up?"),
        (["atlas", "xyz"], "glass_nav atlas: unknown command 'xyz'; it has build, show, check, explain, wake-up"),
    ],
)
def test_a_mistyped_subcommand_gets_a_suggestion(words, line, run):
    assert run(*words) == (2, "", line + "\n")


def test_tab_completes_subcommands_and_options(tmp_path):
    """As bash asks: COMP_LINE and COMP_POINT in, the words on descriptor 8 out."""
    pytest.importorskip("argcomplete", reason="argcomplete (apt: python3-argcomplete) is not here")

    def completed(line):
        answer = tmp_path / "answer"
        environment = {
            **os.environ,
            "_ARGCOMPLETE": "1",
            "_ARGCOMPLETE_SUPPRESS_SPACE": "1",
            "COMP_LINE": line,
            "COMP_POINT": str(len(line)),
            "_ARGCOMPLETE_STDOUT_FILENAME": str(answer),
            "IFS": "\n",
            "_ARGCOMPLETE_IFS": "\n",
        }
        command = f"exec {sys.executable} {REPO}/scripts/glass_nav 8>{answer} 9>/dev/null"
        subprocess.run(["bash", "-c", command], env=environment, check=True)
        return [word.strip() for word in answer.read_text().split("\n")]

    assert completed("glass_nav rep") == ["replay", "report"]
    assert "--initial-pose" in completed("glass_nav replay --ini")


def test_bash_finds_the_mark_of_a_command_that_completes():
    assert "PYTHON_ARGCOMPLETE_OK" in (REPO / "scripts" / "glass_nav").read_text()[:1024]


def test_without_argcomplete_there_is_no_completion_and_no_error(monkeypatch):
    monkeypatch.setitem(sys.modules, "argcomplete", None)  # an import of it fails
    cli.complete(argparse.ArgumentParser())


@pytest.mark.parametrize(
    "command", [each for each in COMMANDS if each not in (["atlas"], ["doctor"], ["params"])], ids=" ".join
)
def test_out_is_a_folder_in_every_subcommand_that_writes(command, run):
    _, out, _ = run(*command, "--help")
    if command in (["atlas", "check"], ["atlas", "explain"], ["landmarks", "limits"]):
        assert "--out" not in out
    else:
        assert "--out DIR" in out


def test_one_file_goes_into_the_folder_or_has_the_name_that_was_given(tmp_path):
    assert out_file.in_folder(tmp_path / "new", "a.png") == tmp_path / "new" / "a.png"
    assert (tmp_path / "new").is_dir()
    assert out_file.in_folder(tmp_path / "deep" / "b.png", "a.png") == tmp_path / "deep" / "b.png"
    assert (tmp_path / "deep").is_dir()
    (tmp_path / "folder.png").mkdir()
    assert out_file.in_folder(tmp_path / "folder.png", "a.png") == tmp_path / "folder.png" / "a.png"


def test_wake_up_writes_into_a_folder_that_exists(run, tmp_path):
    code, out, err = run("atlas", "wake-up", "document_example", "--trials", "1", "--out", tmp_path)
    assert (code, "Is a directory" in err) == (0, False)
    assert (tmp_path / "metrics.json").is_file() and "written to" in out


def test_a_report_of_nothing_says_that_it_does_not_exist(run, tmp_path):
    code, _, err = run("report", "nothing", "--out", tmp_path / "out")
    assert (code, err) == (3, "glass_nav report: nothing: does not exist\n")


@pytest.mark.parametrize("command", ["replay", "report", "doctor"])
def test_a_yaml_given_as_bag_is_not_a_bag(command, run, tmp_path, room_map):
    options = [] if command == "doctor" else ["--map", room_map, "--out", tmp_path / "out"]
    code, _, err = run(command, room_map, *options)
    assert code == 3 and f"{room_map.name}: is not a bag" in err
