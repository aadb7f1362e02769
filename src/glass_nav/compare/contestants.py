"""The contestants of a comparison: results of replays, parameters, or poses recorded in a log."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Dict, List, Optional, Sequence, Tuple

DEFAULT = "default"
RECORDED = ("topic:", "tf:")


@dataclass(frozen=True)
class Contestant:
    """A contestant: exactly one of results, parameters, recorded is set."""

    name: str
    results: Tuple[Path, ...] = ()  # folders of replays, a run each
    params: Optional[Path] = None  # None and nothing else: the defaults
    recorded: Optional[str] = None  # "topic:/amcl_pose", "tf:map"

    @property
    def runs(self) -> bool:
        """Whether there is something to run, over logs."""
        return not self.results

    def __str__(self) -> str:
        if self.results:
            return "results " + ", ".join(map(str, self.results))
        if self.recorded:
            return f"recorded poses, {self.recorded}"
        return "the defaults" if self.params is None else f"parameters {self.params}"


def parse(texts: Sequence[str]) -> List[Contestant]:
    """The contestants of the command line, `[NAME=]WHAT` each; folders with one name are runs of one contestant.

    Raises:
        ValueError: a name twice, or what is none of the kinds; one line.
    """
    found: Dict[str, Contestant] = {}
    for text in texts:
        name, what = _named(text)
        contestant = _contestant(name, what)
        if name in found:
            if found[name].runs or contestant.runs:
                raise ValueError(f"two contestants are named {name}: give them names, NAME={what}")
            contestant = Contestant(name, found[name].results + contestant.results)
        found[name] = contestant
    return list(found.values())


def _named(text: str) -> Tuple[str, str]:
    name, mark, what = text.partition("=")
    if mark and not os.path.exists(text):
        if not name or not what:
            raise ValueError(f"expected NAME=WHAT, got '{text}'")
        return name, what
    return text.rstrip("/"), text


def _contestant(name: str, what: str) -> Contestant:
    if what == DEFAULT:
        return Contestant(name)
    if what.startswith(RECORDED):
        if not what.partition(":")[2]:
            raise ValueError(f"expected topic:/TOPIC or tf:FRAME, got '{what}'")
        return Contestant(name, recorded=what)
    if what.endswith((".yaml", ".yml")):
        return Contestant(name, params=Path(what))
    if Path(what).is_dir():
        return Contestant(name, (Path(what),))
    raise ValueError(
        f"{what}: expected a folder of results, a .yaml of parameters, '{DEFAULT}', topic:/TOPIC or tf:FRAME"
    )
