"""Simulates one scan of a lidar in a building with glass, with the true case of each beam.

Every beam has several return paths: from each pane on its path, from the surface behind them, and by reflection in the
first or the second glazing. Each path has an echo power (reference figures: Fresnel for panes, Lambert for diffuse
surfaces, squared distances). Echoes above the detection floor compete, and the lidar reports the first, the strongest
or the last. Not modelled: two reflections on one path, beam width, the robot's own body.

B beams, K panes on a path; ranges in m, inf where there is nothing.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass, fields
from typing import Dict, List, Tuple

import numpy as np

from glass_nav.geometry import angles
from glass_nav.simulation import building_map, glass, people
from glass_nav.simulation.building import LARGEST_GAP_M, MIRROR, OPAQUE, Building, Surfaces, joined
from glass_nav.vocabulary import BeamCase

ECHOES = ("first", "strongest", "last")
VISIBILITIES = ("logistic", "lobe")
FLOOR_REFLECTANCE = 0.1  # least that the lidar detects at maximum range, face on
WHITE_INTENSITY = 1000.0  # of a white wall, face on at 1 m
USUAL_DIRT = 0.004  # of a pane; dirty_share is given for this dirt
LARGEST_PANES = 8  # considered on one path, two for each double glazing
RESOLVED_M = 0.05  # closer echoes merge into one, labelled as the stronger
NEAR_M = 1e-6  # a mirrored path does not hit its own mirror
ENDS = 1e-9  # relative extension of each surface: no beam slips through a corner


@dataclass(frozen=True)
class LidarModel:
    """A 2D lidar and how it sees glass."""

    beams: int = 541
    field_of_view_rad: float = 1.5 * np.pi
    range_min_m: float = 0.1
    range_max_m: float = 25.0
    noise_m: float = 0.015  # sigma of a range
    dropout: float = 0.005  # share of returning beams that are lost
    echo: str = "strongest"  # which echo is reported: one of ECHOES
    visibility: str = "logistic"  # of panes: "logistic" share of beams by incidence, or "lobe" power by incidence
    half_rad: float = np.deg2rad(15.5)  # logistic: incidence at which a clean pane returns half of the beams
    width_rad: float = np.deg2rad(2.2)  # logistic: 12 to 88 percent within two widths to either side
    dirty_share: float = 0.16  # logistic: share of spots on a usual pane that return a beam at any incidence
    specular: float = 1.0  # A: power of a pane face on at 1 m; a white wall has 1
    lobe_rad: float = np.deg2rad(5.0)  # lobe: theta_s
    coating: float = 1.0  # factor on the coating of every pane in the building

    def __post_init__(self) -> None:
        if isinstance(self.beams, bool) or not isinstance(self.beams, (int, np.integer)) or self.beams < 2:
            raise ValueError(f"lidar beams must be a whole number >= 2, got {self.beams!r}")
        for name, known in (("echo", ECHOES), ("visibility", VISIBILITIES)):
            if getattr(self, name) not in known:
                raise ValueError(f"lidar {name} must be one of {', '.join(known)}, got {getattr(self, name)!r}")
        if not 0.0 < self.field_of_view_rad <= 2.0 * np.pi:
            raise ValueError(f"lidar field_of_view_rad must be > 0 and <= 2 pi, got {self.field_of_view_rad}")
        if not 0.0 <= self.range_min_m < self.range_max_m < np.inf:
            raise ValueError(
                "lidar ranges must be 0 <= range_min_m < range_max_m, finite, got "
                f"{self.range_min_m} and {self.range_max_m}"
            )
        for name in ("dropout", "dirty_share"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"lidar {name} must be 0 to 1, got {getattr(self, name)}")
        for name in ("noise_m", "specular", "half_rad"):
            if not 0.0 <= getattr(self, name) < np.inf:
                raise ValueError(f"lidar {name} must be >= 0, got {getattr(self, name)}")
        for name in ("width_rad", "lobe_rad", "coating"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise ValueError(f"lidar {name} must be > 0, got {getattr(self, name)}")

    @property
    def angles_rad(self) -> np.ndarray:
        """(B,) directions in the laser's frame, counter-clockwise, the middle ahead; a full circle has none twice."""
        half = self.field_of_view_rad / 2.0
        all_round = self.field_of_view_rad > 2.0 * np.pi - 1e-9
        return np.linspace(-half, half, self.beams, endpoint=not all_round)


