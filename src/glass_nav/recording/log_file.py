"""Opens a log as a Recording, by the kind of its files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Sequence, Union

from glass_nav.recording import bag_recording, rawlog_file
from glass_nav.recording.recording import LogOptions, Recording, RecordingError

AnyPath = Union[str, "os.PathLike[str]"]


def open_log(path: "Union[AnyPath, Sequence[AnyPath]]", options: LogOptions = LogOptions()) -> Recording:
    """Open an MRPT rawlog (.rawlog, .rawlog.gz) or a bag (anything else); of bags also several, as parts of one run.

    Raises:
        RecordingError: the log cannot be used; one line.
    """
    paths = [Path(path)] if isinstance(path, (str, os.PathLike)) else [Path(part) for part in path]
    rawlogs = [part for part in paths if part.name.endswith((".rawlog", ".rawlog.gz"))]
    if not rawlogs:
        return bag_recording.open_log(paths, options)
    if len(paths) > 1:
        raise RecordingError(f"{rawlogs[0]}: only bags can be parts of one run, got {len(paths)} logs")
    if options.wheels.wheel_topics:
        raise RecordingError(f"{paths[0]}: a rawlog has no topics, so that ~wheel_topics need a bag")
    return rawlog_file.open_log(paths[0], options)
