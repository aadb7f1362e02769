"""Good files -> the same files cut short or with bytes changed, and every subcommand that reads such a file."""

from __future__ import annotations

from pathlib import Path
from typing import Dict, Iterator, List, Tuple

import numpy as np

SHARES = (0.01, 0.1, 0.5, 0.99)  # that is left of a file which is cut short
CHANGED_BYTES = 100
# Role of a file -> subcommands; FILE is the file, BAG, MAP and OUT a good bag, a good map and a new folder.
COMMANDS: Dict[str, Tuple[str, ...]] = {
    "bag": (
        "replay FILE --map MAP --max-scans 2 --out OUT",
        "doctor FILE",
        "compare default --log FILE=MAP --max-scans 2 --out OUT",
        "locate --scan FILE --map MAP --pose 0 0 0 --out OUT/x.png",
        "map panes FILE --map MAP --out OUT",
    ),
    "map": (
        "replay BAG --map FILE --max-scans 2 --out OUT",
        "atlas build FILE --out OUT/atlas.json",
        "map show FILE --out OUT/x.png",
        "locate --scan BAG --map FILE --pose 0 0 0 --out OUT/x.png",
        "doctor BAG --map FILE",
    ),
    "panes": ("map show MAP --panes FILE --out OUT/x.png", "map draw MAP --panes FILE --out OUT"),
    "atlas": ("atlas check FILE", "atlas show FILE --out OUT/x.png", "atlas explain FILE"),
    "landmarks": ("landmarks plan MAP FILE --out OUT",),
    "parameters": (
        "replay BAG --map MAP --params FILE --max-scans 2 --out OUT",
        "compare FILE --log BAG=MAP --max-scans 2 --out OUT",
        "params --from-amcl FILE",
    ),
    "trajectory": ("replay BAG --map MAP --ground-truth FILE --max-scans 2 --out OUT",),
}


def corrupted(data: bytes, seed: int) -> "Iterator[Tuple[str, bytes]]":
    """What was done to the data, and the result."""
    for share in SHARES:
        yield f"cut at {share:.0%}", data[: int(share * len(data))]
    changed = np.frombuffer(data, np.uint8).copy()
    rng = np.random.default_rng(seed)
    if len(changed):
        changed[rng.integers(0, len(changed), CHANGED_BYTES)] = rng.integers(0, 256, CHANGED_BYTES)
    yield f"{CHANGED_BYTES} bytes changed", changed.tobytes()


def words(command: str, **paths: Path) -> List[str]:
    """The arguments of a subcommand, with the paths in place of FILE, BAG, MAP and OUT."""
    result = command.split()
    for name, path in paths.items():
        result = [word.replace(name, str(path)) for word in result]
    return result


def fault(code: int, printed: str) -> str:
    """What is wrong with the end of a subcommand; "" if nothing is. What a change did not spoil may be read."""
    if "Traceback" in printed:
        return "a traceback"
    if code not in (0, 1, 2, 3):
        return f"exit code {code}"
    if code in (2, 3) and len(printed.strip().splitlines()) != 1:
        return f"{len(printed.strip().splitlines())} lines"
    return ""
