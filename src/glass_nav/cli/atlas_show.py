"""glass_nav atlas show: an atlas drawn over its map."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Optional

import numpy as np

from glass_nav.cli import out_file
from glass_nav.evaluation.plots import atlas_picture
from glass_nav.evaluation.plots.atlas_picture import AtlasDrawing
from glass_nav.simulation import shipped_buildings
from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.topology.atlas.atlas import Atlas, AtlasError
from glass_nav.world import map_file
from glass_nav.world.grid_map import GridMap

HELP = "draw an atlas over its map"
DESCRIPTION = """Writes a PNG: the map, nodes and edges with their numbers, and the wall segments that a robot sees along
each edge in each direction; or one edge alone."""
EXAMPLES = (
    "glass_nav atlas show glass_office --out pictures",
    "glass_nav atlas show atlas/floor --edge 3 --map floor.yaml",
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the subcommand."""
    parser.add_argument(
        "atlas",
        metavar="ATLAS",
        help="atlas.json, atlas.npz, the folder of one, or the name of an atlas of the package: "
        f"{', '.join(shipped_atlases.shipped())}",
    )
    parser.add_argument(
        "--map",
        type=Path,
        help="map_server .yaml, or MRPT .gridmap[.gz]; default: the map of the "
        "package that the atlas was made from, else none",
    )
    parser.add_argument("--edge", type=int, metavar="N", help="draw this edge only")
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("."),
        metavar="DIR",
        help="folder for NAME.png or NAME_edge_N.png, or the file (default .)",
    )


def usage_error(arguments: argparse.Namespace) -> Optional[str]:
    """What is wrong with the options as such, before any file is opened."""
    if arguments.edge is not None and arguments.edge < 0:
        return f"--edge must be >= 0, got {arguments.edge}"
    return None


def main(arguments: argparse.Namespace) -> None:
    """Load, draw.

    Raises:
        AtlasError, MapError, OSError: bad input; one line.
    """
    path = shipped_atlases.find(arguments.atlas)
    atlas = atlas_file.load(path)
    edge = arguments.edge
    if edge is not None and edge >= len(atlas.edges):
        raise AtlasError(f"{path}: --edge must be 0 to {len(atlas.edges) - 1}, got {edge}")
    grid = _map(atlas, arguments.map)
    out = out_file.in_folder(arguments.out, f"{atlas.name}.png" if edge is None else f"{atlas.name}_edge_{edge}.png")
    if edge is None:
        atlas_picture.draw_atlas(out, grid, _drawing(atlas), atlas.name)
    else:
        atlas_picture.draw_edge(out, grid, _drawing(atlas), edge, atlas.name)
    print(f"drawn to {out}" + ("" if grid is not None else "; --map MAP draws the map under it"))


def _map(atlas: Atlas, path: Optional[Path]) -> Optional[GridMap]:
    """The given map, else the shipped map with the fingerprint that the atlas names, else None."""
    if path is not None:
        grid_map = map_file.load(path)
        try:
            atlas.check_map(grid_map, "this")
        except AtlasError as err:
            raise AtlasError(f"{path}: the atlas {atlas.name} {err}") from err
        return grid_map
    building = shipped_buildings.shipped().get(atlas.source.name)
    if building is None:
        return None
    grid_map = map_file.load(building.with_name("map.yaml"))
    return grid_map if grid_map.fingerprint == atlas.source.sha256 else None


def _drawing(atlas: Atlas) -> AtlasDrawing:
    edges = range(len(atlas.edges))
    lines = []
    for edge in edges:
        line = atlas.edges.polyline_m[edge]
        lines.append(line if len(line) > 1 else atlas.nodes.position_m[atlas.darts.node[2 * edge : 2 * edge + 2]])
    return AtlasDrawing(
        atlas.nodes.position_m,
        atlas.nodes.r_m,
        np.asarray(atlas.degree),
        lines,
        [atlas.darts.segments_m[2 * edge] for edge in edges],
        [atlas.darts.segments_m[2 * edge + 1] for edge in edges],
    )
