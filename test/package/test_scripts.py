"""scripts/setup and scripts/demo refuse what they cannot do, in one line and before they change anything."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Tuple

import pytest

SCRIPTS = Path(__file__).parents[2] / "scripts"


def run(script: Path, *arguments: str) -> Tuple[int, str]:
    done = subprocess.run(
        [str(script), *arguments], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    return done.returncode, done.stdout.strip()


def test_setup_names_an_unknown_argument() -> None:
    assert run(SCRIPTS / "setup", "--develop") == (1, "setup: unknown argument '--develop', allowed: --dev")


def test_setup_refuses_a_path_that_catkin_cannot_build_in(tmp_path: Path) -> None:
    checkout = tmp_path / "my robot"
    (checkout / "scripts").mkdir(parents=True)
    shutil.copy(SCRIPTS / "setup", checkout / "scripts")
    assert run(checkout / "scripts" / "setup") == (
        1,
        f"setup: catkin cannot work below a path with spaces or ;$\", got '{checkout}': move the checkout",
    )
    assert not (checkout / ".build").exists()


def test_setup_of_another_user_says_that_it_cannot_write() -> None:
    with tempfile.TemporaryDirectory() as folder:
        checkout = Path(folder) / "checkout"
        (checkout / "scripts").mkdir(parents=True)
        shutil.copy(SCRIPTS / "setup", checkout / "scripts")
        os.chmod(folder, 0o755)
        checkout.chmod(0o555)
        nobody = (lambda: os.setuid(65534)) if os.getuid() == 0 else None
        done = subprocess.run(
            [str(checkout / "scripts" / "setup")], preexec_fn=nobody, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
        )
        checkout.chmod(0o755)
        assert not (checkout / ".build").exists()
    assert done.returncode == 1
    assert (
        done.stderr.decode()
        .strip()
        .endswith(
            f"cannot write to {checkout}/.build: use a checkout of your own, or source .build/env.bash where setup has finished"
        )
    )


@pytest.mark.parametrize(
    "folders, chosen",
    [
        pytest.param(["humble/share/rclpy"], "", id="ROS 2 only"),
        pytest.param(["humble/share/rclpy", "one/share/catkin"], "one", id="one beside ROS 2"),
        pytest.param(["one/share/catkin", "noetic"], "noetic", id="noetic first, even without catkin yet"),
        pytest.param([], "", id="nothing"),
    ],
)
def test_setup_finds_the_ros_1_of_a_machine(tmp_path: Path, folders: "list[str]", chosen: str) -> None:
    for folder in folders:
        (tmp_path / folder).mkdir(parents=True)
    command = f"source <(sed -n '/^ros_in()/,/^}}/p' {SCRIPTS}/setup); ros_in {tmp_path}"
    done = subprocess.run(["bash", "-c", command], stdout=subprocess.PIPE, text=True, check=True)
    assert done.stdout.strip() == chosen


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["--seed", "3"], "demo: unknown argument '--seed', allowed: --seeds N, --out DIR"),
        (["--seeds", "0"], "demo: --seeds must be a whole number >= 1, got '0'"),
        (["--seeds"], "demo: --seeds must be a whole number >= 1, got ''"),
    ],
)
def test_demo_names_a_wrong_argument(arguments: "list[str]", message: str) -> None:
    assert run(SCRIPTS / "demo", *arguments) == (2, message)


@pytest.mark.parametrize("script, words", [("demo", "--seeds 5"), ("test", "test/unit/geometry"), ("setup", "--dev")])
@pytest.mark.parametrize("option", ["--help", "-h"])
def test_each_script_explains_itself(script: str, words: str, option: str) -> None:
    code, out = run(SCRIPTS / script, option)
    assert code == 0 and words in out and "set -euo" not in out


NODES = (
    "amcl",
    "driver_node",
    "landmarks_node",
    "localization_node",
    "map_node",
    "scanner_node",
    "simulator_node",
    "topology_node",
)


@pytest.mark.parametrize("node", [*NODES, "bag_player", "wakeup_demo"])
def test_each_node_explains_itself_without_a_master(node: str) -> None:
    environment = {**os.environ, "ROS_MASTER_URI": "http://localhost:1"}
    done = subprocess.run(
        [sys.executable, str(SCRIPTS / node), "--help"], env=environment, stdout=subprocess.PIPE, text=True, timeout=60
    )
    assert done.returncode == 0
    assert "Parameters:" in done.stdout or "parameter" in done.stdout
