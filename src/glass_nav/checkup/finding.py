"""What a check found, and what to do about it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """One fault."""

    name: str  # short and for good: for scripts, and to look it up
    what: str  # what was seen, with figures
    advice: str  # what to do