PRESETS: Dict[str, LidarModel] = {
    "sensitive": LidarModel(),
    "weak": LidarModel(half_rad=np.deg2rad(4.0), width_rad=np.deg2rad(0.8), dirty_share=0.01, noise_m=0.02),
    "coated": LidarModel(coating=4.0),
}


def preset(name: str) -> LidarModel:
    """The model of this name.

    Raises:
        ValueError: there is none.
    """
    if name not in PRESETS:
        near = difflib.get_close_matches(str(name), list(PRESETS), n=1)
        hint = f"; did you mean {near[0]}?" if near else ""
        raise ValueError(f"unknown lidar preset {name!r}, known are {', '.join(PRESETS)}{hint}")
    return PRESETS[name]


@dataclass(frozen=True)
class TrueScan:
    """A scan as the lidar reports it, with the true case of each beam in terms of the map.

    Cases: 1 ended at the first mapped surface on its path; 3 and 4 passed one and two mapped panes and ended at the
    second and third mapped surface; 2 was mirrored at the first mapped surface, then ended at the first mapped one on
    the mirrored path; 0 everything else. A surface nearer than LARGEST_GAP_M to a pane, along the beam, counts as one
    with it, as in the map; so do the sheets of a double glazing.
    """

    ranges_m: np.ndarray  # (B,) REP 117: inf no answer, -inf nearer than range_min
    case: np.ndarray  # (B,) uint8
    exact_m: np.ndarray  # (B,) path length without noise, NaN: no answer
    crossing_m: np.ndarray  # (B,) where it passed or was mirrored at the first mapped pane, NaN: neither
    intensity: np.ndarray  # (B,) of the echo: 1000 for a white wall face on at 1 m; 0: no answer


@dataclass(frozen=True)
class _Fans:
    """Rays from F apparent centres: the laser, or its mirror images behind panes. R rays, B beams.

    The ray of beam b in fan f has the direction first_rad[f] + b * step_rad[f].
    """

    centre_m: np.ndarray  # (F, 2)
    first_rad: np.ndarray  # (F,) direction of beam 0 in map
    step_rad: np.ndarray  # (F,) from one beam to the next, negative if mirrored
    ray_of: np.ndarray  # (F, B) index of the ray, -1: the beam is not in this fan
    lowest: np.ndarray  # (F,) first and last beam of the fan
    highest: np.ndarray
    fan: np.ndarray  # (R,) of each ray
    ray: np.ndarray  # (R, 2) directions of length 1
    start_m: np.ndarray  # (R,) range at which the ray begins: 0, or that of the mirror

    def points(self, rays: np.ndarray, range_m: np.ndarray) -> np.ndarray:
        """(N, 2) at ranges (N,) on rays (N,)."""
        return self.centre_m[self.fan[rays]] + range_m[:, None] * self.ray[rays]


@dataclass(frozen=True)
class _Ways:
    """What R rays hit up to and including the first opaque surface; panes in order of range, inf where there is none."""

    pane_m: np.ndarray  # (R, K)
    pane: np.ndarray  # (R, K) index of the surface
    cos: np.ndarray  # (R, K) of the incidence
    met: np.ndarray  # (R, K) bool: this pane exists
    pane_mapped: np.ndarray  # (R, K) bool
    passed: np.ndarray  # (R, K) int: mapped glazings before this pane
    end_m: np.ndarray  # (R,)
    end_power: np.ndarray  # (R,) of the opaque surface at 1 m, panes not counted: rho cos
    end_mapped: np.ndarray  # (R,) bool
    end_passed: np.ndarray  # (R,) int: mapped glazings before it
    missing_m: np.ndarray  # (R,) range of a mapped surface that is gone


@dataclass(frozen=True)
class _Echoes:
    """One return path for each beam."""

    power: np.ndarray  # (B,) 0: none
    range_m: np.ndarray  # (B,)
    case: np.ndarray  # (B,)
    crossing_m: np.ndarray  # (B,) NaN: none


