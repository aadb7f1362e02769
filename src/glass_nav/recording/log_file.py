"""A path -> Recording, by what the file is."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Union

from glass_nav.recording import bag_file, rawlog_file
from glass_nav.recording.recording import LogOptions, Recording


def open_log(path: "Union[str, os.PathLike[str]]", options: LogOptions = LogOptions()) -> Recording:
    """Open an MRPT rawlog (.rawlog, .rawlog.gz) or a bag (anything else).

    Raises:
        RecordingError: the log cannot be used; one line.
    """
    path = Path(path)
    if path.name.endswith((".rawlog", ".rawlog.gz")):
        return rawlog_file.open_log(path, options)
    return bag_file.open_log(path, options)
