"""The tree of coordinate frames in a recorded /tf: a transform between two frames at a stamp.

Rotations are unit quaternions x, y, z, w as plain tuples: a chain has few links and is walked once a
scan, where arrays of three numbers would cost more than they help.
"""

from __future__ import annotations

import bisect
import math
from typing import Dict, List, Optional, Tuple

Vector = Tuple[float, float, float]
Quaternion = Tuple[float, float, float, float]
Transform = Tuple[Vector, Quaternion]
Planar = Tuple[float, float, float]  # x, y, yaw

IDENTITY: Transform = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
EXTRAPOLATION_NS = 100_000_000  # a robot that stops publishing for a beat is not lost yet


class FrameError(ValueError):
    """Two frames without a transform at that time; the text says which and why."""


class FrameTree:
    """Stamped transforms parent <- child, the way tf keeps them."""

    def __init__(self) -> None:
        self._links: Dict[str, _Link] = {}

    @property
    def frames(self) -> List[str]:
        """Every frame named, sorted."""
        return sorted(set(self._links) | {link.parent for link in self._links.values()})

    def add(self, parent: str, child: str, stamp_ns: int, transform: Transform, static: bool) -> None:
        """Adds a transform parent <- child. A child that changes its parent keeps the first one."""
        parent, child = parent.lstrip("/"), child.lstrip("/")
        link = self._links.setdefault(child, _Link(parent))
        if link.parent == parent:
            link.add(stamp_ns, transform, static)

    def connected(self, target: str, source: str) -> bool:
        """Whether some chain of links joins the two."""
        try:
            self._chain(target, source)
        except FrameError:
            return False
        return True

    def lookup(self, target: str, source: str, stamp_ns: int) -> Transform:
        """target <- source at that time, interpolated.

        Raises:
            FrameError: no chain joins them, or one of its links is not known at that time.
        """
        up, down = self._chain(target, source)
        transform = IDENTITY
        for child in up:  # from the source to the common ancestor
            transform = compose(self._links[child].at(child, stamp_ns), transform)
        for child in reversed(down):  # and down to the target
            transform = compose(inverse(self._links[child].at(child, stamp_ns)), transform)
        return transform

    def way(self, source: str, target: str) -> List[str]:
        """Children of the links from source up to where the chains of both meet, the last one first.

        Raises:
            FrameError: no chain joins them.
        """
        return self._chain(target, source)[0][::-1]

    def _chain(self, target: str, source: str) -> "Tuple[List[str], List[str]]":
        """Children of the links from source up, and from target up, to their common ancestor."""
        from_source, from_target = self._ancestry(source), self._ancestry(target)
        common = next((frame for frame in from_source if frame in from_target), None)
        if common is None:
            raise FrameError(f"no transform {target} <- {source}")
        return from_source[: from_source.index(common)], from_target[: from_target.index(common)]

    def _ancestry(self, frame: str) -> List[str]:
        path = [frame]
        while path[-1] in self._links and self._links[path[-1]].parent not in path:
            path.append(self._links[path[-1]].parent)
        return path


class _Link:
    """All transforms of one frame to its parent."""

    def __init__(self, parent: str) -> None:
        self.parent = parent
        self._stamps_ns: List[int] = []
        self._transforms: List[Transform] = []
        self._constant = True

    def add(self, stamp_ns: int, transform: Transform, static: bool) -> None:
        if static:
            self._stamps_ns, self._transforms, self._constant = [stamp_ns], [transform], True
            return
        if self._transforms and transform != self._transforms[-1]:
            self._constant = False
        if not self._stamps_ns or stamp_ns > self._stamps_ns[-1]:
            self._stamps_ns.append(stamp_ns)
            self._transforms.append(transform)
            return
        place = bisect.bisect_left(self._stamps_ns, stamp_ns)  # late: several nodes publish tf
        if self._stamps_ns[place] != stamp_ns:
            self._stamps_ns.insert(place, stamp_ns)
            self._transforms.insert(place, transform)

    def at(self, child: str, stamp_ns: int) -> Transform:
        if self._constant:  # also what a static publisher of the old kind sends on /tf
            return self._transforms[0]
        first, last = self._stamps_ns[0], self._stamps_ns[-1]
        if not first - EXTRAPOLATION_NS <= stamp_ns <= last + EXTRAPOLATION_NS:
            raise FrameError(f"no transform {self.parent} <- {child} at that time")
        after = bisect.bisect_left(self._stamps_ns, stamp_ns)
        if after == 0:
            return self._transforms[0]
        if after == len(self._stamps_ns):
            return self._transforms[-1]
        before_ns, after_ns = self._stamps_ns[after - 1], self._stamps_ns[after]
        share = (stamp_ns - before_ns) / (after_ns - before_ns)
        (p, q), (r, s) = self._transforms[after - 1], self._transforms[after]
        return (
            (p[0] + share * (r[0] - p[0]), p[1] + share * (r[1] - p[1]), p[2] + share * (r[2] - p[2])),
            _slerp(q, s, share),
        )


def normalised(quaternion: Quaternion) -> Optional[Quaternion]:
    """The unit quaternion, None for one without direction (all zero, NaN)."""
    x, y, z, w = quaternion
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    if not (math.isfinite(norm) and norm > 1e-6):
        return None
    return (x / norm, y / norm, z / norm, w / norm)


def compose(a_from_b: Transform, b_from_c: Transform) -> Transform:
    (translation, rotation), (offset, turn) = a_from_b, b_from_c
    x, y, z = _rotate(rotation, offset)
    return (translation[0] + x, translation[1] + y, translation[2] + z), _multiply(rotation, turn)


def inverse(a_from_b: Transform) -> Transform:
    translation, (x, y, z, w) = a_from_b
    back = (-x, -y, -z, w)
    p, q, r = _rotate(back, translation)
    return (-p, -q, -r), back


def planar(transform: Transform) -> Planar:
    """x, y and the direction of the x axis seen from above."""
    (x, y, _), rotation = transform
    ahead = _rotate(rotation, (1.0, 0.0, 0.0))
    return x, y, math.atan2(ahead[1], ahead[0])


def upwardness(transform: Transform) -> float:
    """Cosine between the two z axes: 1 level, -1 upside down, 0 on its side."""
    return _rotate(transform[1], (0.0, 0.0, 1.0))[2]


def _multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def _rotate(q: Quaternion, v: Vector) -> Vector:
    x, y, z, w = q
    tx, ty, tz = 2.0 * (y * v[2] - z * v[1]), 2.0 * (z * v[0] - x * v[2]), 2.0 * (x * v[1] - y * v[0])
    return (v[0] + w * tx + y * tz - z * ty, v[1] + w * ty + z * tx - x * tz, v[2] + w * tz + x * ty - y * tx)


def _slerp(a: Quaternion, b: Quaternion, share: float) -> Quaternion:
    dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    sign = -1.0 if dot < 0.0 else 1.0  # q and -q are one rotation: take the shorter arc
    angle = math.acos(min(abs(dot), 1.0))
    if angle < 1e-6:
        return a
    first, second = math.sin((1.0 - share) * angle), sign * math.sin(share * angle)
    scale = 1.0 / math.sin(angle)
    return (
        (first * a[0] + second * b[0]) * scale,
        (first * a[1] + second * b[1]) * scale,
        (first * a[2] + second * b[2]) * scale,
        (first * a[3] + second * b[3]) * scale,
    )