def scan(
    model: LidarModel, building: Building, map_from_laser: np.ndarray, time_s: float, rng: np.random.Generator
) -> TrueScan:
    """Simulates one sweep, all beams at one moment.

    Args:
        model: the lidar.
        building: its people walk, everything else is static.
        map_from_laser: (3,) pose.
        time_s: since the start of the building's clock.
        rng: draws noise, dropouts and the visible spots of panes.
    """
    map_from_laser = np.asarray(map_from_laser, float)
    surfaces = joined(building.surfaces, people.surfaces(building.people, time_s, map_from_laser[:2]))
    fan = _fan(model, map_from_laser)
    direct = _ways(building, surfaces, fan)
    reflected, passing = _pane_light(model, surfaces, direct)
    first_m = np.where(direct.pane_mapped, direct.pane_m, np.inf).min(axis=1, initial=np.inf)  # first mapped pane
    echoes = _direct_echoes(model, surfaces, direct, passing, first_m, rng)
    echoes += _mirrored_echoes(model, building, surfaces, fan, direct, reflected, passing, first_m, rng)
    return _reported(model, echoes, first_m, rng)


def _reported(model: LidarModel, echoes: List[_Echoes], first_m: np.ndarray, rng: np.random.Generator) -> TrueScan:
    power, range_m, case, crossing_m = (
        np.stack([getattr(echo, field.name) for echo in echoes], axis=1) for field in fields(_Echoes)
    )  # (B, paths)
    heard = (power > FLOOR_REFLECTANCE / model.range_max_m**2) & (range_m <= model.range_max_m)
    rank = {"first": -range_m, "last": range_m, "strongest": power}[model.echo]
    best = np.argmax(np.where(heard, rank, -np.inf), axis=1)
    beams = np.arange(len(best))
    with np.errstate(invalid="ignore"):  # echoes at equal range, mostly from a wall that runs into the pane
        same = heard & (np.abs(range_m - range_m[beams, best][:, None]) < RESOLVED_M)
    best = np.argmax(np.where(same, power, -np.inf), axis=1)
    exact_m = range_m[beams, best]
    noise_m = model.noise_m * rng.standard_normal(len(beams))
    lost = rng.random(len(beams)) < model.dropout
    with np.errstate(invalid="ignore"):
        measured_m = exact_m + noise_m
    near = heard[beams, best] & ~lost & (measured_m < model.range_min_m)
    answered = heard[beams, best] & ~lost & ~near & (measured_m <= model.range_max_m)
    passed_m = np.where(first_m <= model.range_max_m, first_m, np.nan)  # passed by beams that did not return
    return TrueScan(
        np.where(answered, measured_m, np.where(near, -np.inf, np.inf)),
        np.where(answered, case[beams, best], BeamCase.UNCERTAIN).astype(np.uint8),
        np.where(answered, exact_m, np.nan),
        np.where(answered, crossing_m[beams, best], passed_m),
        np.where(answered, np.rint(WHITE_INTENSITY * power[beams, best]), 0.0),
    )


def _direct_echoes(
    model: LidarModel,
    surfaces: Surfaces,
    direct: _Ways,
    passing: np.ndarray,
    first_m: np.ndarray,
    rng: np.random.Generator,
) -> List[_Echoes]:
    """Echoes from every pane on the path and from its end; passing (B, K + 1) is the light that gets there."""
    behind = np.array([BeamCase.DIFFUSE, BeamCase.FIRST_PENETRATION, BeamCase.SECOND_PENETRATION, BeamCase.UNCERTAIN])
    pane_power = _pane_power(model, surfaces, direct, rng)
    echoes = []
    for k in range(direct.pane_m.shape[1] + 1):
        at_end = k == direct.pane_m.shape[1]
        range_m = direct.end_m if at_end else direct.pane_m[:, k]
        mapped = direct.end_mapped if at_end else direct.pane_mapped[:, k]
        passed = direct.end_passed if at_end else direct.passed[:, k]
        power = (direct.end_power if at_end else pane_power[:, k]) * passing[:, k] ** 2 / range_m**2
        known = mapped & (direct.missing_m >= range_m)
        echoes.append(
            _Echoes(
                power,
                range_m,
                np.where(known, behind[np.minimum(passed, 3)], BeamCase.UNCERTAIN),
                np.where(passed > 0, first_m, np.nan),
            )
        )
    return echoes


def _fan(model: LidarModel, map_from_laser: np.ndarray) -> _Fans:
    """The fan of all beams, from the laser itself."""
    angles_rad = map_from_laser[2] + model.angles_rad
    cos, sin = angles.cos_sin(angles_rad)
    beams = len(angles_rad)
    return _Fans(
        map_from_laser[None, :2],
        angles_rad[:1],
        angles_rad[1:2] - angles_rad[:1],
        np.arange(beams)[None],
        np.zeros(1, int),
        np.full(1, beams - 1),
        np.zeros(beams, int),
        np.stack([cos, sin], axis=-1),
        np.zeros(beams),
    )


