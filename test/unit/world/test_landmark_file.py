"""landmarks.yaml: what it means, and what it says when it cannot be used."""

from __future__ import annotations

import numpy as np
import pytest

from glass_nav.world import landmark_file
from glass_nav.world.landmark_file import LandmarkError
from glass_nav.world.landmark_map import LandmarkMap

GOOD = """
sigma: 0.02
view_deg: 80
range: 12
landmarks:
  - {id: A1, position: [3.2, -4.5], facing_deg: 90}
  - {id: 17, position: [9, 4.5]}
  - {id: C, position: [0, 0], facing_deg: 180, view_deg: 120, range: 5.5}
"""


def load(tmp_path, text):
    (tmp_path / "tags.yaml").write_text(text)
    return landmark_file.load(tmp_path / "tags.yaml")


def test_a_file_gives_ids_places_views_and_ranges(tmp_path):
    landmarks = load(tmp_path, GOOD)
    assert landmarks.ids == ("A1", "17", "C")
    assert landmarks.positions_m.tolist() == [[3.2, -4.5], [9.0, 4.5], [0.0, 0.0]]
    np.testing.assert_allclose(np.degrees(landmarks.facing_rad), [90.0, np.nan, 180.0])
    np.testing.assert_allclose(np.degrees(landmarks.view_rad), [80.0, 360.0, 120.0])
    assert landmarks.range_m.tolist() == [12.0, 12.0, 5.5]
    assert landmarks.sigma_m == 0.02


def test_what_is_not_said_is_as_in_the_document(tmp_path):
    landmarks = load(tmp_path, "landmarks: [{id: A, position: [1, 2], facing_deg: 0}]")
    assert np.degrees(landmarks.view_rad).tolist() == [90.0]
    assert landmarks.range_m.tolist() == [15.0]


def test_a_file_may_have_no_landmarks_yet(tmp_path):
    assert len(load(tmp_path, "landmarks: []")) == 0


def test_what_is_saved_is_read_again(tmp_path):
    landmarks = LandmarkMap(
        ("A", "007", "17", "it's: {odd}", "true"),
        np.array([[0.1, 1 / 3], [2, 3], [4, 5], [6, 7], [8, 9]]),
        np.array([np.nan, 0.5, -3.0, 1.0, 2.0]),
        np.array([2 * np.pi, 1.0, 1.5, 2.0, 3.0]),
        np.array([np.inf, 15.0, 8.0, 15.0, 15.0]),
        0.003,
    )
    landmark_file.save(landmarks, tmp_path / "a.yaml", "made by a test")
    again = landmark_file.load(tmp_path / "a.yaml")
    assert again.ids == landmarks.ids and again.sigma_m == landmarks.sigma_m
    for name in ("positions_m", "facing_rad", "view_rad", "range_m"):
        np.testing.assert_allclose(getattr(again, name), getattr(landmarks, name), atol=1e-8)
    landmark_file.save(load(tmp_path, "landmarks: []"), tmp_path / "b.yaml")
    assert len(landmark_file.load(tmp_path / "b.yaml")) == 0


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "is no landmark file: expected landmarks, a list of {id: ..., position: [x, y]}"),
        ("[", "is not yaml: "),
        ("image: a.png", "is no landmark file: expected landmarks"),
        ("landmarks: 3", "landmarks must be a list, got 3"),
        ("landmarks: []\nsigmaa: 1", "unknown key 'sigmaa'; did you mean sigma?"),
        ("landmarks: []\nsigma: -1", "sigma must be >= 0 m, got -1"),
        ("landmarks: []\nrange: far", "range must be a finite number, got 'far'"),
        ("landmarks: [A]", "landmark 1 must have keys of id, position, facing_deg, view_deg, range, got 'A'"),
        ("landmarks: [{id: A, positon: [1, 2]}]", "landmark 1 has unknown key 'positon'; did you mean position?"),
        ("landmarks: [{position: [1, 2]}]", "landmark 1 id must be a word or a whole number, got None"),
        ("landmarks: [{id: true, position: [1, 2]}]", "landmark 1 id must be a word or a whole number, got True"),
        ("landmarks: [{id: A, position: [1]}]", "landmark 1 (A) position must be [x, y] in m, got [1]"),
        ("landmarks: [{id: A}]", "landmark 1 (A) position must be [x, y] in m, got None"),
        ("landmarks: [{id: A, position: [1, .nan]}]", "landmark 1 (A) position must be a finite number, got nan"),
        (
            "landmarks: [{id: A, position: [1, 2], view_deg: 9}]",
            "landmark 1 (A) has view_deg and no facing_deg: without a direction it is seen from all sides",
        ),
        (
            "landmarks: [{id: A, position: [1, 2], facing_deg: 0, view_deg: 400}]",
            "landmark 'A': view must be > 0 and <= 360 degrees, got 400",
        ),
        ("landmarks: [{id: A, position: [1, 2], range: 0}]", "landmark 'A': range must be > 0 m, got 0"),
        ("landmarks: [{id: A, position: [1, 2]}, {id: A, position: [3, 4]}]", "landmark id 'A' is given twice"),
        (
            "landmarks: [{id: A, position: [1, 2]}, {id: B, position: [1, 2]}]",
            "landmarks 'A' and 'B' are in the same place, [1.0, 2.0]",
        ),
    ],
)
def test_what_cannot_be_used_is_one_line_that_says_why(tmp_path, text, message):
    with pytest.raises(LandmarkError) as caught:
        load(tmp_path, text)
    assert str(caught.value).startswith(f"{tmp_path / 'tags.yaml'}: {message}")
    assert "\n" not in str(caught.value)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(LandmarkError, match="none.yaml: cannot be read: No such file or directory$"):
        landmark_file.load(tmp_path / "none.yaml")
