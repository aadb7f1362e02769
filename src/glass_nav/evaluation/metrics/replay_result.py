"""The result of a replay: a row per scan, the cases of every beam, and the figures of the whole run.

S scans that the filter took, B beams of the widest of them.
"""

from __future__ import annotations

import csv
import json
import math
import zipfile
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Dict, List, Mapping, Optional, Tuple

import numpy as np

from glass_nav.evaluation.metrics import integrity_scores, pose_errors, relative_errors
from glass_nav.evaluation.metrics.case_scores import CaseScores, SurfaceScores
from glass_nav.evaluation.metrics.integrity_scores import IntegrityTrace
from glass_nav.evaluation.metrics.pose_errors import PoseErrors
from glass_nav.geometry.trajectory import Trajectory
from glass_nav.vocabulary import BeamCase

CASES = tuple(case.value for case in BeamCase)
NO_BEAM = 255  # fills the rows of scans with fewer beams than the widest
_ROW, _COLUMN = np.array([0, 0, 1]), np.array([1, 2, 2])  # of the covariances beside its diagonal
_CLAIMS = (  # columns of per_scan.csv
    "cov_x_y_m2",
    "cov_x_yaw_m_rad",
    "cov_y_yaw_m_rad",
    "level_95_along_m",
    "level_95_across_m",
    "level_95_yaw_rad",
    "level_999_along_m",
    "level_999_across_m",
    "level_999_yaw_rad",
)


@dataclass(frozen=True)
class BeamExample:
    """The beams of one scan, for a picture."""

    stamp_ns: int
    laser_m: np.ndarray  # (2,) where the lidar was by the estimate, in the frame map
    points_m: np.ndarray  # (B, 2) end points by the estimate, NaN without an answer
    true_case: np.ndarray  # (B,) uint8
    told_case: np.ndarray  # (B,) uint8


@dataclass(frozen=True)
class KeptScan:
    """A scan that went badly, kept for a picture."""

    row: int  # which of the S scans
    base_from_laser: np.ndarray  # (3,)
    points_m: np.ndarray  # (B, 2) end points in the robot's frame, NaN without an answer


@dataclass(frozen=True)
class ReplayResult:
    """The result of one run of the filter over one log."""

    stamps_ns: np.ndarray  # (S,) int64
    map_from_base: np.ndarray  # (S, 3) estimates
    odom_from_base: np.ndarray  # (S, 3) what the odometry said
    covariance: np.ndarray  # (S, 3, 3) reported by the filter, over x [m], y [m], yaw [rad]
    level_95: np.ndarray  # (S, 3) protection levels along the heading [m], across it [m], of the heading [rad]
    level_999: np.ndarray  # (S, 3)
    states: List[str]  # S of them
    reasons: List[str]  # S of them
    used_share: np.ndarray  # (S,) see LocalizationStatus.msg
    updated: np.ndarray  # (S,) bool: the scan moved the particles
    particles: np.ndarray  # (S,) int: how many there were
    reliability: np.ndarray  # (S,) probability that the pose is right, as the filter reports it
    places: np.ndarray  # (S,) int: how many are possible while the pose is looked for; 1: it is known
    cpu_ms: np.ndarray  # (S,) CPU time of the filter, all its threads
    cases: np.ndarray  # (S, B) uint8: 0..4, NO_BEAM where a scan has no such beam
    refusals: "Counter[str]"  # reason -> scans of the log that could not be used
    reference: Optional[Trajectory]  # map_from_base
    wall_s: float  # time the whole run took, reading included
    seed: int
    true_cases: Optional[np.ndarray] = None  # (S, B) as cases, NO_BEAM also where no truth was recorded
    case_scores: Optional[CaseScores] = None
    surface_scores: Optional[SurfaceScores] = None
    examples: List[BeamExample] = field(default_factory=list)
    worst: List[KeptScan] = field(default_factory=list)  # the worst first

    def __len__(self) -> int:
        return len(self.stamps_ns)

    @property
    def deviation(self) -> np.ndarray:
        """(S, 3) standard deviations reported by the filter: x [m], y [m], yaw [rad]."""
        return np.sqrt(np.maximum(np.diagonal(self.covariance, axis1=1, axis2=2), 0.0))

    @property
    def integrity(self) -> IntegrityTrace:
        """State, covariance and protection level of every scan, against the reference."""
        return integrity_scores.trace(
            self.stamps_ns,
            self.map_from_base,
            self.odom_from_base,
            self.states,
            self.covariance,
            self.level_95,
            self.level_999,
            self.reference,
        )

    @property
    def errors(self) -> PoseErrors:
        """Of every scan against the reference."""
        return pose_errors.of(self.stamps_ns, self.map_from_base, self.reference)

    def metrics(self) -> Dict[str, Any]:
        """The figures of the run: plain numbers and None, ready for JSON."""
        errors = self.errors
        counts = np.bincount(self.cases.ravel(), minlength=NO_BEAM + 1)[list(CASES)]
        beams = int(counts.sum())
        states = Counter(self.states)
        log_s = float(self.stamps_ns[-1] - self.stamps_ns[0]) * 1e-9 if len(self) else 0.0
        return {
            "scans": len(self),
            "scans_refused": sum(self.refusals.values()),
            "refusals": dict(sorted(self.refusals.items())),
            "updates": int(self.updated.sum()),
            "scans_without_ground_truth": None if self.reference is None else int((~errors.matched).sum()),
            **pose_errors.summary(errors),
            **relative_errors.summary(self.stamps_ns, self.map_from_base, self.reference),
            **integrity_scores.summary(self.integrity),
            "case_share": {str(case): (float(count) / beams if beams else 0.0) for case, count in zip(CASES, counts)},
            "scans_with_true_cases": None
            if self.true_cases is None
            else int((self.true_cases != NO_BEAM).any(axis=1).sum()),
            "cases": None if self.case_scores is None else self.case_scores.metrics(),
            "scan_surfaces": None if self.surface_scores is None else self.surface_scores.metrics(),
            "state_share": {state: count / len(self) for state, count in sorted(states.items())},
            "cpu_ms_per_scan": float(self.cpu_ms.mean()) if len(self) else None,
            "cpu_ms_per_update": float(self.cpu_ms[self.updated].mean()) if self.updated.any() else None,
            "log_duration_s": log_s,
            "wall_s": self.wall_s,
            "times_real_time": log_s / self.wall_s if self.wall_s > 0.0 else None,
            "seed": self.seed,
        }


