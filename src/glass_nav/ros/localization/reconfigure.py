"""The protocol of dynamic_reconfigure, so that rqt_reconfigure and dynparam tune the running node.

The dataclasses of the parameters define what can be changed, and to what; there is no .cfg file. dynamic_reconfigure's
own server is not used: it silently clamps values that are out of range, and writes every default to the parameter
server, where it looks as if somebody had set it.
"""

from __future__ import annotations

import re
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Callable, Dict, List, Mapping, Optional

import rospy
from dynamic_reconfigure.encoding import encode_config, encode_description
from dynamic_reconfigure.msg import Config, ConfigDescription
from dynamic_reconfigure.srv import Reconfigure, ReconfigureRequest, ReconfigureResponse

from glass_nav import amcl_parameters, params
from glass_nav.localization.beam_classification.case_votes import VOTE_MODES
from glass_nav.localization.particle_filter.importance_weights import WEIGHT_MODES
from glass_nav.localization.particle_filter.motion import MODELS
from glass_nav.params import ParamError

RESTORE = "restore_defaults"  # AMCL's: back to the values at the start
CHOICES = {"vote_mode": VOTE_MODES, "weight_mode": WEIGHT_MODES, "odom_model_type": MODELS}
_TYPES = {bool: "bool", int: "int", float: "double", str: "str"}
_UNBOUNDED = {bool: (False, True), int: (-(2**31), 2**31 - 1), float: (float("-inf"), float("inf")), str: ("", "")}
_EXPLAINED = re.compile(r"(\w+):.*?\s#\s*(.*)")

Apply = Callable[[Dict[str, Any]], None]


class ReconfigureServer:
    """The parameters by name, and the service that changes them."""

    def __init__(self, values: Mapping[str, Any], descriptions: Mapping[str, str], apply: Apply) -> None:
        """
        Args:
            values: name -> value of those that can be changed: bool, int, float or str.
            descriptions: their meanings, as far as known.
            apply: called by other threads with all values; raises ValueError for invalid ones.
        """
        self._lock = threading.Lock()
        self._values = dict(values)
        self._started_with = dict(values)
        self._apply = apply
        self._descriptions = rospy.Publisher("~parameter_descriptions", ConfigDescription, queue_size=1, latch=True)
        self._updates = rospy.Publisher("~parameter_updates", Config, queue_size=1, latch=True)
        self._descriptions.publish(description_msg({**values, RESTORE: False}, descriptions))
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
        """The changed values; ValueError if one is invalid: then none is applied."""
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
        msg = encode_config({**self._values, RESTORE: False, "groups": _GROUP})
        self._updates.publish(msg)
        return msg


_GROUP: Dict[str, Any] = {
    "name": "Default",
    "type": "",
    "state": True,
    "cstate": "true",
    "id": 0,
    "parent": 0,
    "parameters": [],
    "groups": {},
}


def description_msg(values: Mapping[str, Any], descriptions: Mapping[str, str]) -> ConfigDescription:
    """What can be changed, for the clients. No bounds: clients would clamp a value that the node should reject."""
    group: Dict[str, Any] = dict(
        _GROUP,
        groups=[],
        parameters=[
            {
                "name": name,
                "type": _TYPES[type(value)],
                "level": 0,
                "description": descriptions.get(name, ""),
                "edit_method": _edit_method(name),
            }
            for name, value in values.items()
        ],
    )
    bounds = {name: _UNBOUNDED[type(value)] for name, value in values.items()}
    return encode_description(
        SimpleNamespace(
            config_description=group,
            defaults=dict(values),
            min={name: low for name, (low, _) in bounds.items()},
            max={name: high for name, (_, high) in bounds.items()},
        )
    )


def _edit_method(name: str) -> str:
    """For rqt_reconfigure: the possible values, as the Python text that it evaluates."""
    if name not in CHOICES:
        return ""
    return str(
        {
            "enum": [{"name": choice, "value": choice, "type": "str", "description": ""} for choice in CHOICES[name]],
            "enum_description": name,
        }
    )


def _values_from_msg(msg: Config) -> Dict[str, Any]:
    """Name -> value of all that the message sets."""
    return {
        each.name: kind(each.value)
        for kind, group in ((bool, msg.bools), (int, msg.ints), (float, msg.doubles), (str, msg.strs))
        for each in group
    }


def explanations(path: Optional[Path]) -> Dict[str, str]:
    """Name -> comment in a parameter file of ours, `name: value  # comment`, continued in lines with only a comment."""
    if path is None or not path.is_file():
        return {}
    found: Dict[str, List[str]] = {}
    last: List[str] = []
    for line in path.read_text(encoding="utf-8").splitlines():
        match = _EXPLAINED.match(line)
        if match:
            last = found.setdefault(match.group(1), [match.group(2).strip()])
        elif line.startswith("    ") and line.strip().startswith("#"):
            last.append(line.strip("# "))
        else:
            last = []
    return {name: " ".join(lines) for name, lines in found.items()}
