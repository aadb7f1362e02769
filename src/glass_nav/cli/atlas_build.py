"""glass_nav atlas build: builds the atlas of a map."""

from __future__ import annotations

import argparse
import re
from contextlib import contextmanager
from pathlib import Path
from typing import Callable, Iterator, Optional

from glass_nav.cli.progress import Progress
from glass_nav.topology.atlas import atlas_builder, atlas_file
from glass_nav.topology.atlas.atlas import KINDS, Atlas
from glass_nav.topology.atlas.atlas_builder import BuildParams
from glass_nav.topology.atlas.edge_views import ViewParams
from glass_nav.topology.atlas.voronoi.graph import VoronoiGraph
from glass_nav.topology.atlas.voronoi_graph import VoronoiParams
from glass_nav.world import map_file

HELP = "build the atlas of a map"
DESCRIPTION = """Builds the atlas of a map: the generalized Voronoi graph of its free space with its lengths and
distances, and the wall segments that a robot sees along each edge in each direction. Glass needs no marking: it is occupied like any wall."""
EXAMPLES = (
    "glass_nav atlas build floor.yaml --out atlas/floor",
    "glass_nav atlas build floor.yaml --out atlas/floor --force",
)

NPZ_FROM_NODES = 10000  # a JSON of that many is slow to load

_GRAPH, _VIEW = VoronoiParams(), ViewParams()


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the subcommand."""
    parser.add_argument("map", metavar="MAP", type=Path, help="map_server .yaml, or MRPT .gridmap[.gz]")
    parser.add_argument(
        "--out",
        required=True,
        type=Path,
        metavar="DIR",
        help=f"folder for atlas.json, such as atlas/NAME; for an atlas of {NPZ_FROM_NODES} nodes or more, atlas.npz",
    )
    parser.add_argument("--name", help="name of the atlas; default: that of the folder")
    parser.add_argument("--force", action="store_true", help="replace an atlas that contains statistics of robots")
    _numbers(
        parser.add_argument_group("robot"),
        [
            ("--robot-radius", "robot_radius_m", "radius of the robot; it cannot use narrower passages, m"),
            ("--passage-margin", "passage_margin_m", "additional clearance on each side of a passage, m"),
            ("--view-range", "view_range_m", "range of the lidar for the segment maps, m"),
            ("--field-of-view", "field_of_view_deg", "field of view of the lidar, centred ahead, degrees"),
        ],
    )
    _numbers(
        parser.add_argument_group("graph"),
        [
            ("--smallest-obstacle", "smallest_obstacle_m", "smaller free-standing objects create no meetpoints, m"),
            ("--leaf", "leaf_m", "shorter dead ends are removed: length and widening beyond the walls, m"),
            ("--leaf-share", "leaf_share_of_r", "the same as a share of the distance from the walls at the junction"),
            ("--merge", "merge_m", "meetpoints closer than this are merged, m"),
            ("--equidistance", "equidistance_m", "differences between distances that count as equal, m"),
            (
                "--smallest-component",
                "smallest_component_m",
                "parts of the graph with a smaller total length are left out, m",
            ),
        ],
    )


def _numbers(group: "argparse._ArgumentGroup", options: "list[tuple[str, str, str]]") -> None:
    for option, field, what in options:
        default = getattr(_GRAPH, field) if hasattr(_GRAPH, field) else getattr(_VIEW, field)
        group.add_argument(
            option, dest=field, type=float, default=default, metavar="N", help=f"{what} (default {default:g})"
        )


def usage_error(arguments: argparse.Namespace) -> Optional[str]:
    """What is wrong with the options as such, before any file is opened."""
    try:
        _params(arguments)
    except ValueError as err:
        field, _, rest = str(err).partition(" ")
        return f"--{re.sub('_(m|deg|of_r)$', '', field).replace('_', '-')} {rest}"
    return None


def main(arguments: argparse.Namespace) -> None:
    """Load, build, write.

    Raises:
        MapError, AtlasError, OSError: bad input; one line.
    """
    grid_map = map_file.load(arguments.map)
    old = [arguments.out / name for name in (atlas_file.JSON_NAME, atlas_file.NPZ_NAME)]
    if not arguments.force:
        for path in old:
            _refuse_to_lose_visits(path)
    name = arguments.name or arguments.out.resolve().name
    atlas, graph = atlas_builder.build(grid_map, name, map_file.name_of(arguments.map), _params(arguments), _watch)
    arguments.out.mkdir(parents=True, exist_ok=True)
    chosen = old[len(atlas.nodes) >= NPZ_FROM_NODES]
    atlas_file.save(atlas, chosen)
    for path in old:
        if path != chosen and path.exists():  # the folder holds one atlas
            path.unlink()
    print(f"{_line(atlas, graph)}; written to {chosen} ({chosen.stat().st_size / 1e3:.0f} kB)")


def _refuse_to_lose_visits(path: Path) -> None:
    if path.exists():
        visits = atlas_file.load(path).visits
        count = int(visits.node_count.sum() + visits.edge_count.sum())
        if count:
            raise ValueError(f"{path}: {count} visits of robots would be lost; give another --out, or --force")


def _params(arguments: argparse.Namespace) -> BuildParams:
    values = vars(arguments)
    return BuildParams(
        VoronoiParams(**{field: values[field] for field in vars(_GRAPH)}),
        ViewParams(**{field: values[field] for field in vars(_VIEW) if field in values}),
    )


@contextmanager
def _watch(what: str, steps: int) -> Iterator[Callable[[], None]]:
    progress = Progress(what, steps, unit="steps" if what == "graph" else "edges")
    try:
        yield progress.step
    finally:
        progress.finish()


def _line(atlas: Atlas, graph: VoronoiGraph) -> str:
    kinds = ", ".join(
        f"{count} {name.replace('_', ' ')}{'s' if count != 1 else ''}"
        for name, count in ((name, int((atlas.nodes.kind == kind).sum())) for kind, name in enumerate(KINDS))
        if count
    )
    parts, _ = atlas.components()
    left_out = f" ({graph.left_out} too small)" if graph.left_out else ""
    return (
        f"{len(atlas.nodes)} nodes ({kinds}), {len(atlas.edges)} edges, {atlas.edges.length_m.sum():.0f} m of "
        f"ways in {parts} part{'s' if parts != 1 else ''} of the floor{left_out}, "
        f"{len(atlas.darts.segments_m.values)} segments"
    )