def write(result: ReplayResult, folder: Path, about: Mapping[str, Any]) -> None:
    """metrics.json, trajectory.tum, per_scan.csv, beam_cases.npz and worst_scans.npz; `about` goes into the first."""
    write_json(folder / "metrics.json", {**result.metrics(), **about})
    _write_tum(folder / "trajectory.tum", result)
    _write_per_scan(folder / "per_scan.csv", result)
    true = {} if result.true_cases is None else {"true_cases": result.true_cases}
    np.savez_compressed(
        folder / "beam_cases.npz", stamps_ns=result.stamps_ns.astype(np.int64), cases=result.cases, **true
    )
    _write_worst(folder / "worst_scans.npz", result.worst)


def read(folder: Path) -> "Tuple[ReplayResult, Dict[str, Any]]":
    """What write() wrote, and the contents of metrics.json; the scores are in the second only.

    Raises:
        ValueError, OSError: no results, or not whole; one line.
    """
    if not (folder / "metrics.json").is_file():
        raise ValueError(f"{folder}: holds no results of a replay (there is no metrics.json)")
    try:
        metrics: Dict[str, Any] = json.loads((folder / "metrics.json").read_text())
        with np.load(folder / "beam_cases.npz") as arrays:
            cases, true_cases = arrays["cases"], arrays["true_cases"] if "true_cases" in arrays else None
        with (folder / "per_scan.csv").open(newline="") as file:
            rows = list(csv.DictReader(file))
        worst = _read_worst(folder / "worst_scans.npz")
        return _from_rows(rows, cases, true_cases, worst, metrics), metrics
    except KeyError as err:
        raise ValueError(f"{folder}: its results have no {err}, an older glass_nav wrote them: replay again") from err
    except (ValueError, zipfile.BadZipFile) as err:
        raise ValueError(f"{folder}: its results are damaged: {err}") from err


def write_json(path: Path, values: Mapping[str, Any]) -> None:
    """Strict JSON: a NaN or an infinity is a null."""
    path.write_text(json.dumps(_strict(values), indent=2, allow_nan=False) + "\n")


