"""A scan that is searched in the whole map: one slice for each call, many poses in several slices."""

from __future__ import annotations

import numpy as np
from made_scans import BEAMS, MadeScans, Places, scan

from glass_nav.hypotheses.searched_scan import AT_ONCE, SearchedScan


def test_the_poses_found_are_judged_in_slices_and_returned_together() -> None:
    count = 2 * AT_ONCE + 10
    proposed = np.zeros((count, 3))
    proposed[:, 0] = np.arange(count)
    scans = MadeScans(lambda poses: np.where(poses[:, 0] < 5.0, 1.0, 0.5), proposed)
    searched = SearchedScan(scans, Places(proposed), scan(), np.zeros(3), 0.0, count - 5)
    slices = [searched.advance() for _ in range(4)]  # the search, and three slices of poses
    assert slices[:3] == [None] * 3
    found = slices[3]
    assert found is not None
    np.testing.assert_allclose(found.poses, proposed[: count - 5])
    assert found.explained.sum(axis=1).tolist() == [BEAMS] * 5 + [BEAMS // 2] * (count - 10)
