"""Which walls of a scan are evidence, and what is explained by chance."""

from __future__ import annotations

import numpy as np
import pytest
from made_scans import MadeScans, scan

from glass_nav.hypotheses import new_walls, view_pieces
from glass_nav.hypotheses.scan_explanation import BeamsExplained

POSES = np.array([[0.0, 0.0, 0.0], [60.0, 0.0, 0.0]])


def beams(second: float) -> BeamsExplained:
    """Of two poses, of which the first explains all of a scan."""
    scans = MadeScans(lambda poses: np.where(poses[:, 0] < 50.0, 1.0, second), np.zeros((0, 3)))
    found = scans.beams(scan(), POSES, 0.0, 0.0)
    assert found is not None
    return found


def test_only_what_is_new_at_the_pose_that_explains_most_counts() -> None:
    seen = beams(0.5)
    pieces = new_walls.pieces(seen.ends_m)
    both = np.ones(2, bool)
    np.testing.assert_allclose(view_pieces.counted(seen, pieces, both), pieces)
    np.testing.assert_allclose(view_pieces.counted(seen, 0.25 * pieces, both), 0.25 * pieces)
    np.testing.assert_allclose(view_pieces.counted(seen, np.zeros_like(pieces), both), 0.0)
    half = view_pieces.counted(seen, np.where(seen.explained[1], pieces, 0.0), np.array([False, True]))
    np.testing.assert_allclose(half, pieces)  # of the walls that this pose explains, all are new


@pytest.mark.parametrize("likely, count", [([True, True], 8), ([True, False], 0), ([False, False], 0)])
def test_likely_poses_dispute_the_beams_that_one_explains_and_another_contradicts(
    likely: "list[bool]", count: int
) -> None:
    seen = beams(0.9)
    at_m = view_pieces.disputed(seen, np.array(likely))
    disputed = ~np.isnan(at_m[:, 0])
    assert np.count_nonzero(disputed) == count
    np.testing.assert_allclose(at_m[disputed], seen.ends_m[disputed])
    assert not count or (disputed == ~seen.explained[1]).all()


def test_by_chance_as_much_is_explained_as_at_the_tenth_of_the_distinct_places() -> None:
    poses = np.zeros((24, 3))
    poses[:, 0] = np.repeat(np.arange(12.0), 2)  # two poses at each place
    share = np.repeat(np.linspace(1.0, 0.45, 12), 2)
    assert view_pieces.by_chance(poses, share) == pytest.approx(0.55)
    assert view_pieces.by_chance(poses[:18], share[:18]) is None


def test_where_the_map_knows_none_of_the_walls_it_explains_none() -> None:
    seen = beams(0.5)
    pieces = new_walls.pieces(seen.ends_m)
    np.testing.assert_allclose(view_pieces.explained_share(seen, pieces), [1.0, 0.5])
    unknown = BeamsExplained(seen.poses, seen.ends_m, ~seen.known, ~seen.known, seen.contradicted_at)
    np.testing.assert_allclose(view_pieces.explained_share(unknown, pieces), [0.0, 0.0])
