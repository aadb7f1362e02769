"""Pictures say what their axes are, and print no label over another."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from glass_nav.evaluation.plots import atlas_picture, canvas
from glass_nav.evaluation.plots.atlas_picture import AtlasDrawing
from glass_nav.evaluation.plots.labels import Labels


def map_axes(side_m=10.0):
    figure = canvas.new_figure(4.0, 4.0)
    axes = figure.subplots()
    canvas.frame(axes, np.zeros(2), np.full(2, side_m))
    return figure, axes


def boxes(axes):
    renderer = axes.figure.canvas.get_renderer()
    return [text.get_window_extent(renderer) for text in axes.texts]


@pytest.mark.parametrize("seed", range(5))
def test_no_label_is_printed_over_another(seed):
    figure, axes = map_axes()
    labels = Labels(axes)
    rng = np.random.default_rng(seed)
    placed = [labels.add(point, str(number), 7.0) for number, point in enumerate(rng.uniform(1, 9, (120, 2)))]
    figure.canvas.draw()
    assert 30 < sum(placed) < 120 and len(axes.texts) == sum(placed)
    for one, other in itertools.combinations(boxes(axes), 2):
        assert not (one.x0 < other.x1 and other.x0 < one.x1 and one.y0 < other.y1 and other.y0 < one.y1)


def test_labels_with_room_are_all_there():
    _, axes = map_axes()
    labels = Labels(axes)
    assert all(labels.add(np.array([x, y]), "12", 7.0) for x in (2.0, 5.0, 8.0) for y in (2.0, 5.0, 8.0))


def test_a_second_label_at_one_point_goes_to_another_side_and_a_centred_one_is_left_out():
    _, axes = map_axes()
    labels = Labels(axes)
    point = np.array([5.0, 5.0])
    assert [labels.add(point, "1", 7.0) for _ in range(5)] == [True] * 4 + [False]
    _, axes = map_axes()
    labels = Labels(axes)
    assert [labels.add(point, "1", 7.0, centred=True) for _ in range(2)] == [True, False]


def test_the_axes_of_a_map_have_a_name_and_a_unit():
    _, axes = map_axes()
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [m]", "y [m]")


def test_the_legend_of_an_atlas_counts_nodes_by_degree(tmp_path, monkeypatch):
    drawn = []
    figure_of = atlas_picture.new_figure
    monkeypatch.setattr(atlas_picture, "new_figure", lambda *size: drawn.append(figure_of(*size)) or drawn[-1])
    position_m = np.array([[0.0, 0.0], [5.0, 0.0], [5.0, 4.0], [9.0, 0.0]])
    lines = [position_m[[1, other]] for other in (0, 2, 3)]
    none = [np.zeros((0, 4))] * 3
    atlas = AtlasDrawing(position_m, np.full(4, 0.8), np.array([1, 3, 1, 1]), lines, none, none)
    atlas_picture.draw_atlas(tmp_path / "a.png", None, atlas, "floor")
    (figure,) = drawn
    words = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert words == ["degree 1 (dead end): 3", "degree 3: 1"]
    for axes in figure.axes:
        assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [m]", "y [m]")
