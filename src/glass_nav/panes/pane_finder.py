"""Finds the panes that the map lacks, each with its probability, from scans at trusted poses.

A beam that ended in front of the first mapped surface met something that the map lacks. What it was shows over time:
a pane returns beams only within some degrees of its normal, from wherever the robot looks at it head-on, and lets
beams pass at other angles; a new object returns beams from all directions and lets none pass; a person moves on. If
the lidar gives intensities, those that differ from ordinary walls count too (wall_intensity.py). Lines are traced
through the returns (pane_lines.py), and every piece of a line is looked up in the kept scans (pane_evidence.py). The
formulation is ours.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Dict, List, Optional, Sequence, Set, Tuple

import numpy as np

from glass_nav.geometry import se2
from glass_nav.panes import kept_scans, pane_evidence, pane_lines, wall_intensity
from glass_nav.panes.kept_scans import KeptScans
from glass_nav.panes.mapped_surfaces import MappedSurfaces
from glass_nav.panes.pane_evidence import PIECE_M, Counts, Kind, Likelihoods
from glass_nav.panes.pane_lines import Line, Returns
from glass_nav.panes.wall_intensity import WallIntensity
from glass_nav.params import number
from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import GridMap
from glass_nav.world.pane import Pane

_TURN_RAD = 0.4  # a robot that turned so far sees something else
_LOOK_FARTHER = 4.0  # times the reach: where the map says that a beam ends
_LEAST_VOTES_M, _LEAST_SCANS = 0.25, 3  # of a line that is looked at more closely
_LEAST_SPREAD_M = 0.3  # of the places that saw a pane
_POST_M = 0.3  # a thing between two panes that is not wider is a post of their frame
_MOST_LOG_ODDS = 30.0
_KNOWN_LOG_ODDS = 4.0  # limit for a pane known from before: beams can overrule it
_FORGOTTEN = 0.01  # a candidate less probable than this is dropped
_HELD_LOG_ODDS = (-2.5, 0.0, 1.5)  # more for a pane of which so many ends meet something mapped
_LOOSE_M = 4.0  # a person who walks beside the robot traces a line too: a shorter one needs an end that is held
_SURE_SCANS = 10  # the beams of one scan err together: a pane that fewer scans saw head-on is less sure
_DUE_SCANS = 30  # kept since the panes were last looked for
_SAME_ACROSS_M, _SAME_COS = 0.25, float(np.cos(np.radians(20.0)))
_THIN_M = 0.05  # of a surface for each return that is kept
_CHORD = 3  # beams to either side, whose ends show how a surface runs
_DEPTH_M, _RANGE_ERROR_M = 0.3, 0.04
_MAX_SLOPE = float(np.sin(np.radians(20.0)))


# Of one scan: points (N, 2) and directions (N,) in map, the width (N,) of each and how it differs from walls (N,).
_Unmapped = Tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True)
class PaneFinderParams:
    """How panes that the map lacks are found."""

    pane_prior: float = number(
        0.05, 0.0001, 0.9999
    )  # probability that a straight line of unmapped returns is glass, before it is looked up
    pane_min_length_m: float = number(0.5, 0.05, 100.0)  # shorter ones are left out
    pane_reach_m: float = number(6.0, 0.5, 100.0)  # beams show no pane from farther away
    pane_join_m: float = number(
        1.5, 0.0, 100.0
    )  # panes in one line with a smaller gap are one, unless beams pass the gap
    pane_to_wall_m: float = number(0.3, 0.0, 10.0)  # a pane that ends nearer than this to a mapped wall goes up to it
    pane_near_wall_m: float = number(
        0.15, 0.0, 10.0
    )  # what a beam meets nearer than this to a mapped wall is that wall
    pane_speck_m: float = number(
        0.4, 0.0, 10.0
    )  # smaller groups of occupied cells are no walls: an erased pane leaves such specks
    pane_spacing_m: float = number(0.1, 0.02, 10.0)  # distance between the scans that are kept
    pane_max_scans: int = number(4000, 1, 100000)  # that are kept; beyond, the oldest are dropped
    pane_max_sigma_m: float = number(0.1, 0.001, 10.0)  # of the position; a scan from a less certain pose is not used
    pane_max_sigma_rad: float = number(0.03, 0.001, 3.2)  # of the heading

    def __post_init__(self) -> None:
        if not 0.0 < self.pane_prior < 1.0:
            raise ValueError(f"~pane_prior must be in (0, 1), got {self.pane_prior}")
        for name in ("pane_min_length_m", "pane_reach_m", "pane_spacing_m", "pane_max_sigma_m", "pane_max_sigma_rad"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise ValueError(f"~{name} must be finite and > 0, got {getattr(self, name)}")
        for name in ("pane_join_m", "pane_to_wall_m", "pane_near_wall_m", "pane_speck_m"):
            if not 0.0 <= getattr(self, name) < np.inf:
                raise ValueError(f"~{name} must be finite and >= 0 m, got {getattr(self, name)}")
        if not self.pane_max_scans >= 1:
            raise ValueError(f"~pane_max_scans must be >= 1, got {self.pane_max_scans}")


@dataclass(frozen=True)
class _Stretch:
    """A section of a line."""

    ends_m: Tuple[float, float]  # along the line, from its centre
    own: np.ndarray  # (K,) pieces of it that are neither mapped nor posts
    members: np.ndarray  # (M,) its returns near the normal


class PaneFinder:
    """Finds the panes that one map lacks."""

    def __init__(
        self, grid_map: GridMap, params: PaneFinderParams = PaneFinderParams(), known: Sequence[Pane] = ()
    ) -> None:
        """
        Args:
            grid_map: the map.
            params: see there.
            known: panes found before, by their probability; beams can overrule them.
        """
        self._p = params
        self._mapped = MappedSurfaces(grid_map, params.pane_speck_m, params.pane_near_wall_m)
        self._scans = KeptScans(params.pane_spacing_m, params.pane_max_scans)
        self._unmapped: Dict[int, _Unmapped] = {}  # by row of the kept scan
        self._walls: Dict[str, WallIntensity] = {}  # by lidar
        self._last: Dict[str, np.ndarray] = {}  # map_from_base of the last kept scan, by lidar
        self._given = tuple(known)
        self._remembered = tuple(known)
        self._new: Set[int] = set()  # rows kept since panes() was last called

    @property
    def due(self) -> bool:
        """Whether enough was seen since panes() was last called for another call to be worth its time."""
        return len(self._new) >= _DUE_SCANS

    def observe(self, scan: Scan, map_from_base: np.ndarray, covariance: np.ndarray) -> bool:
        """Learn from a scan.

        Args:
            scan: one revolution of a lidar.
            map_from_base: (3,) pose at its stamp, one that is trusted.
            covariance: (3, 3) of that pose.

        Returns:
            whether it is kept: the robot has moved on since the last one, and the pose is certain enough.
        """
        p = self._p
        deviation = np.sqrt(np.diag(covariance))
        if deviation[:2].max() > p.pane_max_sigma_m or deviation[2] > p.pane_max_sigma_rad:
            return False
        last = self._last.get(scan.lidar)
        if last is not None:
            way_m, turn_rad = kept_scans.moved(last, map_from_base)
            if way_m < p.pane_spacing_m and turn_rad < _TURN_RAD:
                return False
        self._last[scan.lidar] = np.array(map_from_base, float)
        laser = se2.compose(map_from_base, scan.base_from_laser)
        mapped_m = self._mapped.first_m(laser, scan.angles_rad, min(scan.range_max_m, _LOOK_FARTHER * p.pane_reach_m))
        row = self._scans.keep(scan, map_from_base, mapped_m)
        self._unmapped[row] = self._unmapped_returns(scan, laser, mapped_m)
        self._new.add(row)
        return True

    def panes(self, anew: bool = False) -> List[Pane]:
        """All candidates so far, most probable first.

        Looks again where the robot has been since the last call, which takes some ten milliseconds.

        Args:
            anew: look again everywhere.
        """
        laser_m = self._scans.map_from_laser[:, :2]
        area = _Box.around(laser_m if anew else laser_m[sorted(self._new)], self._p.pane_reach_m)
        again = [pane for pane in self._remembered if area.meets(_box_of(pane, 0.0))]
        found: List[Pane] = []
        returns = self._returns([area, *(_box_of(pane, _SAME_ACROSS_M) for pane in again)])
        for line in pane_lines.traced(returns, _LEAST_VOTES_M, _LEAST_SCANS):
            found += [pane for pane in self._along(line, returns) if not _is_one_of(pane, found)]
        kept = [pane for pane, lies in zip(self._remembered, _lie_on(self._remembered, found)) if not lies]
        kept = [self._judged_again(pane) if pane in again else pane for pane in kept]
        found += [pane for pane in kept if pane.probability >= _FORGOTTEN]
        found.sort(key=lambda pane: -pane.probability)
        self._new.clear()
        self._remembered = tuple(found)
        return found

    def _unmapped_returns(self, scan: Scan, laser: np.ndarray, mapped_m: np.ndarray) -> _Unmapped:
        """The returns that may be of a pane."""
        with np.errstate(invalid="ignore"):
            early = np.flatnonzero(
                scan.answered
                & (scan.ranges_m < mapped_m - self._p.pane_near_wall_m)
                & (scan.ranges_m <= self._p.pane_reach_m)
            )
        beam_rad = laser[2] + scan.angles_rad[early]
        range_m = scan.ranges_m[early]
        points_m = laser[:2] + range_m[:, None] * np.stack([np.cos(beam_rad), np.sin(beam_rad)], axis=-1)
        step_rad = float(np.median(np.abs(np.diff(scan.angles_rad)))) if len(scan) > 1 else 0.0
        chosen = np.flatnonzero(_may_be_normal(early, points_m, beam_rad) & ~self._mapped.is_near(points_m))
        width_m = step_rad * range_m[chosen]
        one_each = np.flatnonzero(np.diff(np.floor(np.cumsum(np.minimum(1.0, width_m / _THIN_M))), prepend=0.0))
        chosen = chosen[one_each]
        excess = self._excess(scan, mapped_m)[early[chosen]]
        return points_m[chosen], beam_rad[chosen], np.maximum(width_m[one_each], _THIN_M), excess

    def _excess(self, scan: Scan, mapped_m: np.ndarray) -> np.ndarray:
        """(B,) intensities in excess of walls' (NaN: unknown), by WallIntensity, which learns from the scan."""
        if scan.intensities is None:
            return np.full(len(scan), np.nan)
        walls = self._walls.setdefault(scan.lidar, WallIntensity())
        ranges_m = np.where(scan.answered, scan.ranges_m, np.nan)
        points_m = ranges_m[:, None] * np.stack([np.cos(scan.angles_rad), np.sin(scan.angles_rad)], axis=-1)
        incidence_rad = wall_intensity.incidence(points_m, scan.angles_rad)
        mapped = np.flatnonzero(np.abs(ranges_m - mapped_m) <= self._p.pane_near_wall_m)
        walls.learn(ranges_m[mapped], incidence_rad[mapped], scan.intensities[mapped])
        return walls.excess(ranges_m, incidence_rad, scan.intensities)

    def _returns(self, boxes: "Sequence[_Box]") -> Returns:
        """All returns in the given boxes."""
        laser_m = self._scans.map_from_laser[:, :2]
        rows = np.flatnonzero(np.any([box.contains(laser_m, self._p.pane_reach_m) for box in boxes], axis=0)).tolist()
        parts = [self._unmapped[row] for row in rows] or [(np.zeros((0, 2)), np.zeros(0), np.zeros(0), np.zeros(0))]
        points_m, beam_rad, width_m, excess = (np.concatenate(values) for values in zip(*parts))
        scan = np.repeat(rows or [0], [len(part[1]) for part in parts])
        inside = np.any([box.contains(points_m, 0.0) for box in boxes], axis=0)
        return Returns(points_m[inside], beam_rad[inside], width_m[inside], scan[inside], excess[inside])

    def _along(self, line: Line, returns: Returns) -> List[Pane]:
        """The panes on a line: stretches of it that were seen head-on, and what joins them."""
        p = self._p
        count = int(np.ceil((line.last_m - line.first_m + 2.0 * p.pane_join_m) / PIECE_M))
        at_m = line.first_m - p.pane_join_m + (np.arange(count) + 0.5) * PIECE_M
        middle_m = line.centre_m + at_m[:, None] * line.along
        members_m = (returns.points_m[line.members] - line.centre_m) @ line.along
        member = np.rint((members_m - at_m[0]) / PIECE_M).astype(int)
        mapped = self._mapped.is_near(middle_m)
        seen_head_on = (np.bincount(member, minlength=count)[:count] > 0) & ~mapped
        counts = pane_evidence.counts(self._scans, middle_m, line.normal, p.pane_reach_m)
        likelihoods = Likelihoods(counts)
        kinds = likelihoods.kinds(seen_head_on, mapped)
        supported = np.flatnonzero(seen_head_on & (kinds == Kind.PANE))
        mapped |= kinds != Kind.PANE  # posts, mapped or not, say nothing of the panes beside them
        panes = []
        for first, last in self._stretches(supported, kinds):
            inside = np.arange(first, last + 1)
            ends_m = at_m[first] - 0.5 * PIECE_M, at_m[last] + 0.5 * PIECE_M
            members = line.members[(member >= first) & (member <= last)]
            stretch = _Stretch(ends_m, inside[~mapped[first : last + 1]], members)
            pane = self._pane(line, stretch, returns, counts, likelihoods)
            panes += [] if pane is None else [pane]
        return panes

    def _stretches(self, supported: np.ndarray, kinds: np.ndarray) -> List[Tuple[int, int]]:
        """First and last piece of each stretch of supported pieces, joined over short gaps and posts."""
        most, post = int(round(self._p.pane_join_m / PIECE_M)), int(round(_POST_M / PIECE_M))
        stretches: List[Tuple[int, int]] = []
        for at in supported.tolist():
            if stretches:
                first, last = stretches[-1]
                gap = kinds[last + 1 : at]
                if len(gap) <= most and not (gap == Kind.NOTHING).any() and (gap == Kind.THING).sum() <= post:
                    stretches[-1] = first, at
                    continue
            stretches.append((at, at))
        return stretches

    def _pane(
        self, line: Line, stretch: _Stretch, returns: Returns, counts: Counts, likelihoods: Likelihoods
    ) -> Optional[Pane]:
        """The pane on a stretch of a line; None if too little of it was seen."""
        own, ends_m = stretch.own, stretch.ends_m
        seen_from_m = max(float(counts.seen_from_m[own].max()), ends_m[1] - ends_m[0])
        if (len(own) + 0.5) * PIECE_M < self._p.pane_min_length_m or seen_from_m < _LEAST_SPREAD_M:
            return None
        start_m, end_m = self._to_wall(line, ends_m[0], -1.0), self._to_wall(line, ends_m[1], 1.0)
        pane = Pane(
            line.centre_m + start_m * line.along,
            line.centre_m + end_m * line.along,
            1.0,
            counts.head_on(own),
            counts.oblique(own),
            seen_from_m,
            line.covariance,
        )
        before = next((known.probability for known in self._given if _is_one_of(pane, [known])), 0.0)
        held = sum(self._is_held(line, end_m, sign) for end_m, sign in zip(ends_m, (-1.0, 1.0)))
        share = 1.0 if held else min(1.0, pane.length_m / _LOOSE_M) ** 2
        scans = min(len(np.unique(returns.scan[stretch.members])), _SURE_SCANS)
        inner = own[1:-1]  # beams pass the edges of a thing
        beams = share * likelihoods.whole(inner) / _SURE_SCANS + line.straightness(returns.points_m[stretch.members])
        intensity = wall_intensity.log_odds(returns.excess[stretch.members])
        log_odds = self._prior(before) + _HELD_LOG_ODDS[held] + scans * beams + intensity
        return replace(pane, probability=_probability(log_odds))

    def _is_held(self, line: Line, end_m: float, sign: float) -> bool:
        """Whether a mapped surface (wall, post, other pane) continues the line at this end."""
        reach_m = self._p.pane_to_wall_m + self._p.pane_near_wall_m
        along_m = end_m + sign * np.arange(0.0, reach_m + _THIN_M, _THIN_M)
        return bool(self._mapped.is_speck(line.centre_m + along_m[:, None] * line.along).any())

    def _to_wall(self, line: Line, end_m: float, sign: float) -> float:
        """The end of the pane, extended along the line to the mapped wall near it, if there is one."""
        reach_m = self._p.pane_to_wall_m + self._p.pane_near_wall_m
        step_m = 0.5 * self._mapped.resolution_m
        along_m = end_m + sign * np.arange(0.0, reach_m + step_m, step_m)
        met = np.flatnonzero(self._mapped.is_surface(line.centre_m + along_m[:, None] * line.along))
        return float(along_m[met[0]]) if len(met) else end_m

    def _judged_again(self, pane: Pane) -> Pane:
        """Update a known pane that was not traced this time, by the beams since."""
        count = max(int(pane.length_m / PIECE_M), 1)
        middle_m = pane.start_m + (np.arange(count) + 0.5)[:, None] / count * pane.length_m * pane.direction
        normal = np.array([-pane.direction[1], pane.direction[0]])
        counts = pane_evidence.counts(self._scans, middle_m, normal, self._p.pane_reach_m)
        own = np.flatnonzero(~self._mapped.is_near(middle_m))
        if not (counts.returns[own].any() or counts.passes[own].any()):
            return pane
        log_odds = self._prior(pane.probability) + Likelihoods(counts).whole(own)
        return replace(pane, probability=_probability(min(log_odds, _log_odds(pane.probability))))

    def _prior(self, before: float) -> float:
        """Log odds before any beams are counted, from the pane's earlier probability; 0 for a new pane."""
        known = np.clip(_log_odds(before), -_KNOWN_LOG_ODDS, _KNOWN_LOG_ODDS)
        return max(_log_odds(self._p.pane_prior), float(known))


