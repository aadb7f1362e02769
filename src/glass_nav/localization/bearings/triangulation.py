"""The pose from any number of bearings to landmarks: triples, then a least-squares fit.

Seed document landmark_bearings.txt (Tsukiyama 2009): every three bearings give a pose (inscribed_circles.py), and with
four landmarks the four poses should be averaged; average() does that. Ours beyond it: triangulate() starts from the
triples, finds the least-squares pose of all bearings with its covariance, leaves out one bearing that contradicts
the others, and refuses, with the reason, to guess. N bearings, T triples.

If one of four bearings is wrong, every three fit some place exactly: geometry alone shows that one is wrong, not which.
It can be identified only if no other choice of three puts the robot where those landmarks are visible (by range and
direction); if several do, the fix is refused. With five or more, the bearings decide.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import List, Optional, Tuple

import numpy as np
from scipy import special

from glass_nav.geometry import angles, se2
from glass_nav.localization.bearings import inscribed_circles
from glass_nav.sensing import bearing_model
from glass_nav.sensing.bearing_model import Sightings
from glass_nav.sensing.bearings import LandmarkBearings, OdometryDrift
from glass_nav.world.landmark_map import LandmarkMap

_FLIPPED_RAD = 0.5 * np.pi  # misfit of a triple: 0 or pi
_DRIVEN_M = 1e-9  # sensor places nearer to each other than this are one
_ROUNDS = 8  # of the triples of a moving robot
_STEPS, _HALVINGS = 20, 6  # of the least squares
_SMALL_STEP = 1e-11  # [m, rad] that ends them
_ONE_PLACE = 16.3  # chi-square of 3 degrees of freedom at 0.999: two fits of the same place
_CLEARLY_WORSE = 9.0  # difference of two chi-squares: odds of 90 to 1
_RANGE_SHARE, _VIEW_SLACK_RAD = 1.25, np.radians(15.0)  # by which a tag may exceed its mapped range and view


class TriangulationError(ValueError):
    """The bearings give no reliable pose; one line says why."""


@dataclass(frozen=True)
class TriangulationLimits:
    """When a pose from bearings is refused."""

    min_off_circle_sigmas: float = 3.0  # how clearly a triple must distinguish the robot from one on its circle
    max_position_sigma_m: float = 0.5  # along the worst direction
    max_misfit_chance: float = 0.001  # probability that correct bearings count as contradictory

    def __post_init__(self) -> None:
        for name in ("min_off_circle_sigmas", "max_position_sigma_m"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"~{name} must be > 0, got {getattr(self, name)}")
        if not 0.0 < self.max_misfit_chance < 1.0:
            raise ValueError(f"~max_misfit_chance must be > 0 and < 1, got {self.max_misfit_chance}")


@dataclass(frozen=True, eq=False)
class Triples:
    """The poses that triples of N bearings give."""

    members: np.ndarray  # (T, 3) indices of the bearings
    map_from_base: np.ndarray  # (T, 3) NaN where the two circles are one
    off_circle: np.ndarray  # (T,) standard deviations from the circle through its landmarks
    flipped: np.ndarray  # (T,) bool: no place sees the three in these directions
    usable: np.ndarray  # (T,) bool: neither flipped nor near the circle


@dataclass(frozen=True, eq=False)
class Fix:
    """A pose from bearings."""

    stamp_ns: int
    map_from_base: np.ndarray  # (3,)
    covariance: np.ndarray  # (3, 3) of x [m], y [m], yaw [rad]
    used_ids: Tuple[str, ...]
    excluded_ids: Tuple[str, ...]  # contradicted the others
    residuals_rad: np.ndarray  # of the bearings used, measured minus expected


@dataclass(frozen=True, eq=False)
class _Fit:
    pose: np.ndarray
    covariance: np.ndarray
    chi2: float
    residuals_rad: np.ndarray


def triangulate(
    bearings: LandmarkBearings, landmarks: LandmarkMap, limits: TriangulationLimits = TriangulationLimits()
) -> Fix:
    """The least-squares pose of all bearings, without one that contradicts the others.

    Raises:
        TriangulationError: fewer than three bearings; the robot is near the circle, or the line, through the landmarks;
            the bearings contradict each other; a landmark is not visible from there; the position is too uncertain.
        UnknownLandmark: an id that is not on the map.
    """
    seen = _enough(bearings, landmarks)
    found = _triples(seen, limits)
    if not found.usable.any():
        raise TriangulationError(_why_no_triple(bearings, seen, found))
    misfit = _misfits(seen, found)
    everyone = np.ones(len(bearings), bool)
    fit = _best_fit(seen, everyone, found, misfit)
    if (
        fit is None
        or fit.chi2 > _chi2_limit(len(bearings) - 3, limits.max_misfit_chance)
        or len(bearings) > 3
        and _out_of_sight(landmarks, seen, fit).any()
    ):
        if len(bearings) == 3:
            raise TriangulationError(_contradiction(bearings))
        return _without_one(bearings, landmarks, seen, found, misfit, limits)
    objection = _objection(bearings, landmarks, seen, fit, limits)
    if objection is not None:
        raise TriangulationError(objection)
    return _fix(bearings, everyone, fit)


def triples(
    bearings: LandmarkBearings, landmarks: LandmarkMap, limits: TriangulationLimits = TriangulationLimits()
) -> Triples:
    """The pose of every three bearings.

    Raises:
        TriangulationError: fewer than three.
        UnknownLandmark: an id that is not on the map.
    """
    return _triples(_enough(bearings, landmarks), limits)


def average(
    bearings: LandmarkBearings, landmarks: LandmarkMap, limits: TriangulationLimits = TriangulationLimits()
) -> Fix:
    """The mean of the poses of all usable triples, as the document advises; its covariance to first order.

    Raises:
        As triangulate(), except that contradictions among the bearings are not detected.
    """
    seen = _enough(bearings, landmarks)
    found = _triples(seen, limits)
    if not found.usable.any():
        raise TriangulationError(_why_no_triple(bearings, seen, found))
    poses, members = found.map_from_base[found.usable], found.members[found.usable]
    pose = np.append(poses[:, :2].mean(axis=0), angles.mean(poses[:, 2]))
    by_bearing = np.zeros((3, len(bearings)))  # the mean's change with each bearing
    for own, three in zip(poses, members):
        part = seen.subset(three)
        by_bearing[:, three] += np.linalg.inv(
            bearing_model.jacobian(part, own, bearing_model.lines_of_sight(part, own))
        ) / len(poses)
    sight = bearing_model.lines_of_sight(seen, pose)
    covariance = (by_bearing * bearing_model.variances(seen, sight)) @ by_bearing.T
    fit = _Fit(pose, covariance, 0.0, bearing_model.residuals(seen, pose, sight))
    objection = _objection(bearings, landmarks, seen, fit, limits)
    if objection is not None:
        raise TriangulationError(objection)
    return _fix(bearings, np.isin(np.arange(len(bearings)), members), fit)


def carried_along(fix: Fix, stamp_ns: int, base_from_later: np.ndarray, drift: OdometryDrift = OdometryDrift()) -> Fix:
    """The fix at a later stamp, moved by odometry's step (3,) since; less certain by its drift."""
    pose = se2.compose(fix.map_from_base, base_from_later)
    dx, dy = pose[:2] - fix.map_from_base[:2]
    by_fix = np.array([[1.0, 0.0, -dy], [0.0, 1.0, dx], [0.0, 0.0, 1.0]])  # a heading error rotates the step
    way_m, turn_rad = float(np.hypot(dx, dy)), abs(float(angles.wrap(base_from_later[2])))
    heading = drift.bearing_drift_rad_per_m * way_m + drift.bearing_drift_per_rad * turn_rad
    more = np.diag(np.square([drift.bearing_drift_per_m * way_m] * 2 + [heading]))
    return replace(fix, stamp_ns=stamp_ns, map_from_base=pose, covariance=by_fix @ fix.covariance @ by_fix.T + more)


