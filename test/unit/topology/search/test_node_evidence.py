from __future__ import annotations

import made_atlases
import numpy as np
import pytest

from glass_nav.topology.observations import Meetpoint
from glass_nav.topology.search.belief import NO_DART
from glass_nav.topology.search.matching import Matcher, Tolerances, poses_at
from glass_nav.topology.search.node_evidence import NodeEvidence

NO_PATH = np.zeros(0, np.int64)


def matcher(r_m: "list[float]") -> Matcher:
    """A row of nodes 10 m apart."""
    xy = [(10.0 * k, 0.0) for k in range(len(r_m))]
    atlas = made_atlases.corridors(xy, r_m, [(k, k + 1) for k in range(len(r_m) - 1)])
    return Matcher(atlas, Tolerances(), use_angles=True)


def evidence(of: Matcher, seen: Meetpoint, path: np.ndarray = NO_PATH, errors: int = 0) -> NodeEvidence:
    return NodeEvidence.of(of, seen, np.zeros(3), path, np.full(len(path), errors))


def test_a_meetpoint_speaks_for_the_poses_where_the_atlas_has_it_and_against_all_others() -> None:
    row = matcher([0.5, 1.0, 2.0, 3.0, 0.5])
    seen = Meetpoint(2, 2.0)
    every = np.arange(len(row.atlas.darts))
    darts = row.all_at(seen)
    assert row.atlas.darts.node[darts].tolist() == [2, 2]
    poses = poses_at(row.atlas, darts, seen)
    at = evidence(row, seen, every).at(np.concatenate([poses, [[10.0, 0.0, 0.0], [20.0, 3.0, 0.0]]]))
    assert at.dart.tolist() == [*darts.tolist(), NO_DART, NO_DART]
    # Two of the eight darts show it: each is four times as likely as any.
    np.testing.assert_allclose(at.nats, [np.log(4.0), np.log(4.0), -1.9, -1.9], atol=1e-6)


def test_what_all_meetpoints_have_in_common_speaks_for_none() -> None:
    row = matcher([1.0] * 12)
    seen = Meetpoint(2, 1.0)
    darts = row.all_at(seen)
    at = evidence(row, seen, darts).at(poses_at(row.atlas, darts, seen))
    np.testing.assert_allclose(at.nats, np.log(22 / 20), atol=1e-6)


def test_the_path_of_the_forest_counts() -> None:
    row = matcher([0.5, 1.0, 2.0, 3.0, 0.5])
    seen = Meetpoint(2, 2.0)
    darts = row.all_at(seen)
    poses = poses_at(row.atlas, darts, seen)
    plain, one, none = (evidence(row, seen, *given).at(poses) for given in ((darts,), (darts, 1), ()))
    assert [at.path_nats[0] for at in (plain, one, none)] == pytest.approx([0.0, -1.5, -3.0])
    assert plain.nats.tolist() == one.nats.tolist() == none.nats.tolist()


def test_a_pose_that_odometry_has_carried_may_be_further_off() -> None:
    row = matcher([0.5, 1.0, 2.0, 3.0, 0.5])
    seen = Meetpoint(2, 2.0)
    at = evidence(row, seen)
    beside = poses_at(row.atlas, row.all_at(seen)[:1], seen) + [0.0, 1.2, 0.0]
    assert at.at(beside).dart.tolist() == [NO_DART] and at.at(beside, 0.6).dart.tolist() != [NO_DART]


def test_a_meetpoint_that_the_atlas_does_not_have_speaks_against_all() -> None:
    row = matcher([0.5, 1.0, 2.0, 3.0, 0.5])
    at = evidence(row, Meetpoint(7, 2.0)).at(np.array([[10.0, 0.0, 0.0]]))
    assert (at.nats.tolist(), at.path_nats.tolist(), at.dart.tolist()) == ([-1.9], [0.0], [NO_DART])
