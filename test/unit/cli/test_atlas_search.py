"""glass_nav atlas check, explain and wake-up, as they are typed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glass_nav.cli import main as cli
from glass_nav.cli import search_params
from glass_nav.ros.topology import topology_params
from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.topology.atlas.atlas import Atlas, Darts, Edges, MapReference, Nodes, Ragged, Visits, rings_clockwise
from glass_nav.topology.search.search_params import SearchParams

REPO = Path(__file__).parents[3]


def run(*arguments: str) -> int:
    return cli.main(["atlas", *arguments])


def straight(path: Path) -> Path:
    """A corridor between equal dead ends, which looks the same from both."""
    node, bearing = np.array([0, 1]), np.array([0.0, np.pi])
    atlas = Atlas(
        "straight",
        MapReference("none", ""),
        Nodes(np.array([[0.0, 0.0], [9.0, 0.0]]), np.ones(2), np.full(2, 0.02), np.ones(2, np.int8)),
        Edges(np.array([9.0]), np.array([9.0]), np.array([0.02]), np.array([1.0]), Ragged.empty(1, 2)),
        Darts(node, bearing, Ragged.empty(2, 4)),
        rings_clockwise(node, bearing, 2),
        Visits.none(2, 1),
    )
    atlas_file.save(atlas, path)
    return path


def test_explain_without_arguments_draws_the_worked_example(capsys: Any) -> None:
    assert run("explain") == 0
    printed = capsys.readouterr().out
    assert printed.index("Search depth 0") < printed.index("Search depth 1") < printed.index("Search depth 2")
    assert "Search depth 3" not in printed
    assert "CONFIRMED" in printed and printed.rstrip().endswith("The robot came by the nodes 0 -> 1 -> 0.")


def test_explain_searches_any_atlas_from_any_dart(capsys: Any) -> None:
    assert run("explain", "glass_bridge", "--dart", "5", "--best") == 0
    printed = capsys.readouterr().out
    assert "TENTATIVE: one candidate" in printed and "CONFIRMED" in printed
    atlas = atlas_file.load(shipped_atlases.find("glass_bridge"))
    assert f"The robot came by the nodes {atlas.darts.node[5]} -> {atlas.darts.node[4]} ->" in printed


def test_check_of_a_shipped_atlas_says_how_many_edges_a_robot_needs(capsys: Any) -> None:
    assert run("check", "document_example") == 0
    printed = capsys.readouterr().out
    assert "atlas.json: in order" in printed and "4 nodes (2 meetpoints, 2 dead ends), 4 edges of 28 m" in printed
    assert "a robot that wakes up (everywhere) knows its place after at most 5 edges, 4.0 on average" in printed
    assert "no two places are indistinguishable" in printed


def test_check_says_which_places_are_indistinguishable(tmp_path: Path, capsys: Any) -> None:
    assert run("check", str(straight(tmp_path / "straight.json"))) == 0
    printed = capsys.readouterr().out
    assert "no robot that wakes up (everywhere) can find out where it is" in printed
    assert "1 sets of places are indistinguishable" in printed
    assert "node 0 looking 0 deg, node 1 looking 180 deg" in printed


def test_check_tries_as_many_places_as_it_is_reported(capsys: Any) -> None:
    assert run("check", "glass_bridge", "--starts", "7", "--map", str(REPO / "maps" / "glass_bridge" / "map.yaml")) == 0
    places = len(atlas_file.load(shipped_atlases.find("glass_bridge")).darts)
    assert places > 7
    assert f"a robot that wakes up (7 of {places} places)" in capsys.readouterr().out


def test_check_refuses_the_atlas_of_another_map(capsys: Any) -> None:
    other = REPO / "maps" / "glass_wedge" / "map.yaml"
    assert run("check", "glass_bridge", "--map", str(other)) == 3
    (line,) = capsys.readouterr().err.splitlines()
    assert f"was made from another map than {other}: from glass_bridge with sha256" in line
    assert line.startswith(f"glass_nav atlas: {shipped_atlases.find('glass_bridge')}: ")


def test_wake_up_writes_the_figures_and_they_repeat(tmp_path: Path, capsys: Any) -> None:
    figures = []
    for name in ("one.json", "two.json"):
        assert (
            run(
                "wake-up",
                "glass_bridge",
                "--trials",
                "30",
                "--seed",
                "4",
                "--missed",
                "0.1",
                "--out",
                str(tmp_path / name),
            )
            == 0
        )
        figures.append(json.loads((tmp_path / name).read_text()))
    assert "30 robots: confirmed" in capsys.readouterr().out
    assert {
        "confirmed_share",
        "wrong_share",
        "ambiguous_share",
        "lost_share",
        "edges_mean",
        "edges_p95",
        "step_ms_max",
    } <= figures[0].keys()
    assert figures[0]["trials"] == 30 and figures[0]["params"]["vote_mode"] == "best"
    for each in figures:
        del each["step_ms_max"]
    assert figures[0] == figures[1]


def test_robots_elsewhere_are_not_told_a_place(tmp_path: Path) -> None:
    out = tmp_path / "metrics.json"
    assert run("wake-up", "glass_bridge", "--trials", "30", "--elsewhere", "--out", str(out)) == 0
    assert json.loads(out.read_text())["lost_share"] == 1.0


def test_the_parameters_of_a_node_serve_as_they_are(tmp_path: Path) -> None:
    assert search_params.load(REPO / "config" / "topology.yaml") == SearchParams()
    assert search_params.load(None) == SearchParams()
    out, file = tmp_path / "metrics.json", tmp_path / "params.yaml"
    file.write_text("vote_mode: seed\nconfirm_edges: 0\natlas: nowhere\n")
    assert run("wake-up", "glass_bridge", "--trials", "3", "--params", str(file), "--out", str(out)) == 0
    assert json.loads(out.read_text())["params"]["vote_mode"] == "seed"
    file.write_text("confirm_edge: 1\n")
    with pytest.raises(ValueError, match="unknown parameter ~confirm_edge; did you mean ~confirm_edges?"):
        search_params.load(file)


def test_the_names_that_only_a_node_uses_are_those_of_the_node() -> None:
    from glass_nav import params

    known = set(params.names(topology_params.TopologyParams))
    assert known - set(params.names(SearchParams)) == search_params.NODE_ONLY


@pytest.mark.parametrize(
    "arguments, line",
    [
        (("explain", "--dart", "-1"), "glass_nav atlas: explain: --dart must be >= 0, got -1"),
        (("check", "document_example", "--starts", "0"), "glass_nav atlas: check: --starts must be >= 1, got 0"),
        (("wake-up", "document_example", "--trials", "0"), "glass_nav atlas: wake-up: --trials must be >= 1, got 0"),
        (("wake-up", "document_example", "--seed", "-1"), "glass_nav atlas: wake-up: --seed must be >= 0, got -1"),
        (
            ("wake-up", "document_example", "--missed", "1"),
            "glass_nav atlas: wake-up: --missed must be in [0, 1), got 1.0",
        ),
        (
            ("wake-up", "document_example", "--noise", "-1"),
            "glass_nav atlas: wake-up: --noise must be in [0, 100), got -1.0",
        ),
    ],
)
def test_wrong_options_are_refused_in_one_line(arguments: Any, line: str, capsys: Any) -> None:
    assert run(*arguments) == 2
    assert capsys.readouterr().err.strip() == line


def test_bad_input_is_refused_in_one_line(tmp_path: Path, capsys: Any) -> None:
    assert run("explain", "document_example", "--dart", "8") == 3
    assert capsys.readouterr().err.strip().endswith("atlas.json: there is no dart 8, allowed 0 to 7")
    assert run("check", "glass_brigde") == 3
    assert capsys.readouterr().err.strip().endswith("did you mean glass_bridge?")
    assert run("wake-up", str(tmp_path / "none.npz")) == 3
    assert capsys.readouterr().err.strip() == f"glass_nav atlas: {tmp_path / 'none.npz'}: does not exist"


def test_check_says_what_robots_taught_the_atlas(tmp_path: Path, capsys: Any) -> None:
    atlas = atlas_file.load(straight(tmp_path / "straight.json"))
    atlas.visits.add_nodes(np.zeros(4, np.int64), np.full(4, atlas.nodes.r_m[0] + 0.02))
    atlas.visits.add_edges(np.zeros(5, np.int64), np.full(5, atlas.edges.length_m[0] + 0.05))
    atlas.visits.add_misses(np.array([1, 1, 1]))
    atlas_file.save(atlas, tmp_path / "visits.json")
    assert run("check", str(tmp_path / "visits.json")) == 0
    printed = capsys.readouterr().out
    assert "visits by robots: 4 of nodes, 5 of edges" in printed
    assert "learnt: node 0: 4 visits, r " in printed and "learnt: edge 0: 5 visits, length " in printed
    assert "learnt: usually missed by robots, and expected to be: nodes 1" in printed