# -- triples


@lru_cache(maxsize=64)
def _members(count: int) -> np.ndarray:
    return np.array(list(itertools.combinations(range(count), 3)))


def _enough(bearings: LandmarkBearings, landmarks: LandmarkMap) -> Sightings:
    seen = bearing_model.sightings(bearings, landmarks)
    if len(bearings) < 3:
        raise TriangulationError(f"three landmarks are needed, {len(bearings)} seen: {', '.join(bearings.ids) or '-'}")
    return seen


def _triples(seen: Sightings, limits: TriangulationLimits) -> Triples:
    members = _members(len(seen.number))
    landmarks_m, direction = seen.landmarks_m[members], seen.direction_rad[members]
    origin_m = seen.origin_m[members]
    middle_m = origin_m.mean(axis=1)
    aside_m = origin_m - middle_m[:, None]
    poses, misfit = inscribed_circles.intersect(landmarks_m, direction)
    if np.abs(aside_m).max() > _DRIVEN_M:  # seen from one place, the landmarks appear shifted by this
        still_m = landmarks_m
        for _ in range(_ROUNDS):
            cos, sin = angles.cos_sin(np.nan_to_num(poses[:, 2:]))
            landmarks_m = still_m - np.stack(
                [cos * aside_m[..., 0] - sin * aside_m[..., 1], sin * aside_m[..., 0] + cos * aside_m[..., 1]], axis=-1
            )
            poses, misfit = inscribed_circles.intersect(landmarks_m, direction)
    off_circle = inscribed_circles.off_circle(landmarks_m, direction, np.sqrt(seen.variance)[members])
    if middle_m.any():
        cos, sin = angles.cos_sin(poses[:, 2])
        poses[:, 0] -= cos * middle_m[:, 0] - sin * middle_m[:, 1]
        poses[:, 1] -= sin * middle_m[:, 0] + cos * middle_m[:, 1]
    with np.errstate(invalid="ignore"):
        flipped = misfit > _FLIPPED_RAD
    usable = ~flipped & np.isfinite(misfit) & (off_circle >= limits.min_off_circle_sigmas)
    return Triples(members, poses, off_circle, flipped, usable)


