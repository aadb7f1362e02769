"""--help of the nodes, without a master."""

from __future__ import annotations

import sys
from typing import List, Optional

USAGE = "\n\nStart it by roslaunch, or rosrun glass_nav; parameters as _name:=value, topics as name:=other.\n"


def answers_help(doc: Optional[str], argv: Optional[List[str]] = None) -> bool:
    """Print what a node does if -h or --help is among its arguments; the node is not to start then.

    Args:
        doc: docstring of the node's file.
        argv: arguments; those of the process when not given.
    """
    asked = {"-h", "--help"} & set(sys.argv[1:] if argv is None else argv)
    if asked:
        sys.stdout.write((doc or "").strip() + USAGE)
    return bool(asked)
