"""The landmarks of one floor in the frame map: tags that report their id when a beam hits them.

N landmarks, M points. A tag's detector looks in one direction and sees beams from within an angle and a range (seed
document landmark_bearings.txt, sec. 3: 90 degrees, 15 m); a landmark without a direction is visible from all sides.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from functools import cached_property
from typing import Dict, Sequence, Tuple, Union

import numpy as np

from glass_nav.geometry import angles

VIEW_RAD = np.pi / 2.0  # of a tag whose direction is known
RANGE_M = 15.0


class UnknownLandmark(ValueError):
    """An id that is not on the map; one line."""


@dataclass(frozen=True, eq=False)
class LandmarkMap:
    """Positions of landmarks, and from where they are visible, ignoring walls."""

    ids: Tuple[str, ...]
    positions_m: np.ndarray  # (N, 2) in map
    facing_rad: np.ndarray  # (N,) viewing direction of the detector in map, NaN: all sides
    view_rad: np.ndarray  # (N,) full angle within which it sees beams
    range_m: np.ndarray  # (N,)
    sigma_m: float = 0.01  # standard deviation of each coordinate of the positions

    def __post_init__(self) -> None:
        count = len(self.ids)
        shapes = [np.shape(value) for value in (self.positions_m, self.facing_rad, self.view_rad, self.range_m)]
        if shapes != [(count, 2), (count,), (count,), (count,)]:
            raise ValueError(
                f"expected {count} landmarks with positions (N, 2), facing (N,), view (N,) and range "
                f"(N,), got {', '.join(map(str, shapes))}"
            )
        if len(set(self.ids)) < count:
            twice = next(name for name in self.ids if self.ids.count(name) > 1)
            raise ValueError(f"landmark id {twice!r} is given twice")
        if not np.isfinite(self.positions_m).all():
            number = int(np.argmin(np.isfinite(self.positions_m).all(axis=1)))
            raise ValueError(
                f"landmark {self.ids[number]!r}: position must be finite, got {self.positions_m[number].tolist()}"
            )
        for what, values, good in (
            ("facing", self.facing_rad, ~np.isinf(self.facing_rad)),
            ("view", self.view_rad, (self.view_rad > 0.0) & (self.view_rad <= 2.0 * np.pi)),
            ("range", self.range_m, self.range_m > 0.0),
        ):
            if not good.all():
                number = int(np.argmin(good))
                allowed = {"facing": "finite", "view": "> 0 and <= 360 degrees", "range": "> 0 m"}[what]
                given = values[number] if what == "range" else np.degrees(values[number])
                raise ValueError(f"landmark {self.ids[number]!r}: {what} must be {allowed}, got {given:g}")
        if not 0.0 <= self.sigma_m < np.inf:
            raise ValueError(f"sigma of the landmarks must be >= 0 m, got {self.sigma_m}")

    def __len__(self) -> int:
        return len(self.ids)

    @cached_property
    def _number(self) -> Dict[str, int]:
        return {name: number for number, name in enumerate(self.ids)}

    def __contains__(self, landmark_id: str) -> bool:
        return landmark_id in self._number

    def numbers(self, ids: Sequence[str]) -> np.ndarray:
        """(M,) int: indices of these landmarks.

        Raises:
            UnknownLandmark: one of them is not on the map.
        """
        try:
            return np.array([self._number[name] for name in ids], int)
        except KeyError as err:
            name = err.args[0]
            near = difflib.get_close_matches(name, self.ids, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            shown = ", ".join(self.ids[:20]) + (", ..." if len(self) > 20 else "")
            raise UnknownLandmark(f"landmark {name!r} is not on the map, which has {shown or 'none'}{hint}") from None

    def in_view(self, points_m: np.ndarray, range_share: float = 1.0, slack_rad: float = 0.0) -> np.ndarray:
        """Whether landmarks are visible from points (..., 2) if nothing stands between.

        Args:
            points_m: in map.
            range_share: allowed share of the landmarks' range.
            slack_rad: added to the view on either side.

        Returns:
            (..., N) bool.
        """
        return self.reaches(
            np.asarray(points_m, float)[..., None, :] - self.positions_m, slice(None), range_share, slack_rad
        )

    def reaches(
        self, way_m: np.ndarray, which: "Union[slice, np.ndarray]", range_share: float = 1.0, slack_rad: float = 0.0
    ) -> np.ndarray:
        """(..., M) as in_view(), for vectors (..., M, 2) from M landmarks, chosen by `which`, to a point each."""
        near = np.hypot(way_m[..., 0], way_m[..., 1]) <= self.range_m[which] * range_share
        off = np.abs(angles.wrap(np.arctan2(way_m[..., 1], way_m[..., 0]) - self.facing_rad[which]))
        all_round = np.isnan(off)
        return near & (all_round | (np.where(all_round, 0.0, off) <= 0.5 * self.view_rad[which] + slack_rad))

    def joined(self, other: "LandmarkMap") -> "LandmarkMap":
        """Both maps joined; sigma is that of this one."""
        return LandmarkMap(
            self.ids + other.ids,
            np.concatenate([self.positions_m, other.positions_m]),
            np.concatenate([self.facing_rad, other.facing_rad]),
            np.concatenate([self.view_rad, other.view_rad]),
            np.concatenate([self.range_m, other.range_m]),
            self.sigma_m,
        )


def seen_from_all_sides(
    ids: Sequence[str], positions_m: np.ndarray, range_m: float = np.inf, sigma_m: float = 0.0
) -> LandmarkMap:
    """Landmarks (N, 2) without a direction."""
    count = len(ids)
    return LandmarkMap(
        tuple(ids),
        np.asarray(positions_m, float).reshape(-1, 2),
        np.full(count, np.nan),
        np.full(count, 2.0 * np.pi),
        np.full(count, float(range_m)),
        sigma_m,
    )


NONE = seen_from_all_sides((), np.zeros((0, 2)))