def _why_no_triple(bearings: LandmarkBearings, seen: Sightings, found: Triples) -> str:
    near = ~found.flipped
    if not near.any():
        return _contradiction(bearings)
    worst = int(np.argmax(np.where(near, found.off_circle, -np.inf)))  # the best of them
    names = _listed([bearings.ids[number] for number in found.members[worst]])
    centre, radius = inscribed_circles.circle(seen.landmarks_m[found.members[worst]])
    where = (
        f"the line through {names}"
        if not np.isfinite(radius)
        else f"the circle through {names} (centre x {centre[0]:.2f} m, y {centre[1]:.2f} m, radius {radius:.2f} m)"
    )
    others = "" if len(found.members) == 1 else ", and no other three landmarks do better"
    return (
        f"the robot may be anywhere along {where}: it is {found.off_circle[worst]:.1f} standard deviations off "
        f"it{others}"
    )


# -- least squares


def _misfits(seen: Sightings, found: Triples) -> np.ndarray:
    """(T, N) squared residuals of all bearings at the pose of each triple, in variances; inf where not usable."""
    poses = np.where(found.usable[:, None], found.map_from_base, 0.0)
    sight = bearing_model.lines_of_sight(seen, poses)
    square = bearing_model.residuals(seen, poses, sight) ** 2 / bearing_model.variances(seen, sight)
    return np.where(found.usable[:, None], square, np.inf)


