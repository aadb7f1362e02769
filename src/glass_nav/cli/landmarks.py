"""glass_nav landmarks: commands for landmarks that give bearings, a module for each."""

from __future__ import annotations

from typing import Any, Dict

from glass_nav.cli import landmark_limits, landmark_plan
from glass_nav.cli.parser import CommandGroup

HELP = "plan where to place landmarks"
DESCRIPTION = """Expected errors of positions from bearings to landmarks: all over a map, with the best places for more
landmarks, or for three landmarks and a step angle of the sensor. Needs no roscore."""
EXAMPLES = (
    "glass_nav landmarks plan floor.yaml landmarks.yaml --out plan",
    "glass_nav landmarks limits --tags 0 0 6 0 3 5 --at 3 2 --step-deg 1",
)

MODULES: Dict[str, Any] = {"plan": landmark_plan, "limits": landmark_limits}
_GROUP = CommandGroup("landmark_command", MODULES)
add_arguments, usage_error, main = _GROUP.add_arguments, _GROUP.usage_error, _GROUP.main
