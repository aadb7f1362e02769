"""What is printed of a replayed log: poses that fit the map while the ground truth stands 0.1 m beside them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import made_results
import numpy as np
import pytest

from glass_nav.demo import replayed_log
from glass_nav.demo.replayed_log import MapAgreement
from glass_nav.evaluation.metrics import replay_result
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.recording import log_file
from glass_nav.recording.recording import Step
from glass_nav.sensing.distance_field import DistanceField
from glass_nav.sensing.scan import Scan
from glass_nav.world.grid_map import GridMap

DATA = Path(__file__).parents[2] / "data" / "mrpt"
RESULT = made_results.a_result()  # along x at y = 0.1 m; the reference at y = 0
WALL = GridMap(
    np.where(np.arange(40)[:, None] == 31, np.full((40, 60), 100, np.int8), np.int8(0)),
    0.1,
    np.array([-1.0, -1.0, 0.0]),
)


def looking_left(stamp_ns: int) -> Scan:
    """Two beams of 2.05 m to the left, where the wall's middle is 2.15 m from y = 0, and one that met nothing."""
    return Scan(int(stamp_ns), np.array([2.05, 2.05, np.inf]), np.full(3, np.pi / 2), 0.1, 10.0, np.zeros(3))


def test_the_pose_that_fits_the_map_ends_its_scans_on_the_walls() -> None:
    scans = [looking_left(stamp_ns) for stamp_ns in (*RESULT.stamps_ns, 5)]  # the last two have no reference, no pose
    agreement = replayed_log.map_agreement(scans, RESULT, DistanceField(WALL))
    np.testing.assert_allclose(agreement.ours_m, np.zeros(3), atol=0.01)
    np.testing.assert_allclose(agreement.reference_m, np.full(3, 0.1), atol=0.01)


@pytest.mark.parametrize("reference_m, blamed", [(0.05, True), (0.011, False)])
def test_the_ground_truth_is_blamed_only_if_it_is_far_from_the_walls(reference_m: float, blamed: bool) -> None:
    said = "\n".join(MapAgreement(np.full(4, 0.01), np.full(4, reference_m)).lines)
    assert "0.010 m" in said and f"{reference_m:.3f} m" in said and "100% of 4 scans" in said
    assert ("causes most of the error" in said) == blamed


def test_a_row_for_each_seed_and_the_worst_of_each_column() -> None:
    first, second = RESULT.metrics(), {**RESULT.metrics(), "position_max_m": 0.5, "position_rmse_m": 0.05}
    header, *rows = replayed_log.error_table([first, second])
    assert header.split()[:2] == ["seed", "median"]
    assert [row.split()[0] for row in rows] == ["1", "2", "worst"]
    assert rows[2].split()[1:] == ["0.100", "0.100", "0.100", "0.500", "0.000"]


def test_log_map_and_results_are_read_from_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    steps = [entry for entry in log_file.open_log(DATA / "paired.rawlog") if isinstance(entry, Step)]
    stamps_ns = np.unique([step.scan.stamp_ns for step in steps])[:4]
    count = len(stamps_ns)
    whole = made_results.a_result()
    cut = {name: value[:count] for name, value in vars(whole).items() if np.shape(value)[:1] == (4,)}
    reference = Trajectory(stamps_ns, np.zeros((count, 3)))
    replay_result.write(replace(whole, **{**cut, "stamps_ns": stamps_ns, "reference": reference}), tmp_path, {})
    replayed_log.main([str(DATA / "paired.rawlog"), str(DATA / "small.gridmap.gz"), str(tmp_path)])
    said = capsys.readouterr().out
    assert "     1" in said and "worst" in said and f"of {count} scans" in said


def test_without_a_ground_truth_nothing_is_compared() -> None:
    agreement = replayed_log.map_agreement(
        [looking_left(RESULT.stamps_ns[0])], replace(RESULT, reference=None), DistanceField(WALL)
    )
    assert not len(agreement.ours_m) and not len(agreement.reference_m)