def _strict(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _strict(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_strict(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _write_tum(path: Path, result: ReplayResult) -> None:
    """TUM rows `stamp x y z qx qy qz qw`, the stamp with its nanoseconds."""
    with path.open("w") as file:
        for stamp_ns, (x, y, yaw) in zip(result.stamps_ns.tolist(), result.map_from_base.tolist()):
            seconds, rest = divmod(stamp_ns, 1_000_000_000)
            file.write(f"{seconds}.{rest:09d} {x:.6f} {y:.6f} 0 0 0 {math.sin(yaw / 2):.9f} {math.cos(yaw / 2):.9f}\n")


def _write_per_scan(path: Path, result: ReplayResult) -> None:
    """One row per scan; unknown values are left empty."""
    errors = result.errors
    nowhere = np.full((len(result), 3), np.nan)
    true = nowhere if result.reference is None or not len(result) else result.reference.at(result.stamps_ns)
    true = np.where(errors.matched[:, None], true, np.nan)
    counts = np.stack([(result.cases == case).sum(axis=1) for case in CASES], axis=1)
    claims = np.concatenate([result.covariance[:, _ROW, _COLUMN], result.level_95, result.level_999], axis=1)
    with path.open("w", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(
            [
                "stamp_ns",
                "x_m",
                "y_m",
                "yaw_rad",
                "odom_x_m",
                "odom_y_m",
                "odom_yaw_rad",
                "true_x_m",
                "true_y_m",
                "true_yaw_rad",
                "position_error_m",
                "yaw_error_deg",
                "std_x_m",
                "std_y_m",
                "std_yaw_rad",
                "state",
                "reason",
                "used_share",
                "updated",
                "particles",
                "cpu_ms",
                "reliability",
                "places",
                *(f"beams_case_{case}" for case in CASES),
                *_CLAIMS,
            ]
        )
        for i in range(len(result)):
            rows.writerow(
                [
                    int(result.stamps_ns[i]),
                    *_texts(result.map_from_base[i]),
                    *_texts(result.odom_from_base[i]),
                    *_texts(true[i]),
                    *_texts([errors.position_m[i], np.degrees(errors.yaw_rad[i])]),
                    *_texts(result.deviation[i]),
                    result.states[i],
                    result.reasons[i],
                    *_texts([result.used_share[i]]),
                    int(result.updated[i]),
                    int(result.particles[i]),
                    f"{result.cpu_ms[i]:.3f}",
                    *_texts([result.reliability[i]]),
                    int(result.places[i]),
                    *counts[i].tolist(),
                    *("" if math.isnan(value) else f"{value:.9g}" for value in claims[i]),
                ]
            )


def _texts(values: Any) -> List[str]:
    return ["" if math.isnan(value) else f"{value:.6f}" for value in values]


def _write_worst(path: Path, worst: List[KeptScan]) -> None:
    """K kept scans: their rows (K,), base_from_laser (K, 3), points_m (K, B, 2) of the widest, NaN beyond a scan's."""
    points = np.full((len(worst), max((len(kept.points_m) for kept in worst), default=0), 2), np.nan, np.float32)
    for index, kept in enumerate(worst):
        points[index, : len(kept.points_m)] = kept.points_m
    np.savez_compressed(
        path,
        rows=np.array([kept.row for kept in worst], np.int64),
        points_m=points,
        base_from_laser=np.array([kept.base_from_laser for kept in worst], float).reshape(-1, 3),
    )


def _read_worst(path: Path) -> List[KeptScan]:
    if not path.is_file():
        raise KeyError(path.name)
    with np.load(path) as arrays:
        return [
            KeptScan(int(row), laser, points)
            for row, laser, points in zip(arrays["rows"], arrays["base_from_laser"], arrays["points_m"].astype(float))
        ]


def _symmetric(deviation: np.ndarray, beside: np.ndarray) -> np.ndarray:
    """Covariances (S, 3, 3) from standard deviations (S, 3) and off-diagonal elements (S, 3)."""
    covariance = np.zeros((len(deviation), 3, 3))
    covariance[:, [0, 1, 2], [0, 1, 2]] = deviation**2
    covariance[:, _ROW, _COLUMN] = covariance[:, _COLUMN, _ROW] = beside
    return covariance


def _from_rows(
    rows: List[Dict[str, str]],
    cases: np.ndarray,
    true_cases: Optional[np.ndarray],
    worst: List[KeptScan],
    metrics: Mapping[str, Any],
) -> ReplayResult:
    """The rows of per_scan.csv as arrays."""

    def column(name: str) -> np.ndarray:
        return np.array([float(row[name] or "nan") for row in rows])

    def columns(*names: str) -> np.ndarray:
        return np.stack([column(name) for name in names], axis=1)

    if len(cases) != len(rows):
        raise ValueError(f"{len(rows)} rows in per_scan.csv, cases of {len(cases)} scans in beam_cases.npz")
    stamps_ns = np.array([int(row["stamp_ns"]) for row in rows], np.int64)
    true = columns("true_x_m", "true_y_m", "true_yaw_rad")
    known = np.isfinite(true).all(axis=1)
    reference = None
    if known.any():
        unique_ns, first = np.unique(stamps_ns[known], return_index=True)
        reference = Trajectory(unique_ns, true[known][first])
    return ReplayResult(
        stamps_ns=stamps_ns,
        map_from_base=columns("x_m", "y_m", "yaw_rad"),
        odom_from_base=columns("odom_x_m", "odom_y_m", "odom_yaw_rad"),
        covariance=_symmetric(columns("std_x_m", "std_y_m", "std_yaw_rad"), columns(*_CLAIMS[:3])),
        level_95=columns(*_CLAIMS[3:6]),
        level_999=columns(*_CLAIMS[6:]),
        states=[row["state"] for row in rows],
        reasons=[row["reason"] for row in rows],
        used_share=column("used_share"),
        updated=column("updated").astype(bool),
        particles=column("particles").astype(int),
        reliability=column("reliability"),
        places=column("places").astype(int),
        cpu_ms=column("cpu_ms"),
        cases=cases,
        refusals=Counter(metrics["refusals"]),
        reference=reference,
        wall_s=float(metrics["wall_s"]),
        seed=int(metrics["seed"]),
        true_cases=true_cases,
        worst=worst,
    )
