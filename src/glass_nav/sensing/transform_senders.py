"""Finds out which nodes send a transform: if two do, the robot jumps between their values.

Such as an EKF beside wheel odometry (odom -> base), or a static map -> odom beside a localization.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, Optional, Set, Tuple

SILENT_S = 5.0  # a sender that was not heard for so long has ended


@dataclass
class _Heard:
    parent: str
    value: Tuple[float, ...]
    static: bool
    at_s: float


class TransformSenders:
    """Watches the links that hang on the odometry's frame, and that frame itself."""

    def __init__(self, odom_frame: str, base_frame: str) -> None:
        self._odom_frame = odom_frame
        self._children: Set[str] = {odom_frame, base_frame}
        self._heard: Dict[str, Dict[str, _Heard]] = {}  # child -> sender -> its last transform

    def hear(
        self, parent: str, child: str, value: Tuple[float, ...], sender: str, static: bool, now_s: float
    ) -> Optional[str]:
        """A transform came in.

        Args:
            parent, child: its frames.
            value: translation and rotation.
            sender: name of the node that sent it.
            static: it came on /tf_static, and holds for ever.
            now_s: the time.

        Returns:
            a warning if another node sends this transform as well; else None.
        """
        parent, child = parent.lstrip("/"), child.lstrip("/")
        if parent == self._odom_frame:
            self._children.add(child)
        if child not in self._children:
            return None
        senders = self._heard.setdefault(child, {})
        senders[sender] = _Heard(parent, value, static, now_s)
        others = [name for name, last in senders.items() if name != sender and self._contradicts(last, senders[sender])]
        if not others:
            return None
        names = " and ".join(sorted([*others, sender]))
        links = " or ".join(sorted({f"{senders[name].parent} -> {child}" for name in (*others, sender)}))
        return f"tf {links} comes from {names}: the robot jumps between their answers; stop one of them"

    @staticmethod
    def _contradicts(last: _Heard, now: _Heard) -> bool:
        """Whether another sender is still active and sends a different value."""
        if not last.static and not 0.0 <= now.at_s - last.at_s < SILENT_S:
            return False
        return not (last.static and now.static and last.value == now.value and last.parent == now.parent)
