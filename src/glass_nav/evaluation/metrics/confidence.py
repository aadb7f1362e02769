"""Confidence intervals of means: Student's t over repeated runs, groups combined by Welch and Satterthwaite.

Student, The probable error of a mean, Biometrika 6 (1908); Welch, The generalization of "Student's" problem when
several different population variances are involved, Biometrika 34 (1947).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Optional, Sequence, Tuple

import numpy as np

LEVEL = 0.95


@dataclass(frozen=True)
class Interval:
    """A mean, and how far the true one may be from it at LEVEL."""

    mean: float
    half_width: Optional[float]  # None: not known, some group was run once only

    @property
    def sign(self) -> int:
        """1 or -1 where 0 is outside the interval, else 0: not significant."""
        if self.half_width is None or abs(self.mean) <= self.half_width:
            return 0
        return 1 if self.mean > 0.0 else -1


def of_sum(groups: "Sequence[Tuple[float, np.ndarray]]") -> Interval:
    """The interval of a weighted sum of the means of independent groups.

    The variance is that of the groups' means, with Welch and Satterthwaite's degrees of freedom; groups are fixed
    strata: what differs between their means is no uncertainty.

    Args:
        groups: weight and values (N,) of each, N >= 1, at least one group. An infinite value makes an infinite mean.
    """
    mean = float(sum(weight * np.mean(values) for weight, values in groups))
    if not math.isfinite(mean) or any(len(values) < 2 for _, values in groups):
        return Interval(mean, None)
    parts = [weight**2 * float(np.var(values, ddof=1)) / len(values) for weight, values in groups]
    variance = sum(parts)
    if variance == 0.0:
        return Interval(mean, 0.0)
    freedom = variance**2 / sum(part**2 / (len(values) - 1) for part, (_, values) in zip(parts, groups))
    return Interval(mean, _quantile(freedom) * math.sqrt(variance))


def of_strata(strata: Sequence[np.ndarray]) -> Interval:
    """The interval of the mean over strata with equal weights: a log with many runs counts as much as any other."""
    return of_sum([(1.0 / len(strata), values) for values in strata])


def _quantile(freedom: float) -> float:
    from scipy import stats

    return float(stats.t.ppf(0.5 + LEVEL / 2.0, freedom))