@dataclass(frozen=True)
class _Box:
    """An axis-parallel box in the map."""

    low_m: np.ndarray  # (2,)
    high_m: np.ndarray  # (2,)

    @staticmethod
    def around(points_m: np.ndarray, margin_m: float) -> "_Box":
        """The box of points (N, 2) with a margin; empty without points."""
        low_m = points_m.min(axis=0, initial=np.inf) - margin_m
        return _Box(low_m, points_m.max(axis=0, initial=-np.inf) + margin_m)

    def contains(self, points_m: np.ndarray, margin_m: float) -> np.ndarray:
        """(...) bool: points (..., 2) lie in the box, or no farther from it than the margin."""
        return ((points_m >= self.low_m - margin_m) & (points_m <= self.high_m + margin_m)).all(axis=-1)

    def meets(self, other: "_Box") -> bool:
        return bool((self.low_m <= other.high_m).all() and (other.low_m <= self.high_m).all())


def _box_of(pane: Pane, margin_m: float) -> _Box:
    return _Box.around(np.array([pane.start_m, pane.end_m]), margin_m)


def _may_be_normal(beam: np.ndarray, points_m: np.ndarray, beam_rad: np.ndarray) -> np.ndarray:
    """(N,) bool: what the beams met may be at right angles to them, as far as the ends of their neighbours tell.

    Args:
        beam: (N,) their numbers in the scan, ascending.
        points_m: (N, 2) where they ended.
        beam_rad: (N,) their directions.
    """
    index = np.arange(len(beam))
    after, before = np.minimum(index + _CHORD, len(beam) - 1), np.maximum(index - _CHORD, 0)
    chord = points_m[after] - points_m[before]
    along_beam = np.abs(chord[:, 0] * np.cos(beam_rad) + chord[:, 1] * np.sin(beam_rad))
    one_thing = (beam[after] - beam[before] == after - before) & (along_beam < _DEPTH_M)
    return ~one_thing | (along_beam <= _MAX_SLOPE * np.hypot(chord[:, 0], chord[:, 1]) + _RANGE_ERROR_M)