def _best_fit(seen: Sightings, chosen: np.ndarray, found: Triples, misfit: np.ndarray) -> Optional[_Fit]:
    """Least squares of the chosen bearings (N,) bool, from their best-fitting triple; None without one."""
    inside = found.usable & chosen[found.members].all(axis=1)
    if not inside.any():
        return None
    cost = np.where(inside, misfit[:, chosen].sum(axis=1), np.inf)
    return _fit(seen if chosen.all() else seen.subset(chosen), found.map_from_base[int(np.argmin(cost))])


def _fit(seen: Sightings, pose: np.ndarray) -> Optional[_Fit]:
    """Gauss and Newton, with steps halved while they do not help; None if the bearings leave the pose open."""
    sight = bearing_model.lines_of_sight(seen, pose)
    residual = bearing_model.residuals(seen, pose, sight)
    variance = bearing_model.variances(seen, sight)
    cost = float((residual * residual / variance).sum())
    for _ in range(_STEPS):
        by_pose = bearing_model.jacobian(seen, pose, sight)
        weighted = by_pose / variance[:, None]
        try:
            step = np.linalg.solve(weighted.T @ by_pose, weighted.T @ residual)
        except np.linalg.LinAlgError:
            return None
        if np.abs(step).max() < _SMALL_STEP:
            break
        for _ in range(_HALVINGS):
            tried = pose + step
            there = bearing_model.lines_of_sight(seen, tried)
            left = bearing_model.residuals(seen, tried, there)
            now = float((left * left / variance).sum())
            if now <= cost:
                break
            step = 0.5 * step
        else:  # no improvement along the step: rounding
            break
        pose, sight, residual = tried, there, left
        variance = bearing_model.variances(seen, sight)
        cost = float((residual * residual / variance).sum())
    by_pose = bearing_model.jacobian(seen, pose, sight)
    try:
        covariance = np.linalg.inv((by_pose / variance[:, None]).T @ by_pose)
    except np.linalg.LinAlgError:
        return None
    pose = np.append(pose[:2], angles.wrap(pose[2]))
    return _Fit(pose, 0.5 * (covariance + covariance.T), cost, residual)


@lru_cache(maxsize=64)
def _chi2_limit(freedom: int, chance: float) -> float:
    """inf without a degree of freedom: three bearings always fit."""
    return float(special.chdtri(freedom, chance)) if freedom > 0 else float("inf")


# -- which to believe


def _without_one(
    bearings: LandmarkBearings,
    landmarks: LandmarkMap,
    seen: Sightings,
    found: Triples,
    misfit: np.ndarray,
    limits: TriangulationLimits,
) -> Fix:
    """Leave one bearing out, if that leaves only one place."""
    rivals: List[Tuple[_Fit, np.ndarray]] = []
    open_ids: List[str] = []  # without these the place is undetermined: they can be neither cleared nor blamed
    for number, name in enumerate(bearings.ids):
        chosen = np.arange(len(bearings)) != number
        fit = _best_fit(seen, chosen, found, misfit)
        if fit is None:
            if (~found.flipped & chosen[found.members].all(axis=1)).any():
                open_ids.append(name)
        elif (
            fit.chi2 <= _chi2_limit(len(bearings) - 4, limits.max_misfit_chance)
            and not _out_of_sight(landmarks, seen.subset(chosen), fit).any()
        ):
            rivals.append((fit, chosen))
    if not rivals:
        raise TriangulationError(f"{_contradiction(bearings)}, and leaving one of them out does not help")
    rivals.sort(key=lambda each: each[0].chi2)
    best, chosen = rivals[0]
    rivals = [each for each in rivals if each[0].chi2 < best.chi2 + _CLEARLY_WORSE]
    if open_ids or not all(_same_place(best, other) for other, _ in rivals[1:]):
        suspects = open_ids + [bearings.ids[int(np.argmin(mask))] for _, mask in rivals]
        raise TriangulationError(
            f"{_contradiction(bearings)}, and it cannot be told which one is wrong: "
            f"{_listed([name for name in bearings.ids if name in suspects], 'or')}"
        )
    objection = _objection(bearings.subset(chosen), landmarks, seen.subset(chosen), best, limits)
    if objection is not None:
        raise TriangulationError(
            f"{_contradiction(bearings)}; without {bearings.ids[int(np.argmin(chosen))]}, {objection}"
        )
    return _fix(bearings, chosen, best)