def _mirrored(fan: _Fans, surfaces: Surfaces, beams: np.ndarray, mirror: np.ndarray, start_m: np.ndarray) -> _Fans:
    """The beams (R,) of the laser's fan after their mirrors (R,), as rays from the laser's images behind these."""
    panes, image = np.unique(mirror, return_inverse=True)
    from_m = surfaces.from_m[panes]
    line = surfaces.to_m[panes] - from_m
    line /= np.hypot(line[:, 0], line[:, 1])[:, None]
    to_laser = fan.centre_m - from_m
    centre_m = from_m + 2.0 * (to_laser * line).sum(axis=1)[:, None] * line - to_laser
    along = line[image]
    ray = 2.0 * (fan.ray[beams] * along).sum(axis=1)[:, None] * along - fan.ray[beams]
    ray_of = np.full((len(panes), len(fan.ray)), -1)
    ray_of[image, beams] = np.arange(len(beams))
    ours = ray_of >= 0
    return _Fans(
        centre_m,
        2.0 * np.arctan2(line[:, 1], line[:, 0]) - fan.first_rad,
        np.repeat(-fan.step_rad, len(panes)),
        ray_of,
        np.argmax(ours, axis=1),
        ours.shape[1] - 1 - np.argmax(ours[:, ::-1], axis=1),
        image,
        ray,
        start_m,
    )


def _mirrored_echoes(
    model: LidarModel,
    building: Building,
    surfaces: Surfaces,
    fan: _Fans,
    direct: _Ways,
    reflected: np.ndarray,
    passing: np.ndarray,
    first_m: np.ndarray,
    rng: np.random.Generator,
) -> List[_Echoes]:
    """Echoes by reflection in the first and in the second glazing."""
    glazing = np.where(direct.met, surfaces.glazing[direct.pane], -1)
    beams = len(glazing)
    echoes: List[_Echoes] = []
    for mirror in range(2 if glazing.shape[1] else 0):
        is_mirror = direct.met & (glazing != glazing[:, :1]) if mirror else direct.met
        at = np.argmax(is_mirror, axis=1)  # (B,) the pane that mirrors
        rows = np.flatnonzero(is_mirror.any(axis=1))
        if not len(rows):
            break
        at = at[rows]
        to_mirror_m = direct.pane_m[rows, at]
        ways = _ways(building, surfaces, _mirrored(fan, surfaces, rows, direct.pane[rows, at], to_mirror_m))
        _, on_way = _pane_light(model, surfaces, ways)
        pane_power = _pane_power(model, surfaces, ways, rng)
        light = passing[rows, at] * reflected[rows, at]
        before = direct.passed[rows, at]  # mapped glazings before the mirror
        known = direct.pane_mapped[rows, at] & (before == 0) & (direct.missing_m[rows] >= to_mirror_m)
        crossed_m = np.where((before > 0) | direct.pane_mapped[rows, at], first_m[rows], np.nan)
        later_m = np.where(ways.pane_mapped, ways.pane_m, np.inf).min(axis=1, initial=np.inf)
        for k in range(ways.pane_m.shape[1] + 1):
            at_end = k == ways.pane_m.shape[1]
            range_m = ways.end_m if at_end else ways.pane_m[:, k]
            mapped = ways.end_mapped if at_end else ways.pane_mapped[:, k]
            passed = ways.end_passed if at_end else ways.passed[:, k]
            power = (ways.end_power if at_end else pane_power[:, k]) * (light * on_way[:, k]) ** 2 / range_m**2
            one = range_m - to_mirror_m < LARGEST_GAP_M  # in the map, it ended at the surface that mirrored it
            case = np.where(
                known & mapped & (passed == 0) & (ways.missing_m >= range_m),
                np.where(one, BeamCase.DIFFUSE, BeamCase.SPECULAR),
                BeamCase.UNCERTAIN,
            )
            crossing_m = np.where(np.isnan(crossed_m) & (passed > 0), later_m, crossed_m)
            crossing_m = np.where(case == BeamCase.DIFFUSE, np.nan, crossing_m)
            echoes.append(
                _Echoes(
                    *(
                        _spread(values, rows, beams, rest)
                        for values, rest in (
                            (power, 0.0),
                            (range_m, np.inf),
                            (case, BeamCase.UNCERTAIN),
                            (crossing_m, np.nan),
                        )
                    )
                )
            )
    return echoes