def _is_one_of(pane: Pane, others: Sequence[Pane]) -> bool:
    """Whether the middle of the pane lies on another one of the same direction."""
    return bool(_lie_on([pane], others)[0])


def _lie_on(panes: Sequence[Pane], others: Sequence[Pane]) -> np.ndarray:
    """(P,) bool: whether the middle of each pane lies on one of the O others, of the same direction."""
    (start_m, end_m), (other_m, other_end_m) = _ends(panes), _ends(others)
    length_m, other_length_m = np.hypot(*(end_m - start_m).T), np.hypot(*(other_end_m - other_m).T)
    along, other_along = (end_m - start_m) / length_m[:, None], (other_end_m - other_m) / other_length_m[:, None]
    x_m, y_m = np.moveaxis(0.5 * (start_m + end_m)[:, None] - other_m, -1, 0)  # (P, O) of the middles
    at_m = x_m * other_along[:, 0] + y_m * other_along[:, 1]
    across_m = np.abs(y_m * other_along[:, 0] - x_m * other_along[:, 1])
    on_it = (across_m < _SAME_ACROSS_M) & (at_m >= 0.0) & (at_m <= other_length_m)
    lies: np.ndarray = (on_it & (np.abs(along @ other_along.T) > _SAME_COS)).any(axis=1)
    return lies


def _ends(panes: Sequence[Pane]) -> Tuple[np.ndarray, np.ndarray]:
    """(P, 2) where they start, (P, 2) where they end."""
    ends_m = np.array([[pane.start_m, pane.end_m] for pane in panes], float).reshape(-1, 2, 2)
    return ends_m[:, 0], ends_m[:, 1]


def _log_odds(probability: float) -> float:
    bounded = min(max(probability, 1e-9), 1.0 - 1e-9)
    return float(np.log(bounded / (1.0 - bounded)))


def _probability(log_odds: float) -> float:
    return float(1.0 / (1.0 + np.exp(-np.clip(log_odds, -_MOST_LOG_ODDS, _MOST_LOG_ODDS))))
