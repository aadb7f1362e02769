"""Finds lines among the returns that the map does not explain.

A pane returns beams only near its normal, so each return tells where the pane is and in which direction it runs. Each
return votes for the lines through it that are nearly at right angles to its beam (Hough transform with known
directions, in pieces of the plane); total least squares through the voters gives the line. N returns.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Iterator

import numpy as np

from glass_nav.geometry import angles

_TURN_RAD, _OFFSET_M, _ALONG_M = np.radians(4.0), 0.1, 1.0  # bins of the votes
_VOTES_RAD = np.radians(12.0)  # a beam returns within this of the normal
_JOIN_M = 1.5
_NEAR_M = 0.12  # of the line that a return belongs to
_SIGMA_M = 0.04  # of a return across a pane: of the range, and of the pose
_ROUNDS = 8
_STRIP_M, _STRIP_SLOPE = 0.5, 0.1  # around the first guess of a line: what may belong to it
_LEAST_RETURNS = 3


@dataclass(frozen=True)
class Returns:
    """Returns from where the map has nothing."""

    points_m: np.ndarray  # (N, 2) in map
    beam_rad: np.ndarray  # (N,) direction of the beam in map
    width_m: np.ndarray  # (N,) distance from one beam to the next there
    scan: np.ndarray  # (N,) number of the kept scan
    excess: np.ndarray  # (N,) of the intensity over that of walls, see WallIntensity; NaN: not known

    def __len__(self) -> int:
        return len(self.scan)


@dataclass(frozen=True)
class Line:
    """A line through returns near its normal."""

    centre_m: np.ndarray  # (2,)
    direction_rad: float
    first_m: float  # of the returns along it, from the centre
    last_m: float
    covariance: np.ndarray  # (2, 2) of offset [m] and direction [rad]
    members: np.ndarray  # (M,) indices of the returns

    @property
    def along(self) -> np.ndarray:
        """(2,)"""
        return np.array([np.cos(self.direction_rad), np.sin(self.direction_rad)])

    @property
    def normal(self) -> np.ndarray:
        """(2,)"""
        return np.array([-np.sin(self.direction_rad), np.cos(self.direction_rad)])

    def straightness(self, points_m: np.ndarray) -> float:
        """Mean log likelihood ratio of returns (M, 2), on the line against anywhere in a strip around it; at most 0."""
        offset_m = (points_m - self.centre_m) @ self.normal
        on_it = -0.5 * float(np.mean((offset_m / _SIGMA_M) ** 2)) - np.log(np.sqrt(2.0 * np.pi) * _SIGMA_M)
        return min(0.0, float(on_it + np.log(2.0 * _NEAR_M)))


def traced(returns: Returns, least_votes_m: float, least_scans: int) -> Iterator[Line]:
    """Lines, those with most votes first; each return belongs to one at most.

    Args:
        returns: all there are.
        least_votes_m: how much of a line the beams of all scans must cover together.
        least_scans: that have seen it.
    """
    if not len(returns):
        return
    ballots = _votes(returns)
    free = np.ones(len(returns), bool)
    for best in np.argsort(-ballots.votes_m, kind="stable"):
        if ballots.votes_m[best] < least_votes_m:
            return
        voters = ballots.voters(best)
        voters = voters[free[voters]]
        if returns.width_m[voters].sum() < least_votes_m or len(np.unique(returns.scan[voters])) < least_scans:
            continue
        line = _grown(returns, free, voters, ballots.direction_rad[best])
        free[voters] = False
        if line is not None:
            free[line.members] = False
            free[_on(line, returns)] = False  # oblique beams that it returned
            yield line


@dataclass(frozen=True)
class _Ballots:
    """Votes of the returns for K bins of lines."""

    votes_m: np.ndarray  # (K,)
    direction_rad: np.ndarray  # (K,) of the lines of a bin
    voter: np.ndarray  # (V,) in the order of the bins
    start: np.ndarray  # (K + 1,) where the voters of each bin begin

    def voters(self, number: int) -> np.ndarray:
        return self.voter[self.start[number] : self.start[number + 1]]


def _votes(returns: Returns) -> _Ballots:
    turns = int(round(np.pi / _TURN_RAD))
    reach = int(np.ceil(_VOTES_RAD / _TURN_RAD))
    normal_bin = np.floor(np.mod(returns.beam_rad, np.pi) / np.pi * turns).astype(np.int64)
    bins = (normal_bin[:, None] + np.arange(-reach, reach + 1)) % turns  # (N, R)
    normal_rad = (bins + 0.5) * np.pi / turns
    cos, sin = np.cos(normal_rad), np.sin(normal_rad)
    x, y = (returns.points_m - returns.points_m.mean(axis=0)).T[..., None]
    offset = np.floor((x * cos + y * sin) / _OFFSET_M).astype(np.int64)
    along = np.floor((y * cos - x * sin) / _ALONG_M).astype(np.int64)
    offset -= offset.min()
    along -= along.min()
    keys = ((bins * (offset.max() + 1) + offset) * (along.max() + 1) + along).ravel()
    order = np.argsort(keys, kind="stable")
    start = np.flatnonzero(np.diff(keys[order], prepend=-1))
    voter = order // bins.shape[1]
    votes_m = np.add.reduceat(returns.width_m[voter], start)
    return _Ballots(votes_m, normal_rad.ravel()[order[start]] + 0.5 * np.pi, voter, np.append(start, len(voter)))


def _grown(returns: Returns, free: np.ndarray, voters: np.ndarray, direction_rad: float) -> "Line | None":
    """The line through the voters and all that continues it; None if they trace none."""
    seed_m = returns.points_m[voters].mean(axis=0)
    across = np.array([-np.sin(direction_rad), np.cos(direction_rad)])
    from_seed = returns.points_m - seed_m
    offset_m, along_m = from_seed @ across, from_seed @ np.array([across[1], -across[0]])
    near = np.flatnonzero(free & (np.abs(offset_m) < _STRIP_M + _STRIP_SLOPE * np.abs(along_m)))
    near = near[_is_within(2.0 * _VOTES_RAD, returns.beam_rad[near], direction_rad)]
    points_m, beam_rad, width_m = returns.points_m[near], returns.beam_rad[near], returns.width_m[near]
    members = np.flatnonzero(np.isin(near, voters))
    near_m = 2.0 * _NEAR_M
    for _ in range(_ROUNDS):
        if len(members) < _LEAST_RETURNS:
            return None
        weight = width_m[members] / width_m[members].sum()
        centre = weight @ points_m[members]
        direction_rad = _direction(points_m[members] - centre, weight, direction_rad, beam_rad[members])
        along = np.array([np.cos(direction_rad), np.sin(direction_rad)])
        offset_m = (points_m - centre) @ np.array([-along[1], along[0]])
        held = np.flatnonzero((np.abs(offset_m) < near_m) & _is_within(_VOTES_RAD, beam_rad, direction_rad))
        held = held[_connected((points_m[held] - centre) @ along, (points_m[members] - centre) @ along)]
        near_m = _NEAR_M
        if np.array_equal(held, members):
            break
        members = held
    if len(members) < _LEAST_RETURNS:
        return None
    at_m = (points_m[members] - centre) @ along
    covariance = _covariance(offset_m[members], at_m)
    return Line(centre, direction_rad, float(at_m.min()), float(at_m.max()), covariance, near[members])


def _on(line: Line, returns: Returns) -> np.ndarray:
    """(N,) bool: returns that lie on a line, whatever their beams' directions."""
    from_centre_m = returns.points_m - line.centre_m
    along_m = from_centre_m @ line.along
    on_line: np.ndarray = (
        (np.abs(from_centre_m @ line.normal) < _NEAR_M) & (along_m >= line.first_m) & (along_m <= line.last_m)
    )
    return on_line


