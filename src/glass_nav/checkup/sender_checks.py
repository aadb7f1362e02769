"""Finds two nodes that send one transform with different values: the robot jumps between them.

Known by their names, which a recorder of ROS 1 keeps; without names, by values that go there and back.
"""

from __future__ import annotations

from typing import Dict, Iterator, List, Sequence, Tuple

import numpy as np

from glass_nav.checkup.finding import Finding
from glass_nav.recording import frames
from glass_nav.recording.observed import HeardTransform

_SAME_M, _SAME_RAD = 1e-3, 1e-3  # answers that differ by less are the same
_STEP_M, _STEP_RAD = 0.03, 0.03  # of a jump at least, and beyond what the robot moved meanwhile:
_SPEED_M_S, _SPEED_RAD_S = 2.0, 3.0
_BACK = 0.3  # share of a jump that may be missing when it goes back
_WITHIN = 10  # messages in which it must go back
_JUMPS, _SHARE = 6, 0.05  # that many, and so many of the messages, are not noise

Link = Tuple[str, str]


def check(transforms: Sequence[HeardTransform]) -> Iterator[Finding]:
    """Findings on links that two nodes send; in the order in which the transforms were heard."""
    links: Dict[Link, List[HeardTransform]] = {}
    for each in transforms:
        links.setdefault((each.parent.lstrip("/"), each.child.lstrip("/")), []).append(each)
    for (parent, child), heard in links.items():
        senders = _contradicting(heard)
        if senders:
            said = f"{parent} -> {child} comes from {' and '.join(senders)}"
        elif _fixed_and_moving(heard):
            said = f"{parent} -> {child} comes on /tf_static and on /tf"
        elif _there_and_back(heard):
            said = f"{parent} -> {child} jumps there and back between two interleaved values"
        else:
            continue
        yield Finding(
            "tf-two-senders",
            f"{said}: two nodes send this transform",
            "stop one of them: publish_tf of the wheels where an EKF sends it, a static map -> odom beside a "
            "localization",
        )


def _fixed_and_moving(heard: Sequence[HeardTransform]) -> bool:
    """Whether the link is on /tf_static, and something else on /tf."""
    fixed = [each for each in heard if each.static]
    others = [each for each in heard if not each.static]
    if not (fixed and others):
        return False
    off = _values(others) - _values(fixed)[-1]
    return bool((np.hypot(off[:, 0], off[:, 1]) > _SAME_M).any() or (_turns(off[:, 2]) > _SAME_RAD).any())


def _contradicting(heard: Sequence[HeardTransform]) -> List[str]:
    """Sorted names of the nodes that send different values of this link at the same time."""
    by_sender: Dict[str, List[HeardTransform]] = {}
    for each in heard:
        if each.sender:
            by_sender.setdefault(each.sender, []).append(each)
    names = sorted(by_sender)
    return sorted(
        {
            name
            for one in names
            for other in names
            if one < other and _overlap(by_sender[one], by_sender[other]) and _differ(by_sender[one], by_sender[other])
            for name in (one, other)
        }
    )


def _overlap(one: Sequence[HeardTransform], other: Sequence[HeardTransform]) -> bool:
    """Whether both send at the same time; a static transform is valid at any time."""
    if one[0].static or other[0].static:
        return True
    begin = max(one[0].heard_ns, other[0].heard_ns)
    end = min(one[-1].heard_ns, other[-1].heard_ns)
    return sum(begin <= each.heard_ns <= end for each in (*one, *other)) > 2


def _differ(one: Sequence[HeardTransform], other: Sequence[HeardTransform]) -> bool:
    if one[0].static and other[0].static:
        return _values(one)[-1:].tolist() != _values(other)[-1:].tolist()
    if one[0].static or other[0].static:
        return _fixed_and_moving([*one, *other])
    stamps_ns, first = np.unique([each.stamp_ns for each in other], return_index=True)
    values = _values(other)[first]
    values[:, 2] = np.unwrap(values[:, 2])
    at_ns = np.array([each.stamp_ns for each in one])
    inside = (at_ns >= stamps_ns[0]) & (at_ns <= stamps_ns[-1])
    if not inside.any():
        return True
    off = _values(one)[inside] - np.stack([np.interp(at_ns[inside], stamps_ns, value) for value in values.T], axis=-1)
    return bool((np.hypot(off[:, 0], off[:, 1]) > _SAME_M).any() or (_turns(off[:, 2]) > _SAME_RAD).any())


def _there_and_back(heard: Sequence[HeardTransform]) -> bool:
    """Whether the values repeatedly jump away and back, which no robot can do."""
    if len(heard) < 2 * _JUMPS:
        return False
    step = np.diff(_values(heard), axis=0)
    step[:, 2] = np.arctan2(np.sin(step[:, 2]), np.cos(step[:, 2]))
    apart_s = np.abs(np.diff([each.stamp_ns for each in heard])) * 1e-9
    way_m, turn_rad = np.hypot(step[:, 0], step[:, 1]), np.abs(step[:, 2])
    jumps = np.flatnonzero((way_m > _STEP_M + _SPEED_M_S * apart_s) | (turn_rad > _STEP_RAD + _SPEED_RAD_S * apart_s))
    returns = 0
    for jump in jumps.tolist():
        back = jumps[(jumps > jump) & (jumps <= jump + _WITHIN)]
        left = step[back] + step[jump]
        near = np.hypot(left[:, 0], left[:, 1]) <= _BACK * way_m[jump] + _STEP_M
        returns += bool((near & (np.abs(left[:, 2]) <= _BACK * turn_rad[jump] + _STEP_RAD)).any())
    return returns >= _JUMPS and returns > _SHARE * len(heard)


def _values(heard: Sequence[HeardTransform]) -> np.ndarray:
    """(N, 3) x, y, yaw; NaN where a transform is invalid."""
    values = np.full((len(heard), 3), np.nan)
    for row, each in enumerate(heard):
        unit = frames.normalised(each.rotation_xyzw)
        if unit is not None:
            values[row] = frames.planar((each.translation_m, unit))
    return values


def _turns(angles_rad: np.ndarray) -> np.ndarray:
    return np.abs(np.arctan2(np.sin(angles_rad), np.cos(angles_rad)))