def _ways(building: Building, surfaces: Surfaces, fans: _Fans) -> _Ways:
    """Follow the rays of fans up to the first opaque surface; ranges from the centre of each fan."""
    there = np.flatnonzero(surfaces.present | surfaces.mapped)
    ray, surface, range_m, cos = _crossings(surfaces, there, fans)
    rays = len(fans.ray)
    is_opaque = surfaces.kind[surface] == OPAQUE
    end_m, end, end_cos = _nearest(
        rays, *(column[is_opaque & surfaces.present[surface]] for column in (ray, surface, range_m, cos))
    )
    missing_m, _, _ = _nearest(rays, *(column[~surfaces.present[surface]] for column in (ray, surface, range_m, cos)))
    gone = np.flatnonzero(np.isfinite(missing_m))
    missing_m[gone[~building_map.is_drawn(building, fans.points(gone, missing_m[gone]))]] = np.inf
    ended = np.flatnonzero(np.isfinite(end_m))
    end_mapped = np.zeros(rays, bool)
    end_mapped[ended] = surfaces.mapped[end[ended]] & building_map.is_drawn(building, fans.points(ended, end_m[ended]))

    keep = np.flatnonzero(~is_opaque & (range_m < end_m[ray]))
    ray, surface, range_m, cos = ray[keep], surface[keep], range_m[keep], cos[keep]
    order = np.lexsort((range_m, ray))
    ray, surface, range_m, cos = ray[order], surface[order], range_m[order], cos[order]
    place = np.arange(len(ray)) - np.searchsorted(ray, ray)  # of the pane on its path
    few = place < LARGEST_PANES
    most = int(place[few].max(initial=-1)) + 1
    at = ray[few], place[few]
    pane_m, pane_cos = np.full((rays, most), np.inf), np.ones((rays, most))
    pane, mapped = np.zeros((rays, most), int), np.zeros((rays, most), bool)
    pane_m[at], pane_cos[at], pane[at] = range_m[few], cos[few], surface[few]
    mapped[at] = surfaces.mapped[surface[few]] & building_map.is_drawn(building, fans.points(ray[few], range_m[few]))
    glazing = surfaces.glazing[pane]
    opens = np.ones(mapped.shape, bool)  # the first sheet of its glazing on this path
    with np.errstate(invalid="ignore"):
        opens[:, 1:] = (glazing[:, 1:] != glazing[:, :-1]) & (np.diff(pane_m, axis=1) >= LARGEST_GAP_M)
    count = np.cumsum(mapped & opens, axis=1)
    end_passed = np.zeros(rays, int)
    if most:
        last_m = np.where(np.isfinite(pane_m), pane_m, -np.inf).max(axis=1)
        behind = end_m - last_m >= LARGEST_GAP_M  # else the end counts as one surface with the last pane
        end_passed = np.where(behind, count[:, -1], np.maximum(count[:, -1] - 1, 0))
    return _Ways(
        pane_m,
        pane,
        pane_cos,
        np.isfinite(pane_m),
        mapped,
        np.maximum(count - mapped, 0),
        end_m,
        np.where(np.isfinite(end_m), surfaces.reflectance[end] * end_cos, 0.0),
        end_mapped,
        end_passed,
        missing_m,
    )


