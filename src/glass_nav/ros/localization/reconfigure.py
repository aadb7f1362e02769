"""The protocol of dynamic_reconfigure, so that rqt_reconfigure and dynparam tune the running node.

The dataclasses of the parameters define what can be changed, and to what; there is no .cfg file. dynamic_reconfigure's
own server is not used: it silently clamps values that are out of range, and writes every default to the parameter
server, where it looks as if it had been set.
"""

from __future__ import annotations

import re
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence

import rospy
from dynamic_reconfigure.encoding import encode_config, encode_description
from dynamic_reconfigure.msg import Config, ConfigDescription
from dynamic_reconfigure.srv import Reconfigure, ReconfigureRequest, ReconfigureResponse

from glass_nav import amcl_parameters, params
from glass_nav.params import ParamError
from glass_nav.ros.localization.params import LocalizationParams

RESTORE = "restore_defaults"  # AMCL's: back to the values at the start
_TYPES = {bool: "bool", int: "int", float: "double", str: "str"}
_UNBOUNDED = {bool: (False, True), int: (-(2**31), 2**31 - 1), float: (float("-inf"), float("inf")), str: ("", "")}
_EXPLAINED = re.compile(r"(\w+):.*?\s#\s*(.*)")
_SECTION = re.compile(r"# -- (.+)")

Apply = Callable[[Dict[str, Any]], None]


class Explained(NamedTuple):
    """The explanation of a parameter in a file of config/."""

    section: str
    comment: str


class ReconfigureServer:
    """The parameters by name, and the service that changes them."""

    def __init__(self, values: Mapping[str, Any], explained: Mapping[str, Explained], apply: Apply) -> None:
        """
        Args:
            values: name -> value of those that can be changed: bool, int, float or str.
            explained: their groups and meanings, as far as known.
            apply: called by other threads with all values; raises ValueError for invalid ones.
        """
        self._lock = threading.Lock()
        self._values = dict(values)
        self._started_with = dict(values)
        self._apply = apply
        self._groups = _groups(self._values, explained)
        self._descriptions = rospy.Publisher("~parameter_descriptions", ConfigDescription, queue_size=1, latch=True)
        self._updates = rospy.Publisher("~parameter_updates", Config, queue_size=1, latch=True)
        self._descriptions.publish(description_msg({**values, RESTORE: False}, explained))
        self._publish()
        rospy.Service("~set_parameters", Reconfigure, self._serve)

    def _serve(self, request: ReconfigureRequest) -> ReconfigureResponse:
        with self._lock:
            try:
                self._change(_values_from_msg(request.config))
            except (ValueError, TimeoutError) as err:
                rospy.logwarn(f"parameters stay as they are: {err}")
                self._publish()  # so that a client shows the values in effect
                raise rospy.ServiceException(str(err)) from err
            return ReconfigureResponse(self._publish())

    def _change(self, wanted: Dict[str, Any]) -> None:
        """Apply the changed values; ValueError, and no change, if one is invalid."""
        values = dict(self._started_with if wanted.pop(RESTORE, False) else self._values)
        unused = sorted(amcl_parameters.NAMES.intersection(wanted).difference(values))
        if unused:
            rospy.loginfo(f"parameters of amcl that cannot be changed here: ~{', ~'.join(unused)}")
        for name in unused:
            del wanted[name]
        for name in wanted:
            if name not in values:
                raise ParamError(params.unknown(name, values, rospy.get_name()))
        values.update(wanted)
        self._apply(values)
        changed = {name: value for name, value in values.items() if value != self._values[name]}
        self._values = values
        for name, value in changed.items():
            rospy.set_param(f"~{name}", value)
        if changed:
            rospy.loginfo("parameters now: " + ", ".join(f"{name} {value}" for name, value in changed.items()))

    def _publish(self) -> Config:
        """Publish the values in effect."""
        msg = config_msg({**self._values, RESTORE: False}, self._groups)
        self._updates.publish(msg)
        return msg


def description_msg(values: Mapping[str, Any], explained: Mapping[str, Explained]) -> ConfigDescription:
    """The description for clients: types, limits, choices, groups."""
    limits, choices = params.limits(LocalizationParams), params.choices(LocalizationParams)
    bounds = {
        name: tuple(type(value)(limit) for limit in limits.get(name, _UNBOUNDED[type(value)]))
        for name, value in values.items()
    }
    of_group: Dict[str, List[Dict[str, Any]]] = {}
    for name, value in values.items():
        section, comment = explained.get(name, Explained("", ""))
        of_group.setdefault(section, []).append(
            {
                "name": name,
                "type": _TYPES[type(value)],
                "level": 0,
                "description": comment,
                "edit_method": _edit_method(name, choices[name]) if name in choices else "",
            }
        )
    groups = [
        {**_group(section, number), "parameters": of_group[section], "groups": []}
        for number, section in enumerate(_groups(values, explained), start=1)
    ]
    return encode_description(
        SimpleNamespace(
            config_description={**_group("Default", 0), "parameters": of_group.get("", []), "groups": groups},
            defaults=dict(values),
            min={name: low for name, (low, _) in bounds.items()},
            max={name: high for name, (_, high) in bounds.items()},
        )
    )


def config_msg(values: Mapping[str, Any], groups: List[str]) -> Config:
    """The values in effect, and the groups, all of which are open."""
    tree = {section: {**_group(section, number), "groups": {}} for number, section in enumerate(groups, start=1)}
    return encode_config({**values, "groups": {**_group("Default", 0), "groups": tree}})


def _groups(values: Mapping[str, Any], explained: Mapping[str, Explained]) -> List[str]:
    """Sections of the parameter file that contain these values, in its order."""
    return list(dict.fromkeys(each.section for name, each in explained.items() if each.section and name in values))


def _group(name: str, number: int) -> Dict[str, Any]:
    return {"name": name, "type": "", "state": True, "cstate": "true", "id": number, "parent": 0}


def _edit_method(name: str, choices: Sequence[str]) -> str:
    """The possible values as Python text, which rqt_reconfigure evaluates."""
    return str(
        {
            "enum": [{"name": choice, "value": choice, "type": "str", "description": ""} for choice in choices],
            "enum_description": name,
        }
    )


def _values_from_msg(msg: Config) -> Dict[str, Any]:
    """Name -> value of every parameter in the message."""
    return {
        each.name: kind(each.value)
        for kind, group in ((bool, msg.bools), (int, msg.ints), (float, msg.doubles), (str, msg.strs))
        for each in group
    }


def explanations(path: Optional[Path]) -> Dict[str, Explained]:
    """Name -> what a parameter file of ours says: `name: value  # comment`, continued in lines with only a comment, below
    the line `# -- section`.
    """
    if path is None or not path.is_file():
        return {}
    found: Dict[str, Explained] = {}
    section = last = ""
    for line in path.read_text(encoding="utf-8").splitlines():
        heading, match = _SECTION.match(line), _EXPLAINED.match(line)
        if heading:
            section, last = heading.group(1).strip(), ""
        elif match:
            last = match.group(1)
            found[last] = Explained(section, match.group(2).strip())
        elif last and line.startswith("    ") and line.strip().startswith("#"):
            found[last] = Explained(section, f"{found[last].comment} {line.strip('# ')}")
        else:
            last = ""
    return found
