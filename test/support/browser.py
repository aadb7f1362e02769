"""What tests of pages share: a page in a headless Chromium, and what it asked for while it opened."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import List, Optional

import pytest

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")


@dataclass(frozen=True)
class Opened:
    """A page after it was opened."""

    document: str  # as the browser understood it
    requests: List[str]  # addresses that the page asked for, files on the disk and data inside not counted
    console: List[str]  # lines that it wrote on the console, errors among them


def _program() -> Optional[str]:
    return next((found for found in map(shutil.which, PROGRAMS) if found), None)


def logs_its_console() -> bool:
    """Chromium 120, the last one of Debian 11, does not: Opened.console is empty there."""
    version = subprocess.run([_program() or "", "--version"], capture_output=True, text=True, check=True).stdout
    return int(version.split()[1].split(".")[0]) > 120


def opened(page: Path, folder: Path) -> Opened:
    """Open a file in Chromium; skips where there is none, but fails in CI.

    Args:
        page: the HTML file.
        folder: for the profile of the browser and its log of the network.
    """
    program = _program()
    if program is None:
        reason = f"no browser ({', '.join(PROGRAMS)}): scripts/setup --dev installs one on Debian"
        # Ubuntu 20.04 has it as a snap only
        if os.environ.get("CI") == "true" and not os.path.exists("/opt/ros/noetic"):
            pytest.fail(reason)
        pytest.skip(reason)
    log = folder / "network.json"
    done = subprocess.run(
        [
            program,
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--no-first-run",
            "--disable-extensions",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            f"--user-data-dir={folder / 'profile'}",
            "--enable-logging=stderr",
            f"--log-net-log={log}",
            "--dump-dom",
            page.resolve().as_uri(),
        ],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    network = json.loads(log.read_text())
    begun = network["constants"]["logEventTypes"]["URL_REQUEST_START_JOB"]
    requests = [
        event["params"] for event in network["events"] if event["type"] == begun and "url" in event.get("params", {})
    ]
    # The browser itself asks its maker about updates and the like: such requests have no page as their origin.
    return Opened(
        done.stdout,
        [request["url"] for request in requests if request["initiator"] != "not an origin"],
        [line for line in done.stderr.splitlines() if ":CONSOLE:" in line],
    )
