"""Evidence for poses: what views and paths add up to, to elsewhere and between two poses."""

from __future__ import annotations

import numpy as np
import pytest
from made_scans import MadeScans

from glass_nav.hypotheses import pose_evidence
from glass_nav.hypotheses.pose_evidence import NEW, Evidence, OfView


def test_one_thing_in_the_wrong_place_says_much_where_all_else_was_right_and_little_where_much_was_not() -> None:
    def lead(changed: float) -> float:
        """Between two poses of which the second contradicts four pieces of wall more."""
        first = np.full(2, 100.0 * (1.0 - changed)) - [0.0, 4.0]
        wrong = 100.0 - first
        evidence = Evidence.none(2).with_view(OfView(np.zeros(2), first, np.full(2, 100.0), np.zeros(2), wrong))
        return float(-np.diff(evidence.between_nats)[0])

    assert lead(0.0) > 6.0 > lead(0.1) > lead(0.3) > 0.0
    missed = Evidence.none(2).with_view(OfView(*np.zeros((3, 2)), np.array([0.0, 4.0]), np.zeros(2)))
    assert np.diff(missed.between_nats)[0] == pytest.approx(0.5 * 0.5 * 4.0)  # half of it is given back


def test_views_and_paths_add_up_and_what_is_chosen_stays_together() -> None:
    view = OfView(np.array([3.0, -1.0]), np.array([8.0, 2.0]), np.array([10.0, 10.0]), np.zeros(2), np.zeros(2))
    evidence = Evidence.none(2).with_view(view).with_view(view).with_path(np.array([0.0, 2.0]))
    np.testing.assert_allclose(evidence.nats, [6.0, -4.0])
    np.testing.assert_allclose(evidence.checked_nats, [6.0, -4.0])
    np.testing.assert_allclose(evidence.share, [0.8, 0.2])
    assert np.isnan(Evidence.none(1).share).all()
    both = evidence[np.array([1])].then(Evidence.none(1))
    np.testing.assert_allclose(both.total, [-4.0, 0.0])
    assert both.label.tolist() == [NEW, NEW]


def test_a_robot_can_expect_evidence_where_the_map_would_explain_less() -> None:
    scans = MadeScans(lambda poses: np.where(poses[:, 0] < 50.0, 1.0, 0.9), np.zeros((0, 3)))
    nats = pose_evidence.expected_nats(scans, np.zeros(3), np.array([[10.0, 0.0, 0.0], [60.0, 0.0, 0.0]]))
    assert nats[0] == 0.0 and nats[1] > 0.5 * 8.0  # eight pieces, contradicted by the map
