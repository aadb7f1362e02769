"""The nearest segment by the index, against a look at all segments one by one."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.geometry import segment_index
from glass_nav.geometry.segment_index import SegmentIndex
from glass_nav.geometry.segments import NO_SEGMENT


def distance_by_hand(point, segment):
    """The document's rule: to the line where the foot lies on the segment, else to the nearer end."""
    start, end = segment[:2], segment[2:]
    along = (end - start) / np.hypot(*(end - start))
    foot = (point - start) @ along
    if 0.0 <= foot <= np.hypot(*(end - start)):
        return abs(along[0] * (point - start)[1] - along[1] * (point - start)[0])
    return min(np.hypot(*(point - start)), np.hypot(*(point - end)))


def made(seed, count):
    rng = np.random.default_rng(seed)
    start, angle = rng.uniform(0, 30, (count, 2)), rng.uniform(-np.pi, np.pi, count)
    length = rng.uniform(0.01, 9, count)
    return np.column_stack([start, start + length[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])])


@pytest.mark.long_run
@pytest.mark.parametrize("seed, count", [(0, 1), (1, 2), (2, 40), (3, 300)])
def test_the_nearest_is_the_one_that_a_look_at_all_finds(seed, count):
    segments = made(seed, count)
    points = np.random.default_rng(seed + 100).uniform(-20, 50, (400, 2))  # some far outside of the squares
    by_hand = np.array([[distance_by_hand(point, segment) for segment in segments] for point in points])
    found = SegmentIndex(segments).nearest(points)
    np.testing.assert_allclose(found.distance, by_hand.min(axis=1), atol=1e-9)
    np.testing.assert_allclose(by_hand[np.arange(400), found.segment], by_hand.min(axis=1), atol=1e-9)
    slow, away = segment_index.nearest_of_all(points, segments)
    np.testing.assert_array_equal(found.segment, slow)
    np.testing.assert_allclose(found.distance, away, atol=1e-12)


@pytest.mark.parametrize("pairs", [7, 1000])
def test_little_memory_makes_no_difference(monkeypatch, pairs):
    segments, points = made(4, 60), np.random.default_rng(5).uniform(-5, 35, (300, 2))
    found = SegmentIndex(segments).nearest(points)
    monkeypatch.setattr(segment_index, "_MAX_PAIRS", pairs)
    again = SegmentIndex(segments).nearest(points)
    np.testing.assert_array_equal(found.segment, again.segment)
    np.testing.assert_array_equal(segment_index.nearest_of_all(points, segments)[0], again.segment)


def test_of_equally_near_ones_the_first_counts():
    wall = np.array([[0.0, 0.0, 2.0, 0.0], [2.0, 0.0, 0.0, 0.0], [2.0, 0.0, 2.0, 2.0]])
    found = SegmentIndex(wall).nearest(np.array([[1.0, 0.3], [3.0, 0.0], [2.5, 1.0]]))
    assert found.segment.tolist() == [0, 0, 2]
    np.testing.assert_allclose(found.distance, [0.3, 1.0, 0.5])


def test_the_line_of_a_segment_has_its_normal_to_the_left():
    index = SegmentIndex(np.array([[1.0, 2.0, 4.0, 2.0], [3.0, 1.0, 3.0, -1.0]]))
    np.testing.assert_allclose(index.lines, [[0, 1, 2], [1, 0, 3]], atol=1e-12)


def test_without_segments_nothing_is_near_and_without_points_nothing_is_asked():
    found = SegmentIndex(np.zeros((0, 4))).nearest(np.ones((3, 2)))
    assert found.segment.tolist() == [NO_SEGMENT] * 3 and np.isinf(found.distance).all()
    assert len(SegmentIndex(made(0, 3)).nearest(np.zeros((0, 2))).segment) == 0
    assert len(SegmentIndex(np.zeros((0, 4)))) == 0


@pytest.mark.parametrize(
    "segments, line",
    [
        (np.zeros((2, 3)), "segments must have shape (S, 4), got (2, 3)"),
        ([[0, 0, 1, 0], [1, 1, 1, 1]], "segment 1 must have finite ends and a length > 0, got [1.0, 1.0, 1.0, 1.0]"),
        ([[0, 0, np.nan, 0]], "segment 0 must have finite ends and a length > 0, got [0.0, 0.0, nan, 0.0]"),
    ],
)
def test_what_is_no_segment_is_refused(segments, line):
    with pytest.raises(ValueError) as refused:
        SegmentIndex(np.array(segments, float))
    assert str(refused.value) == line
