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
        "# laser_model_type: beam  # there is one sensor model here; vote_mode selects how beams are classified"
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


def test_a_default_that_the_file_contradicts_gives_way_and_is_reported():
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


AMCL = "<node pkg='amcl' type='amcl' name='amcl'><param name='max_particles' value='%s'/></node>"


@pytest.mark.parametrize(
    "tags, reason",
    [
        pytest.param(
            "<arg name='count'/>" + AMCL % "$(arg count)", "needs the arg 'count', give count:=VALUE", id="arg"
        ),
        pytest.param(AMCL % "$(arg count)", "needs the arg 'count', give count:=VALUE", id="an arg never declared"),
        pytest.param(
            AMCL % "$(eval arg(&quot;count&quot;) + 1)", "needs the arg 'count', give count:=VALUE", id="arg in eval"
        ),
        pytest.param(
            "<group ns='a'>" + AMCL % "$(arg count)" + "</group>", "needs the arg 'count', give", id="in a group"
        ),
        pytest.param(AMCL % "$(env NO_SUCH_VARIABLE)", "environment variable 'NO_SUCH_VARIABLE' is not set", id="env"),
        pytest.param(AMCL % "$(find no_such_package)", "$(find no_such_package): there is no such package", id="find"),
        pytest.param(AMCL % "$(eval no_such_name)", "name 'no_such_name' is not defined", id="eval"),
        pytest.param("<node pkg='amcl' type='amcl' if='perhaps' name='a'/>", "perhaps is not a 'bool' type", id="if"),
        pytest.param("<group unless='$(arg sim)'/>", "needs the arg 'sim', give sim:=VALUE", id="unless"),
        pytest.param("<include/>", "a tag lacks the attribute 'file'", id="an include of nothing"),
        pytest.param(
            "<rosparam command='load' file='no.yaml'/>",
            "error loading <rosparam> tag: file does not exist [no.yaml]",
            id="no such yaml",
        ),
        pytest.param("<node pkg='amcl'>", "Invalid roslaunch XML syntax: mismatched tag", id="bad XML"),
    ],
)
@pytest.mark.parametrize("included", [False, True])
def test_each_fault_of_a_launch_file_names_the_file_that_it_is_in(tmp_path, capsys, tags, reason, included):
    faulty = tmp_path / "faulty.launch"
    faulty.write_text(f"<launch>{tags}</launch>")
    (tmp_path / "middle.launch").write_text("<launch><include file='$(dirname)/faulty.launch'/></launch>")
    (tmp_path / "top.launch").write_text("<launch><include file='$(dirname)/middle.launch'/></launch>")
    code = amcl_launch.main([str(tmp_path / "top.launch" if included else faulty)])
    out, err = capsys.readouterr()
    assert (code, out) == (3, "")
    assert err.startswith(f"glass_nav params: {faulty}: {reason}") and err.count("\n") == 1


def test_an_included_file_that_is_missing_or_includes_itself_is_named(tmp_path, capsys):
    top, itself = tmp_path / "top.launch", tmp_path / "itself.launch"
    top.write_text("<launch><include file='$(dirname)/no.launch'/></launch>")
    itself.write_text("<launch><include file='$(dirname)/itself.launch'/></launch>")
    amcl_launch.main([str(top)])
    assert capsys.readouterr().err == f"glass_nav params: {tmp_path / 'no.launch'}: does not exist\n"
    amcl_launch.main([str(itself)])
    assert capsys.readouterr().err == f"glass_nav params: {itself}: is included by itself\n"


def test_values_that_amcl_ignores_are_left_out_with_a_comment():
    values = {"initial_cov_xx": "0.5*0.5", "max_particles": 1500.6, "tf_broadcast": 1, "update_min_d": 0.3}
    text = amcl_launch.explained(amcl_launch.AmclNode("/amcl", "amcl/amcl", values, []), "x.launch")
    assert yaml.safe_load(text) == {"max_particles": 1501, "update_min_d": 0.3}
    assert "# ~initial_cov_xx must be float, got '0.5*0.5'; not used, as by amcl: the default is 0.25" in text
    with pytest.raises(params.ParamError, match="~initial_cov_xx must be float"):
        amcl_launch.explained(amcl_launch.AmclNode("/a", "glass_nav/localization_node", values, []), "x.launch")


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
