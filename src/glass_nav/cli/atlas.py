"""glass_nav atlas: commands for atlases, a module for each. Need no robot."""

from __future__ import annotations

from typing import Any, Dict

from glass_nav.cli import atlas_build, atlas_check, atlas_explain, atlas_show, atlas_wake_up
from glass_nav.cli.parser import CommandGroup

HELP = "build, check and test an atlas"
DESCRIPTION = """Builds the atlas of a floor from its map, checks it, and tests how well a robot that wakes up there finds
out where it is. Needs no roscore."""
EXAMPLES = (
    "glass_nav atlas build floor.yaml --out atlas/floor",
    "glass_nav atlas show glass_office --out pictures",
)

MODULES: Dict[str, Any] = {
    "build": atlas_build,
    "show": atlas_show,
    "check": atlas_check,
    "explain": atlas_explain,
    "wake-up": atlas_wake_up,
}
_GROUP = CommandGroup("atlas_command", MODULES)
add_arguments, usage_error, main = _GROUP.add_arguments, _GROUP.usage_error, _GROUP.main