def _is_within(incidence_rad: float, beam_rad: np.ndarray, direction_rad: float) -> np.ndarray:
    """(N,) bool: beams within an angle of the normal of a line."""
    within: np.ndarray = np.abs(np.cos(beam_rad - direction_rad)) < np.sin(incidence_rad)
    return within


def _direction(from_centre: np.ndarray, weight: np.ndarray, before_rad: float, beam_rad: np.ndarray) -> float:
    """Direction of the total least-squares line, with the beams' own as a weak prior for a short one; weights sum to 1."""
    x, y = from_centre.T
    prior = 0.02 * 0.1  # m^2: as if the line were seen for 0.1 m
    axis = 2.0 * (beam_rad - 0.5 * np.pi)
    across = weight @ (x * x - y * y + prior * np.cos(axis))
    twist = weight @ (2.0 * x * y + prior * np.sin(axis))
    turned = 0.5 * np.arctan2(twist, across)
    return float(before_rad + 0.5 * angles.wrap(2.0 * (turned - before_rad)))


def _connected(at_m: np.ndarray, seed_m: np.ndarray) -> np.ndarray:
    """Indices of the places along a line that are linked to the seeds by gaps of at most _JOIN_M."""
    if not len(at_m):
        return np.zeros(0, int)
    order = np.argsort(at_m)
    group = np.cumsum(np.diff(at_m[order], prepend=at_m[order[0]]) > _JOIN_M)
    middle = np.partition(seed_m, len(seed_m) // 2)[len(seed_m) // 2]
    chosen = group[np.argmin(np.abs(at_m[order] - middle))]
    return np.sort(order[group == chosen])


def _covariance(offset_m: np.ndarray, at_m: np.ndarray) -> np.ndarray:
    """Covariance of offset and direction at the centre, with correlated errors within a scan."""
    variance = float(np.mean(offset_m**2)) / max(np.sqrt(len(offset_m)), 1.0)
    spread = max(float(np.mean((at_m - at_m.mean()) ** 2)), 1e-4)
    return np.diag([variance, variance / spread])
