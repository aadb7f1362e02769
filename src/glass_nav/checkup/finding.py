"""A fault that a check found, and its remedy."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """A fault and its remedy."""

    name: str  # short and for good: for scripts, and to look it up
    what: str  # what was seen, with figures
    advice: str  # what to do
