"""What a robot sees of the walls on its way: rooms worked by hand."""

from __future__ import annotations

import numpy as np
import pytest
from drawn_floors import floor

from glass_nav.topology.atlas import edge_views
from glass_nav.topology.atlas.edge_views import EdgeViews, ViewParams

CORRIDOR = floor(22, 4, [(1, 1, 21, 3)])
WAY = np.array([[5.0, 2.0], [10.0, 2.0]])


def lengths(rows):
    return np.hypot(rows[:, 2] - rows[:, 0], rows[:, 3] - rows[:, 1])


def test_a_corridor_shows_its_two_walls_with_free_space_to_their_left():
    there, back = EdgeViews(CORRIDOR, ViewParams(view_range_m=3.0, field_of_view_deg=180.0)).of(WAY)
    for rows, ahead in ((there, 1.0), (back, -1.0)):
        assert len(rows) == 2
        with_robot = np.sign(rows[:, 2] - rows[:, 0]) == ahead
        right_wall = 0.975 if ahead > 0 else 3.025  # the middles of the wall's cells
        np.testing.assert_allclose(rows[with_robot][:, [1, 3]], right_wall, atol=0.01)
        np.testing.assert_allclose(rows[~with_robot][:, [1, 3]], 4.0 - right_wall, atol=0.01)
    reach = np.sqrt(3.0**2 - 1.0)  # of the rays along the walls
    for rows, (low, high) in ((there, (5.0, 10.0 + reach)), (back, (5.0 - reach, 10.0))):
        for row in rows:
            assert min(row[0], row[2]) == pytest.approx(low, abs=0.15)
            assert max(row[0], row[2]) == pytest.approx(high, abs=0.15)


def test_the_end_of_the_corridor_is_seen_on_the_way_to_it_only():
    views = EdgeViews(CORRIDOR, ViewParams(view_range_m=4.0, field_of_view_deg=120.0))
    there, back = views.of(np.array([[15.0, 2.0], [19.0, 2.0]]))
    assert len(there) == 3 and len(back) == 2
    end = there[np.abs(there[:, 0] - there[:, 2]) < 0.05]
    assert len(end) == 1 and lengths(end)[0] == pytest.approx(2.0, abs=0.2)


def test_what_stands_behind_something_is_not_seen():
    hidden = floor(22, 4, [(1, 1, 21, 3)], [(8, 1, 8.2, 3)])
    there, _ = EdgeViews(hidden, ViewParams(view_range_m=15.0)).of(np.array([[3.0, 2.0], [6.0, 2.0]]))
    assert there[:, [0, 2]].max() < 8.1


def test_walls_behind_unknown_cells_are_not_seen():
    half = floor(22, 4, [(1, 1, 21, 3)], unknown=[(12, 0, 22, 4)])
    there, _ = EdgeViews(half, ViewParams(view_range_m=15.0)).of(WAY)
    assert len(there) == 2 and there[:, [0, 2]].max() <= 12.05


def test_where_there_are_no_walls_none_are_seen():
    nothing = floor(6, 6, [(0, 0, 6, 6)])
    for rows in EdgeViews(nothing).of(np.array([[2.0, 2.0], [4.0, 4.0]])):
        assert rows.shape == (0, 4)
    far = floor(30, 30, [(1, 1, 29, 29)])
    for rows in EdgeViews(far, ViewParams(view_range_m=5.0)).of(np.array([[14.0, 15.0], [16.0, 15.0]])):
        assert rows.shape == (0, 4)


def test_things_too_small_for_a_segment_are_none():
    post = floor(22, 4, [(1, 1, 21, 3)], [(7.5, 2.5, 7.6, 2.6)])
    there, _ = EdgeViews(post, ViewParams(view_range_m=3.0)).of(WAY)
    assert (lengths(there) > 1.0).all()


def test_poses_follow_the_way():
    poses = edge_views.poses_along(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]), 0.5)
    np.testing.assert_allclose(
        poses, [[0, 0, 0], [0.5, 0, 0], [1, 0, np.pi / 2], [1, 0.5, np.pi / 2], [1, 1, np.pi / 2]], atol=1e-12
    )


@pytest.mark.parametrize(
    "values, text",
    [
        ({"view_range_m": 0.0}, "view_range_m must be finite and > 0, got 0.0"),
        ({"field_of_view_deg": 400.0}, "field_of_view_deg must be > 0 and <= 360, got 400.0"),
    ],
)
def test_bad_parameters_are_refused(values, text):
    with pytest.raises(ValueError, match=f"^{text}$"):
        ViewParams(**values)
