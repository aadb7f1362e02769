"""The state of the localization as a text above the robot, for displays."""

from __future__ import annotations

from typing import Optional

import numpy as np

from glass_nav.shapes import Text
from glass_nav.vocabulary import LocalizationState

TEXT_RGB = {
    LocalizationState.LOCALIZED: (0, 50, 95),
    LocalizationState.UNCERTAIN: (105, 75, 0),
    LocalizationState.LOST: (143, 0, 0),
    LocalizationState.GLOBAL_SEARCH: (90, 20, 140),
    LocalizationState.UNKNOWN: (40, 40, 40),
}  # dark on free and unknown cells alike
STATUS_NAMESPACE = "status"

_LETTER_M = 0.4  # height of a capital letter
_ABOVE_M = 0.75  # of the robot: up and to the north, which is up on the screen in a top view
_REASON_WIDTH = 48  # characters per line


def status_text(map_from_base: Optional[np.ndarray], state: str, reason: str, used_share: float) -> Text:
    """The words, in the map's frame; at the map's origin before the robot has a pose.

    Args:
        map_from_base: (3,) where the robot is.
        state, reason: as in ~status; the reason is shown if it matters.
        used_share: of beams that a case explains; NaN without a scan.
    """
    x, y, _ = np.zeros(3) if map_from_base is None else map_from_base
    text = state if np.isnan(used_share) else f"{state}, {100.0 * used_share:.0f} % of the beams explained"
    if state != LocalizationState.LOCALIZED:
        text += "\n" + _wrapped(reason)
    at_m = np.array([x, y + _ABOVE_M, _ABOVE_M])
    return Text(STATUS_NAMESPACE, 0, text, at_m, _LETTER_M, TEXT_RGB[LocalizationState(state)])


def _wrapped(text: str) -> str:
    """The text broken at spaces: rviz does not break lines itself."""
    lines = [""]
    for word in text.split():
        if lines[-1] and len(lines[-1]) + 1 + len(word) > _REASON_WIDTH:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return "\n".join(lines)
