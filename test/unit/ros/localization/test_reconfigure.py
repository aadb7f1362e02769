"""What the running node tells dynamic_reconfigure's clients of its parameters."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
from dynamic_reconfigure.encoding import decode_config, decode_description

from glass_nav.ros.localization import reconfigure
from glass_nav.ros.localization.params import LocalizationParams, changeable

REPO = Path(__file__).parents[4]
VALUES = changeable(LocalizationParams())
EXPLAINED = reconfigure.explanations(REPO / "config" / "localization.yaml")


@pytest.fixture(scope="module")
def described():
    """Name -> what a client makes of the message."""
    tree = decode_description(reconfigure.description_msg(VALUES, EXPLAINED))
    groups = [tree, *tree["groups"].values()]
    return {each["name"]: each for group in groups for each in group["parameters"]}


def test_a_client_sees_every_parameter_with_its_type_and_value(described):
    assert set(described) == set(VALUES)
    for name, value in VALUES.items():
        assert described[name]["default"] == value
        assert described[name]["type"] == {bool: "bool", int: "int", float: "double", str: "str"}[type(value)]


def test_every_parameter_is_explained(described):
    assert not [name for name, each in described.items() if not each["description"]]
    assert described["transform_tolerance"]["description"] == (
        "[s] map -> odom is stamped ahead of the scan by this time; by more if the next scan comes later than that"
    )


def test_every_number_has_limits_and_its_default_lies_between_them(described):
    for name, each in described.items():
        if each["type"] in ("int", "double"):
            assert -1e7 < each["min"] <= each["default"] <= each["max"] < 1e7, name
            assert type(each["min"]) is type(each["max"]) is type(each["default"]), name
    assert (described["max_particles"]["min"], described["max_particles"]["max"]) == (1, 1_000_000)


def test_the_groups_are_the_sections_of_the_parameter_file():
    tree = decode_description(reconfigure.description_msg({**VALUES, reconfigure.RESTORE: False}, EXPLAINED))
    assert [each["name"] for each in tree["parameters"]] == [reconfigure.RESTORE]
    groups = tree["groups"]
    assert list(groups)[:2] == ["frames and tf", "laser"]
    assert [each["name"] for each in groups["particles"]["parameters"]] == [
        "min_particles",
        "max_particles",
        "kld_err",
        "kld_z",
    ]
    values = decode_config(reconfigure.config_msg(VALUES, list(groups)), tree)
    assert list(values["groups"]["groups"]) == list(groups)
    assert [group["id"] for group in values["groups"]["groups"].values()] == [group["id"] for group in groups.values()]


@pytest.mark.parametrize(
    "name, value", [("vote_mode", "paper"), ("weight_mode", "ranges"), ("odom_model_type", "omni-corrected")]
)
def test_a_parameter_of_few_values_is_a_choice(described, name, value):
    choices = ast.literal_eval(described[name]["edit_method"])["enum"]
    assert value in [choice["value"] for choice in choices]
    assert all(set(choice) >= {"name", "value", "type", "description"} for choice in choices)


def test_without_the_file_nothing_is_explained():
    assert reconfigure.explanations(None) == {} == reconfigure.explanations(Path("/nowhere"))


def test_the_values_of_a_message_keep_their_types():
    from dynamic_reconfigure.encoding import encode_config

    given = {"a": True, "b": 2, "c": 0.5, "d": "x"}
    msg = encode_config(given)
    assert decode_config(msg) == given
    found = reconfigure._values_from_msg(msg)
    assert found == given and [type(found[name]) for name in "abcd"] == [bool, int, float, str]
