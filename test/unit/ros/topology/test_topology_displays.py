"""What rviz is given of an atlas and a search."""

from __future__ import annotations

import numpy as np
import pytest
from visualization_msgs.msg import Marker

from glass_nav.msg import EdgeTraversal
from glass_nav.ros.topology import topology_displays, topology_messages
from glass_nav.topology.atlas import atlas_file, shipped_atlases
from glass_nav.topology.observations import Meetpoint, ObservationError, Traversal
from glass_nav.topology.search.atlas_localizer import AtlasLocalizer
from glass_nav.topology.search.search_estimate import TurnChoice
from glass_nav.topology.search.search_params import SearchParams
from glass_nav.topology.search_decisions import SearchStatus
from glass_nav.topology.search_scene import SearchScene
from glass_nav.vocabulary import SearchState


def shown(localizer, poses, scene=None):
    """Namespace -> its first marker."""
    estimate = localizer.estimate
    status = SearchStatus(estimate.state if estimate else SearchState.WAITING, "why", 0, estimate, poses)
    atlas_markers = topology_displays.atlas_markers(localizer.atlas, "map")
    markers = topology_displays.search_markers(localizer, status, scene or SearchScene(), "map", atlas_markers)
    return {marker.ns: marker for marker in reversed(markers.markers) if marker.id == 0 or marker.ns == "rows"}


def search():
    return AtlasLocalizer(
        atlas_file.load(shipped_atlases.find("document_example")), SearchParams(vote_mode="seed", confirm_edges=0)
    )


def test_each_namespace_has_one_marker_and_only_those_of_the_state_are_shown():
    localizer = search()
    estimate = localizer.start(Meetpoint(3, 1.5))
    markers = shown(localizer, localizer.map_from_base(estimate.dart))
    assert sorted(markers) == sorted(topology_displays.NAMESPACES)
    assert {name for name, marker in markers.items() if marker.action == Marker.ADD} == {
        "atlas",
        "nodes",
        "searching",
        "text",
    }
    assert len(markers["searching"].packed) == 6 * len(estimate.dart)
    np.testing.assert_allclose(markers["searching"].packed[0, :2], [0.0, 0.0])  # at node 0


def test_what_went_is_crossed_out_and_the_way_of_what_stayed_is_drawn():
    localizer, scene = search(), SearchScene()
    localizer.start(Meetpoint(3, 1.5))
    scene.stepped(localizer)
    localizer.update(Traversal(0, 8.0, 8.0), Meetpoint(3, 1.5))
    scene.stepped(localizer)
    estimate = localizer.update(Traversal(2, 11.2, 8.0), Meetpoint(3, 1.5))
    scene.stepped(localizer)
    markers = shown(localizer, localizer.map_from_base(estimate.dart), scene)
    assert markers["confirmed"].action == Marker.ADD and markers["searching"].action == Marker.DELETE
    crosses = markers["ruled_out"].packed
    np.testing.assert_allclose(np.unique(crosses[:, 0].round(2)), [-4.2, -3.8])  # on node 2: node 0 is where it is
    forest = markers["forest"].packed[:, :2]
    assert len(forest) == 2 + 6  # edge 0 is one line, edge 1 three
    assert np.hypot(*(forest[1::2] - forest[0::2]).T).sum() == pytest.approx(8.0 + 11.2, abs=0.01)


def test_without_a_search_there_is_the_atlas():
    markers = shown(search(), np.zeros((0, 3)))
    assert {name for name, marker in markers.items() if marker.action == Marker.ADD} == {"atlas", "nodes", "text"}


def test_a_rank_left_open_is_that_of_the_last_turn():
    msg = EdgeTraversal(rank=-1, length=5.0, chord=4.0)
    assert topology_messages.traversal_from_msg(msg, TurnChoice(2, 3)).rank == 2
    assert np.isnan(topology_messages.traversal_from_msg(msg, TurnChoice(2, 3)).turn_rad)
    with pytest.raises(ObservationError, match="rank -1 means the last turn_choice, but there was none"):
        topology_messages.traversal_from_msg(msg, None)
