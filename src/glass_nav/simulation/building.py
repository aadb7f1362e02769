"""Building: walls, panes and things as lines in the frame map, in metres.

Every part has two flags: mapped, it was there when the map was drawn; present, it is there now. Unmapped furniture has
mapped = False; furniture that has been removed has present = False. S surfaces: the straight pieces that a beam
can hit. Errors begin with the name of the part, so that building_file can add its number.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Dict, List, Sequence, Tuple

import numpy as np

from glass_nav.world import landmark_map
from glass_nav.world.landmark_map import LandmarkMap

MATERIALS = {"plaster": 0.7, "wood": 0.5, "metal": 0.4, "cloth": 0.3, "plant": 0.4, "black": 0.06}
LARGEST_GAP_M = 0.1  # panes nearer than this to each other are one glazing, drawn as one surface
OPAQUE, PANE, MIRROR = 0, 1, 2
TRIES = 60  # places tried for each moved thing
MOVED_M = (0.5, 3.0)  # distance by which a thing is moved
PATH_CLEARANCE_M = 0.55  # distance of a moved thing from the paths


@dataclass(frozen=True)
class Wall:
    """A wall along a polyline, which runs in the middle of its thickness."""

    line_m: np.ndarray  # (N, 2)
    thickness_m: float = 0.2
    reflectance: float = MATERIALS["plaster"]

    def __post_init__(self) -> None:
        check_line("wall", self.line_m)
        _check_positive("wall thickness", "m", self.thickness_m)
        _check_reflectance("wall", self.reflectance)


@dataclass(frozen=True)
class Pane:
    """A sheet of glass, or two of them with a gap."""

    line_m: np.ndarray  # (2, 2)
    thickness_m: float = 0.008  # of one sheet
    coating: float = 1.0  # factor on its reflectance
    glazing: str = "single"  # or "double"
    gap_m: float = 0.016  # between the sheets of a double glazing
    dirt: float = 0.004  # share of the light that dust and prints scatter, rho_d
    film: bool = False  # pasted over: beams see a wall

    def __post_init__(self) -> None:
        check_line("pane", self.line_m, most=2)
        _check_positive("pane thickness", "m", self.thickness_m)
        _check_positive("pane coating", "", self.coating)
        if self.glazing not in ("single", "double"):
            raise ValueError(f"pane glazing must be single or double, got {self.glazing!r}")
        if not 0.0 < self.gap_m < LARGEST_GAP_M:
            raise ValueError(
                f"pane gap must be > 0 and < {LARGEST_GAP_M:g} m (else they are two panes), got {self.gap_m}"
            )
        if not 0.0 <= self.dirt <= 0.1:
            raise ValueError(f"pane dirt must be 0 to 0.1, got {self.dirt}")


@dataclass(frozen=True)
class Mirror:
    """A mirror: to a beam, glass that transmits nothing."""

    line_m: np.ndarray  # (2, 2)
    reflectance: float = 0.9

    def __post_init__(self) -> None:
        check_line("mirror", self.line_m, most=2)
        _check_reflectance("mirror", self.reflectance)


@dataclass(frozen=True)
class Door:
    """A door leaf; an open door has no surface."""

    line_m: np.ndarray  # (2, 2)
    mapped: str = "closed"  # or "open": when the map was drawn
    now: str = "closed"  # or "open"
    thickness_m: float = 0.05
    reflectance: float = MATERIALS["wood"]

    def __post_init__(self) -> None:
        check_line("door", self.line_m, most=2)
        for name, state in (("mapped", self.mapped), ("now", self.now)):
            if state not in ("open", "closed"):
                raise ValueError(f"door {name} must be open or closed, got {state!r}")
        _check_positive("door thickness", "m", self.thickness_m)
        _check_reflectance("door", self.reflectance)


@dataclass(frozen=True)
class Thing:
    """Furniture, a post, a tree: an outline with something opaque inside."""

    outline_m: np.ndarray  # (N, 2) corners in order
    reflectance: float = MATERIALS["wood"]
    mapped: bool = True
    present: bool = True
    movable: bool = False

    def __post_init__(self) -> None:
        check_line("thing", self.outline_m, least=3)
        x, y = np.asarray(self.outline_m, float).T
        if abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) < 2e-6:
            raise ValueError("thing has no area")
        _check_reflectance("thing", self.reflectance)


@dataclass(frozen=True)
class Person:
    """A person who walks along the waypoints and back; never mapped."""

    waypoints_m: np.ndarray  # (N, 2)
    speed_m_s: float = 1.0
    radius_m: float = 0.25

    def __post_init__(self) -> None:
        check_line("person", self.waypoints_m)
        _check_positive("person speed", "m/s", self.speed_m_s)
        _check_positive("person radius", "m", self.radius_m)


@dataclass(frozen=True)
class Surfaces:
    """The straight pieces of a building, each a line from one end to the other."""

    from_m: np.ndarray  # (S, 2)
    to_m: np.ndarray  # (S, 2)
    kind: np.ndarray  # (S,) uint8: OPAQUE, PANE, MIRROR
    mapped: np.ndarray  # (S,) bool
    present: np.ndarray  # (S,) bool
    reflectance: np.ndarray  # (S,) diffuse for OPAQUE, specular for MIRROR; unused for PANE
    thickness_m: np.ndarray  # (S,) of PANE
    coating: np.ndarray  # (S,) of PANE
    dirt: np.ndarray  # (S,) of PANE and MIRROR
    glazing: np.ndarray  # (S,) int: panes of the same number count as one surface; -1: OPAQUE
    sheets: np.ndarray  # (S,) int: how many surfaces share that number


@dataclass(frozen=True, eq=False)
class Building:
    """The building that a robot drives in, and what the map shows of it."""

    walls: Tuple[Wall, ...]
    panes: Tuple[Pane, ...] = ()
    mirrors: Tuple[Mirror, ...] = ()
    doors: Tuple[Door, ...] = ()
    things: Tuple[Thing, ...] = ()  # furniture and mullions, unmapped and removed ones included
    people: Tuple[Person, ...] = ()
    paths: Dict[str, np.ndarray] = field(default_factory=dict)  # name -> (N, 2) waypoints, free to drive
    start: np.ndarray = field(default_factory=lambda: np.zeros(3))  # (3,) map_from_base
    seen_m: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))  # (N, 2) in rooms seen too
    name: str = "building"
    tags: LandmarkMap = landmark_map.NONE  # tags that answer the beam of a landmark scanner

    @cached_property
    def surfaces(self) -> Surfaces:
        """All surfaces: present or not, mapped or not."""
        rows: List[Tuple[float, ...]] = []
        for wall in self.walls:
            for a, b in zip(wall.line_m[:-1], wall.line_m[1:]):
                along = (b - a) / np.hypot(*(b - a)) * wall.thickness_m / 2.0  # fills the corner: no gap
                rows += outline_rows(_strip(a - along, b + along, wall.thickness_m), True, True, wall.reflectance)
        for door in self.doors:
            rows += outline_rows(
                _strip(door.line_m[0], door.line_m[1], door.thickness_m),
                door.mapped == "closed",
                door.now == "closed",
                door.reflectance,
            )
        for thing in self.things:
            rows += outline_rows(thing.outline_m, thing.mapped, thing.present, thing.reflectance)
        for number, pane in enumerate(self.panes):
            a, b = np.asarray(pane.line_m, float)
            if pane.film:
                rows.append(_opaque_row(a, b, True, True, MATERIALS["plaster"]))
                continue
            normal = np.array([a[1] - b[1], b[0] - a[0]]) / np.hypot(*(b - a))
            offsets = [0.0] if pane.glazing == "single" else [-pane.gap_m / 2.0, pane.gap_m / 2.0]
            for offset in offsets:
                rows.append(
                    (
                        *(a + offset * normal),
                        *(b + offset * normal),
                        PANE,
                        True,
                        True,
                        0.0,
                        pane.thickness_m,
                        pane.coating,
                        pane.dirt,
                        number,
                        len(offsets),
                    )
                )
        for number, mirror in enumerate(self.mirrors):
            rows.append(
                (
                    *mirror.line_m[0],
                    *mirror.line_m[1],
                    MIRROR,
                    True,
                    True,
                    mirror.reflectance,
                    0.0,
                    1.0,
                    0.004,
                    len(self.panes) + number,
                    1,
                )
            )
        return surfaces_from_rows(rows)

    def opaque(self) -> "Building":
        """The same building with film on all glass and mirrors; its map does not change."""
        lines = [pane.line_m for pane in self.panes] + [mirror.line_m for mirror in self.mirrors]
        return replace(self, panes=tuple(Pane(line_m, film=True) for line_m in lines), mirrors=())

    def as_mapped(self) -> "Building":
        """The building as it was when the map was drawn, without people."""
        things = tuple(replace(thing, present=True) for thing in self.things if thing.mapped)
        return replace(
            self, things=things, doors=tuple(replace(door, now=door.mapped) for door in self.doors), people=()
        )

    def changed(self, share: float, rng: np.random.Generator) -> "Building":
        """The same building after furniture was moved; the map does not show it.

        Args:
            share: of the movable things that move, 0 to 1. Each leaves its old place and stands, unmapped, 0.5 to 3 m
                away in the same room, turned, clear of the paths. If there is no such place, it is removed.
            rng: chooses the things and their new places.
        """
        if not 0.0 <= share <= 1.0:
            raise ValueError(f"changed share must be 0 to 1, got {share}")
        movable = [index for index, thing in enumerate(self.things) if thing.movable and thing.mapped and thing.present]
        moved = rng.permutation(len(movable))[: int(round(share * len(movable)))]
        building = self
        for index in sorted(movable[number] for number in moved):
            thing = self.things[index]
            things = list(building.things)
            things[index] = replace(thing, present=False)
            building = replace(building, things=tuple(things))
            outline = building._free_place(thing.outline_m, rng)
            if outline is not None:
                new = Thing(outline, thing.reflectance, mapped=False, movable=True)
                building = replace(building, things=(*building.things, new))
        return building

    def _free_place(self, outline_m: np.ndarray, rng: np.random.Generator) -> "np.ndarray | None":
        """(N, 2) the outline, moved to a nearby place where it touches nothing; None if there is none."""
        surfaces = self.surfaces
        from_m, to_m = surfaces.from_m[surfaces.present], surfaces.to_m[surfaces.present]
        middle = outline_m.mean(axis=0)
        for _ in range(TRIES):
            turn, way, distance = rng.uniform(-np.pi, np.pi), rng.uniform(-np.pi, np.pi), rng.uniform(*MOVED_M)
            cos, sin = np.cos(turn), np.sin(turn)
            there = middle + distance * np.array([np.cos(way), np.sin(way)])
            outline = (outline_m - middle) @ np.array([[cos, sin], [-sin, cos]]) + there
            edges = np.roll(outline, -1, axis=0)
            spokes = np.tile(there, (len(outline), 1))
            if (
                not crosses(outline, edges, from_m, to_m).any()  # touches nothing
                and not crosses(spokes, outline, from_m, to_m).any()  # nor encloses a small thing
                and not crosses(middle[None], there[None], from_m, to_m).any()  # nor leaves the room
                and self._path_clearance(outline) > PATH_CLEARANCE_M
            ):
                return outline
        return None

    def _path_clearance(self, outline_m: np.ndarray) -> float:
        """Least distance [m] of the corners and edges of an outline from the paths; inf without paths."""
        edges = np.roll(outline_m, -1, axis=0)
        shares = np.linspace(0.0, 1.0, 9)[:, None, None]
        points = (outline_m + shares * (edges - outline_m)).reshape(-1, 2)
        return min(
            (float(distances(points, path[:-1], path[1:]).min()) for path in self.paths.values()), default=np.inf
        )


def surfaces_from_rows(rows: Sequence[Tuple[float, ...]]) -> Surfaces:
    """Surfaces from (x0, y0, x1, y1, kind, mapped, present, reflectance, thickness, coating, dirt, glazing, sheets)."""
    table = np.array(rows, float).reshape(-1, 13)
    return Surfaces(
        table[:, 0:2].copy(),
        table[:, 2:4].copy(),
        table[:, 4].astype(np.uint8),
        table[:, 5] > 0,
        table[:, 6] > 0,
        table[:, 7].copy(),
        table[:, 8].copy(),
        table[:, 9].copy(),
        table[:, 10].copy(),
        table[:, 11].astype(int),
        table[:, 12].astype(int),
    )


def joined(first: Surfaces, second: Surfaces) -> Surfaces:
    """Both sets joined; the second keeps its glazing numbers."""
    return Surfaces(
        **{
            name: np.concatenate([getattr(first, name), getattr(second, name)])
            for name in Surfaces.__dataclass_fields__
        }
    )


def box(x_m: float, y_m: float, length_m: float, width_m: float, yaw_rad: float = 0.0) -> np.ndarray:
    """(4, 2) corners of a box around (x, y), its length along yaw."""
    corners = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]) * [length_m, width_m]
    cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
    return corners @ np.array([[cos, sin], [-sin, cos]]) + [x_m, y_m]


def crosses(from_m: np.ndarray, to_m: np.ndarray, line_from_m: np.ndarray, line_to_m: np.ndarray) -> np.ndarray:
    """(N, M) bool: segment n (N, 2) crosses line m (M, 2); parallel ones never do."""
    way, line = (to_m - from_m)[:, None], line_to_m - line_from_m
    to_line = line_from_m - from_m[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        cross = way[..., 0] * line[:, 1] - way[..., 1] * line[:, 0]
        on_way = (to_line[..., 0] * line[:, 1] - to_line[..., 1] * line[:, 0]) / cross
        on_line = (to_line[..., 0] * way[..., 1] - to_line[..., 1] * way[..., 0]) / cross
        return (on_way >= 0.0) & (on_way <= 1.0) & (on_line >= 0.0) & (on_line <= 1.0)


def distances(points_m: np.ndarray, from_m: np.ndarray, to_m: np.ndarray) -> np.ndarray:
    """(N, M) distances [m] of points (N, 2) from segments (M, 2)."""
    way = to_m - from_m
    to_point = points_m[:, None] - from_m
    share = np.clip((to_point * way).sum(-1) / np.maximum((way**2).sum(-1), 1e-12), 0.0, 1.0)
    return np.hypot(*np.moveaxis(to_point - share[..., None] * way, -1, 0))


def _strip(a: np.ndarray, b: np.ndarray, width_m: float) -> np.ndarray:
    """(4, 2) corners of a strip along the line from a to b."""
    normal = np.array([a[1] - b[1], b[0] - a[0]]) / np.hypot(*(b - a)) * width_m / 2.0
    return np.array([a - normal, b - normal, b + normal, a + normal])


def outline_rows(outline_m: np.ndarray, mapped: bool, present: bool, reflectance: float) -> List[Tuple[float, ...]]:
    """Rows for surfaces_from_rows(): the closed outline (N, 2) of something opaque."""
    return [_opaque_row(a, b, mapped, present, reflectance) for a, b in zip(outline_m, np.roll(outline_m, -1, axis=0))]


def _opaque_row(a: np.ndarray, b: np.ndarray, mapped: bool, present: bool, reflectance: float) -> Tuple[float, ...]:
    return (*a, *b, OPAQUE, mapped, present, reflectance, 0.0, 1.0, 0.0, -1, 1)


def check_line(noun: str, line_m: np.ndarray, least: int = 2, most: int = 0) -> None:
    """Raise a ValueError unless there are enough points (N, 2), all finite and consecutive ones distinct."""
    line_m = np.asarray(line_m, float)
    article = "an" if noun[0] in "aeiou" else "a"
    if line_m.ndim != 2 or line_m.shape[1] != 2:
        raise ValueError(f"{noun} must have points of [x, y], got shape {line_m.shape}")
    if len(line_m) < least or most and len(line_m) > most:
        needs = f"{least}" if most else f"at least {least}"
        raise ValueError(
            f"{noun} has {len(line_m)} point{'s' if len(line_m) != 1 else ''}, {article} {noun} needs {needs}"
        )
    if not np.isfinite(line_m).all():
        number = int(np.argmin(np.isfinite(line_m).all(axis=1)))
        raise ValueError(f"{noun} has the point {line_m[number].tolist()}, coordinates must be finite")
    lengths = np.hypot(*np.diff(line_m, axis=0).T)
    if lengths.min() < 1e-3:
        at = line_m[int(lengths.argmin())].tolist()
        raise ValueError(f"{noun} has no length at {at}: two points one after the other are the same")


def _check_positive(what: str, unit: str, value: float) -> None:
    if not (np.isfinite(value) and value > 0.0):
        raise ValueError(f"{what} must be > 0{' ' + unit if unit else ''}, got {value}")


def _check_reflectance(noun: str, value: float) -> None:
    if not 0.0 < value <= 1.0:
        raise ValueError(f"{noun} reflectance must be > 0 and <= 1, got {value}")