def _same_place(one: _Fit, other: _Fit) -> bool:
    apart = other.pose - one.pose
    apart[2] = angles.wrap(apart[2])
    return float(apart @ np.linalg.solve(one.covariance + other.covariance, apart)) <= _ONE_PLACE


def _objection(
    bearings: LandmarkBearings, landmarks: LandmarkMap, seen: Sightings, fit: _Fit, limits: TriangulationLimits
) -> Optional[str]:
    """Why a fit is not to be relied on, or None."""
    hidden = _out_of_sight(landmarks, seen, fit)
    x, y = fit.pose[:2]
    if hidden.any():
        number = int(np.argmax(hidden))
        sight_m = -bearing_model.lines_of_sight(seen, fit.pose)[number]
        off = np.abs(angles.wrap(np.arctan2(sight_m[1], sight_m[0]) - landmarks.facing_rad[seen.number[number]]))
        aside = "" if np.isnan(off) else f" and {np.degrees(off):.0f} degrees off its direction"
        return (
            f"the bearings of {_listed(bearings.ids)} lead to x {x:.2f} m, y {y:.2f} m, from where "
            f"{bearings.ids[number]} cannot be seen: it would be {np.hypot(*sight_m):.1f} m away{aside}"
        )
    sigma_m = float(np.sqrt(max(_largest(fit.covariance[:2, :2]), 0.0)))
    if not sigma_m <= limits.max_position_sigma_m:
        return (
            f"the position x {x:.2f} m, y {y:.2f} m is too unsure: sigma {sigma_m:.2f} m, allowed "
            f"{limits.max_position_sigma_m:g} m; the landmarks {_listed(bearings.ids)} are far away or near one "
            "circle with the robot"
        )
    return None


def _out_of_sight(landmarks: LandmarkMap, seen: Sightings, fit: _Fit) -> np.ndarray:
    """(N,) bool: from there the landmark could not have been seen."""
    way_m = -bearing_model.lines_of_sight(seen, fit.pose)
    return ~landmarks.reaches(way_m, seen.number, _RANGE_SHARE, _VIEW_SLACK_RAD)


def _largest(matrix: np.ndarray) -> float:
    """Eigenvalue of a symmetric (2, 2)."""
    half = 0.5 * (matrix[0, 0] + matrix[1, 1])
    return float(half + np.hypot(0.5 * (matrix[0, 0] - matrix[1, 1]), matrix[0, 1]))


def _fix(bearings: LandmarkBearings, chosen: np.ndarray, fit: _Fit) -> Fix:
    return Fix(
        bearings.stamp_ns,
        fit.pose,
        fit.covariance,
        tuple(name for name, used in zip(bearings.ids, chosen) if used),
        tuple(name for name, used in zip(bearings.ids, chosen) if not used),
        fit.residuals_rad,
    )


def _contradiction(bearings: LandmarkBearings) -> str:
    if len(bearings) == 3:
        return f"no place sees {_listed(bearings.ids)} in these directions: one of them is wrong"
    return f"the bearings of {_listed(bearings.ids)} contradict each other"


def _listed(names: "Tuple[str, ...] | List[str]", word: str = "and") -> str:
    """a, b and c; of many, the first."""
    shown = list(names[:6]) + ([f"{len(names) - 6} more"] if len(names) > 6 else [])
    return shown[0] if len(shown) == 1 else f"{', '.join(shown[:-1])} {word} {shown[-1]}"
