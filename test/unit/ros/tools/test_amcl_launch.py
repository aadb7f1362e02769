from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from glass_nav import amcl_parameters, params
from glass_nav.cli import main as cli
from glass_nav.replay import replay_params
from glass_nav.ros.localization.params import LocalizationParams
from glass_nav.ros.tools import amcl_launch

LAUNCH_FILES = Path(__file__).resolve().parents[3] / "rostest" / "amcl_launch"
LAUNCH = """<launch>
  <arg name="particles" default="900"/>
  <arg name="robot" default="r2"/>
  <group ns="$(arg robot)">
    <include file="$(dirname)/amcl.launch"><arg name="particles" value="$(arg particles)"/></include>
  </group>
</launch>
"""
INCLUDED = """<launch>
  <arg name="particles"/>
  <node pkg="amcl" type="amcl" name="amcl">
    <rosparam command="load" file="$(dirname)/amcl.yaml"/>
    <param name="max_particles" value="$(eval int(arg('particles')) + 1)"/>
    <param name="laser_model_type" value="beam"/>
    <param name="odom_frame" value="odom_combined"/>
    <remap from="scan" to="base_scan"/>
  </node>
</launch>
"""


@pytest.fixture
def launch(tmp_path):
    (tmp_path / "robot.launch").write_text(LAUNCH)
    (tmp_path / "amcl.launch").write_text(INCLUDED)
    (tmp_path / "amcl.yaml").write_text("update_min_d: 0.25\nbase_frame_id: base_footprint\nlaser_max_beams: 30\n")
    return tmp_path / "robot.launch"


def printed(capsys, *arguments):
    code = cli.main(["params", *(str(argument) for argument in arguments)])
    out, err = capsys.readouterr()
    return code, out, err


def test_includes_args_groups_and_files_mean_what_they_mean_to_roslaunch(launch, capsys):
    code, out, err = printed(capsys, "--from-amcl", launch, "particles:=1500")
    assert (code, err) == (0, "")
    assert yaml.safe_load(out) == {
        "update_min_d": 0.25,
        "base_frame_id": "base_footprint",
        "laser_max_beams": 30,
        "max_particles": 1501,
    }
    lines = out.splitlines()
    assert lines[0] == f"# {launch}: node /r2/amcl (amcl/amcl)"
    assert (
        "# laser_model_type: beam  # there is one sensor model here; vote_mode says how beams are told apart"
    ) in lines
    assert "# unknown parameter ~odom_frame" in lines
    assert lines[-1] == "# remaps stay in the launch file: scan -> base_scan"


@pytest.mark.parametrize("name", ["turtlebot3", "fetch"])
def test_what_is_printed_serves_the_replay(capsys, tmp_path, name):
    code, out, _ = printed(capsys, "--from-amcl", LAUNCH_FILES / f"{name}.launch")
    assert code == 0
    (tmp_path / "ours.yaml").write_text(out)
    loaded, _ = replay_params.load(tmp_path / "ours.yaml")
    assert loaded.localizer.count.max_particles == {"turtlebot3": 3000, "fetch": 2000}[name]


def test_every_parameter_of_amcl_is_taken_or_has_a_reason():
    assert set(amcl_launch.WHY_UNUSED) == amcl_parameters.NAMES - set(params.names(LocalizationParams))
    assert all(amcl_launch.WHY_UNUSED.values())


def test_a_default_that_the_file_contradicts_gives_way_and_is_told():
    node = amcl_launch.AmclNode("/amcl", "amcl/amcl", {"max_particles": 100}, [])
    assert yaml.safe_load(amcl_launch.explained(node, "x.launch")) == {"max_particles": 100, "min_particles": 100}
    assert "min_particles: 100  # not in the file; the default would contradict" in amcl_launch.explained(node, "x")


@pytest.mark.parametrize(
    "text, arguments, line",
    [
        (
            "<launch><node pkg='a' type='b' name='c'/></launch>",
            [],
            "FILE: starts no amcl, by type one of amcl, localization_node",
        ),
        (
            "<launch><node pkg='amcl' type='amcl' name='a'/><node pkg='amcl' type='amcl' name='b'/></launch>",
            [],
            "FILE: starts 2 amcl (/a, /b), choose one with --node",
        ),
        (
            "<launch><node pkg='amcl' type='amcl' name='a'/></launch>",
            ["--node", "c"],
            "FILE: starts no amcl of the name c; it starts /a",
        ),
        (
            "<launch><node pkg='amcl' type='amcl' name='a'><param name='max_particles' value='-3'/></node></launch>",
            [],
            None,
        ),
        ("<launch><include file='$(find no_such_package)/x.launch'/></launch>", [], None),
        ("<launch><arg name='map'/></launch>", [], None),
        ("<launch>", [], None),
    ],
)
def test_a_file_that_cannot_be_used_is_one_line(tmp_path, capsys, text, arguments, line):
    path = tmp_path / "x.launch"
    path.write_text(text)
    code, out, err = printed(capsys, "--from-amcl", path, *arguments)
    assert (code, out) == (3, "")
    assert len(err.splitlines()) == 1
    assert err.startswith(f"glass_nav params: {path}: ")
    if line is not None:
        assert err == f"glass_nav params: {line.replace('FILE', str(path))}\n"


def test_a_file_that_is_not_there_and_an_arg_that_is_none(tmp_path, capsys):
    assert printed(capsys, "--from-amcl", tmp_path / "no.launch") == (
        3,
        "",
        f"glass_nav params: {tmp_path / 'no.launch'}: does not exist\n",
    )
    assert printed(capsys, "--from-amcl", "x.launch", "rate=3") == (
        2,
        "",
        "glass_nav params: args of the launch file are given as ARG:=VALUE, got 'rate=3'\n",
    )
