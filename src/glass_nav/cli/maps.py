"""glass_nav map: commands for glass that a map lacks, a module for each."""

from __future__ import annotations

from typing import Any, Dict

from glass_nav.cli import map_draw, map_panes, map_show
from glass_nav.cli.parser import CommandGroup

HELP = "find the glass that a map lacks, and draw it in"
DESCRIPTION = """Mappers erase panes because beams pass them. These commands find the missing panes in recorded
drives, draw them into a copy of the map, and show the result. Needs no roscore."""
EXAMPLES = (
    "glass_nav map panes run.bag --map floor.yaml --out with_glass",
    "glass_nav map draw floor.yaml --pane 1.2 0.5 4.8 0.5 --out with_glass",
)

MODULES: Dict[str, Any] = {"panes": map_panes, "draw": map_draw, "show": map_show}
_GROUP = CommandGroup("map_command", MODULES)
add_arguments, usage_error, main = _GROUP.add_arguments, _GROUP.usage_error, _GROUP.main
