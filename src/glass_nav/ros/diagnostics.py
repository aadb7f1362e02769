"""/diagnostics by diagnostic_updater."""

from __future__ import annotations

import functools
from typing import Mapping

from diagnostic_updater import DiagnosticStatusWrapper, Updater

from glass_nav.health import Health


class Diagnostics:
    """One status per entry, named "node: entry".

    Nodes publish once a second of the wall clock. Updater.update() would go by ROS time, which may stand still, and by
    a parameter ~diagnostic_period, which the nodes reject as unknown.
    """

    def __init__(self, *names: str) -> None:
        self._entries: Mapping[str, Health] = {}
        self._updater = Updater()
        self._updater.setHardwareID("none")
        for name in names:
            self._updater.add(name, functools.partial(self._fill, name))

    def publish(self, entries: Mapping[str, Health]) -> None:
        """The entries by name: all that __init__ named."""
        self._entries = entries
        self._updater.force_update()

    def _fill(self, name: str, status: DiagnosticStatusWrapper) -> DiagnosticStatusWrapper:
        health = self._entries[name]
        status.summary(int(health.level), health.message)
        for key, value in health.values.items():
            status.add(key, str(value))
        return status
