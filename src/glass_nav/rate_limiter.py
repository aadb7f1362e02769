"""Limits how often something is done; the caller gives the time."""

from __future__ import annotations


class RateLimiter:
    """Lets one thing pass per period; it also passes after time jumped back."""

    def __init__(self) -> None:
        self._last_s = 0.0

    def is_due(self, now_s: float, every_s: float) -> bool:
        """Whether every_s has passed since it was last due; True counts as done now."""
        if 0.0 <= now_s - self._last_s < every_s:
            return False
        self._last_s = now_s
        return True


def period_s(rate_hz: float) -> float:
    """Period of a rate as in AMCL's parameters: <= 0 means no limit."""
    return 1.0 / rate_hz if rate_hz > 0.0 else 0.0
