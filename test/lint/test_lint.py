"""The linters, each as a test: the commands are the hooks of .pre-commit-config.yaml."""

from __future__ import annotations

import os
import shlex
import subprocess
from pathlib import Path
from typing import Any, Dict

import numpy as np
import pytest
import yaml

REPO = Path(__file__).parents[2]
CONFIG = yaml.safe_load((REPO / ".pre-commit-config.yaml").read_text())
HOOKS = [hook for repo in CONFIG["repos"] for hook in repo["hooks"]]
WORKFLOW = yaml.safe_load((REPO / ".github" / "workflows" / "ci.yaml").read_text())


@pytest.mark.skipif(not (REPO / ".build" / "ws").exists(), reason="no catkin workspace: run by scripts/test")
@pytest.mark.parametrize("hook", HOOKS, ids=lambda hook: hook["id"])
def test_hook(hook: Dict[str, Any]) -> None:
    if hook["id"] == "mypy" and int(np.__version__.split(".")[0]) > 1:
        pytest.skip("the code is annotated for numpy 1; the types of numpy 2 are others")
    done = subprocess.run(
        shlex.split(hook["entry"]),
        cwd=REPO,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**os.environ, "NO_COLOR": "1"},
    )
    if done.returncode:
        print(done.stdout)
        pytest.fail(f"exit code {done.returncode}: {hook['entry']}", pytrace=False)


def test_no_linter_is_missing() -> None:
    assert [hook["id"] for hook in HOOKS] == [
        "ruff",
        "ruff-format",
        "mypy",
        "clang-format",
        "catkin-lint",
        "yamllint",
        "shellcheck",
        "hadolint",
    ]


def test_hooks_download_nothing_and_look_at_the_whole_checkout() -> None:
    assert [repo["repo"] for repo in CONFIG["repos"]] == ["local"]
    for hook in HOOKS:
        assert (hook["language"], hook["always_run"], hook["pass_filenames"]) == ("system", True, False), hook["id"]


@pytest.mark.parametrize("script", ["scripts/setup", "scripts/demo", "scripts/test", ".ci/run"])
def test_scripts_may_be_executed(script: str) -> None:
    assert os.access(REPO / script, os.X_OK)


def test_the_workflow_runs_all_of_ci_on_every_platform() -> None:
    (job,) = WORKFLOW["jobs"].values()
    assert job["strategy"]["matrix"]["image"] == ["debian:12", "debian:11", "debian:13", "ros:noetic"]
    assert job["container"] == "${{ matrix.image }}"
    assert [step["run"] for step in job["steps"] if "run" in step] == [".ci/run"]
    assert job["steps"][0]["uses"].startswith("actions/checkout@")
