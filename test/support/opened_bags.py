"""Bags opened: their steps, or the line with which they are refused."""

from __future__ import annotations

from pathlib import Path
from typing import List

import pytest

from glass_nav.recording.log_file import open_log
from glass_nav.recording.recording import LogOptions, Recording, RecordingError, Step


def refusal(path: Path, options: LogOptions = LogOptions()) -> str:
    """The line with which a bag is refused, without the folder it lies in."""
    with pytest.raises(RecordingError) as caught:
        list(open_log(path, options))
    text = str(caught.value)
    assert "\n" not in text
    return text.replace(f"{path.parent}/", "")


def steps(recording: Recording) -> List[Step]:
    """Its entries, none of which is refused."""
    entries = list(recording)
    assert all(isinstance(entry, Step) for entry in entries), entries
    return entries