def _nearest(
    rays: int, ray: np.ndarray, surface: np.ndarray, range_m: np.ndarray, cos: np.ndarray
) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The nearest of the crossings (C,) of each ray: range, inf if none, index of the surface, cos; all (rays,)."""
    order = np.lexsort((range_m, ray))
    first = order[np.flatnonzero(np.diff(ray[order], prepend=-1))]
    nearest_m, index, at_cos = np.full(rays, np.inf), np.zeros(rays, int), np.zeros(rays)
    nearest_m[ray[first]], index[ray[first]], at_cos[ray[first]] = range_m[first], surface[first], cos[first]
    return nearest_m, index, at_cos


def _crossings(
    surfaces: Surfaces, chosen: np.ndarray, fans: _Fans
) -> Tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Crossings of rays and chosen surfaces: indices of both, range [m], cos of the incidence; all (C,).

    Seen from the centre of a fan, a surface covers an interval of beams: only those are computed.
    """
    from_m, to_m = surfaces.from_m[chosen], surfaces.to_m[chosen]
    sign = np.sign(fans.step_rad)[:, None]
    from_at, to_at = (
        sign
        * (np.arctan2(ends[:, 1] - fans.centre_m[:, 1:], ends[:, 0] - fans.centre_m[:, :1]) - fans.first_rad[:, None])
        for ends in (from_m, to_m)
    )  # (F, S)
    span = angles.wrap(to_at - from_at)
    start = np.mod(np.where(span < 0.0, to_at, from_at), 2.0 * np.pi)
    start = np.concatenate([start, start - 2.0 * np.pi], axis=1)  # past the last beam, it may reach the first
    step = np.abs(fans.step_rad)[:, None]
    low = np.maximum(np.ceil(start / step).astype(int) - 1, fans.lowest[:, None])
    high = np.minimum(np.floor((start + np.tile(np.abs(span), 2)) / step).astype(int) + 1, fans.highest[:, None])
    count = np.maximum(high - low + 1, 0).ravel()
    cell = np.repeat(np.arange(count.size), count)
    beam = np.arange(cell.size) - np.repeat(np.cumsum(count) - count, count) + low.ravel()[cell]
    fan, surface = cell // start.shape[1], cell % start.shape[1] % len(chosen)
    ray = fans.ray_of[fan, beam]
    ours = ray >= 0
    fan, surface, ray = fan[ours], surface[ours], ray[ours]

    line = to_m[surface] - from_m[surface]
    to_line = from_m[surface] - fans.centre_m[fan]
    way = fans.ray[ray]
    across = way[:, 0] * line[:, 1] - way[:, 1] * line[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        range_m = (to_line[:, 0] * line[:, 1] - to_line[:, 1] * line[:, 0]) / across
        share = (to_line[:, 0] * way[:, 1] - to_line[:, 1] * way[:, 0]) / across
        met = (range_m > fans.start_m[ray] + NEAR_M) & (share >= -ENDS) & (share <= 1.0 + ENDS)
    cos = np.minimum(np.abs(across[met]) / np.hypot(line[met, 0], line[met, 1]), 1.0)
    return ray[met], chosen[surface[met]], range_m[met], cos


def _pane_light(model: LidarModel, surfaces: Surfaces, ways: _Ways) -> Tuple[np.ndarray, np.ndarray]:
    """Share of the light that each pane (B, K) mirrors, with all sheets of its glazing; and the share that reaches pane
    k or, for k = K, passes them all (B, K + 1).
    """
    coating = surfaces.coating[ways.pane] * model.coating
    is_mirror = surfaces.kind[ways.pane] == MIRROR
    _, through = glass.sheet(ways.cos, coating, surfaces.thickness_m[ways.pane])
    through = np.where(ways.met, np.where(is_mirror, 0.0, through), 1.0)
    reflected = np.where(
        is_mirror, surfaces.reflectance[ways.pane], glass.reflectance(ways.cos, coating, surfaces.sheets[ways.pane])
    )
    start = np.ones((len(through), 1))
    return reflected, np.cumprod(np.concatenate([start, through], axis=1), axis=1)


def _pane_power(model: LidarModel, surfaces: Surfaces, ways: _Ways, rng: np.random.Generator) -> np.ndarray:
    """Power (B, K) that each pane itself returns to the lidar, at 1 m."""
    incidence_rad = np.arccos(ways.cos)
    dirt = surfaces.dirt[ways.pane]
    if model.visibility == "lobe":
        speckle = rng.exponential(size=ways.cos.shape)  # of coherent light on dust: the power is exponential
        power = model.specular * np.exp(-((incidence_rad / model.lobe_rad) ** 2)) + dirt * ways.cos * speckle
    else:
        seen = glass.visibility(incidence_rad, model.half_rad, model.width_rad)
        dirty = np.minimum(model.dirty_share * dirt / USUAL_DIRT * ways.cos, 1.0)
        spot = rng.random(ways.cos.shape) < dirty + (1.0 - dirty) * seen
        power = np.where(spot, model.specular, 0.0) + dirt * ways.cos
    return np.where(ways.met, power, 0.0)


def _spread(values: np.ndarray, rows: np.ndarray, beams: int, rest: float) -> np.ndarray:
    """(B,) the values at their rows, `rest` elsewhere."""
    whole = np.full(beams, rest, float)
    whole[rows] = values
    return whole
