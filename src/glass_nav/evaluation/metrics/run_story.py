"""One run summarized for people: a verdict, the figures that matter, and what happened when.

S scans. A pose is right within RIGHT_M and RIGHT_RAD of the reference: the right room and the right direction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import List, Optional, Tuple

import numpy as np

from glass_nav.evaluation.metrics import relative_errors
from glass_nav.evaluation.metrics.pose_errors import LOST_M, RIGHT_M, RIGHT_RAD, PoseErrors
from glass_nav.evaluation.metrics.replay_result import NO_BEAM, ReplayResult
from glass_nav.geometry import angles, polyline
from glass_nav.vocabulary import BeamCase, LocalizationState

SEARCHING = (LocalizationState.GLOBAL_SEARCH, LocalizationState.UNKNOWN)  # states without a pose to rely on
GOOD, FAIR, BAD = "good", "fair", "bad"
SPIKE, SPIKE_RAD = 4.0, np.radians(1.0)  # see yaw_spikes()
_AROUND = 5  # scans to each side of a spike
_FAST_DEG_S = 20.0
_FEW_EXPLAINED = 0.5
_MANY, _FEW = 0.95, 0.01  # shares of the scans


@dataclass(frozen=True)
class Episode:
    """Scans in a row with one state."""

    state: str
    reason: str  # of the first of them
    start_s: float  # since the first scan
    end_s: float  # when the next state came, or the log ended
    first: int  # scans [first, last]
    last: int

    @property
    def duration_s(self) -> float:
        return self.end_s - self.start_s


@dataclass(frozen=True)
class Figure:
    """A number with its name."""

    name: str
    value: str
    note: str = ""


@dataclass(frozen=True)
class Story:
    """The first screen of a report."""

    grade: str  # GOOD, FAIR or BAD
    headline: str
    sentences: List[str]
    figures: List[Figure]
    episodes: List[Episode]


def of(result: ReplayResult) -> Story:
    """The story of a run of at least one scan."""
    errors = result.errors
    found = first_localized(result)
    grade, headline = _verdict(result, errors, found)
    sentences = [
        _drive(result),
        *_beginning(result, errors, found),
        *_accuracy(result, errors, found),
        *_doubts(result, errors, found),
    ]
    return Story(grade, headline, sentences, _figures(result, errors, found), episodes(result))


def episodes(result: ReplayResult) -> List[Episode]:
    """The run as a list of states; each scan's state holds until the next scan."""
    seconds = seconds_of(result)
    states = np.array(result.states)
    starts = np.concatenate([[0], np.nonzero(states[1:] != states[:-1])[0] + 1])
    ends = np.append(starts[1:], len(states))
    return [
        Episode(
            result.states[start],
            result.reasons[start],
            float(seconds[start]),
            float(seconds[min(end, len(states) - 1)]),
            int(start),
            int(end) - 1,
        )
        for start, end in zip(starts, ends)
    ]


def seconds_of(result: ReplayResult) -> np.ndarray:
    """(S,) since the first scan."""
    return (result.stamps_ns - result.stamps_ns[0]) / 1e9


def first_localized(result: ReplayResult) -> Optional[int]:
    """The first scan whose pose is said to be known; None: there is none."""
    return result.states.index(LocalizationState.LOCALIZED) if LocalizationState.LOCALIZED in result.states else None


def driven_m(result: ReplayResult) -> np.ndarray:
    """(S,) distance since the first scan by odometry."""
    return polyline.distances_along(result.odom_from_base[:, :2])


def right(errors: PoseErrors) -> np.ndarray:
    """(S,) bool: the pose is the right place. False without a reference."""
    with np.errstate(invalid="ignore"):
        return (errors.position_m <= RIGHT_M) & (errors.yaw_rad <= RIGHT_RAD)


@dataclass(frozen=True)
class YawSpike:
    """One or two scans whose heading error is much larger than that of their neighbours."""

    row: int
    yaw_rad: float
    why: str


def yaw_spikes(result: ReplayResult, most: int = 3) -> List[YawSpike]:
    """The largest lone spikes of the heading error, the largest first, each with its likely cause.

    A spike is SPIKE times the median of the errors around it, and at least SPIKE_RAD.
    """
    yaw_rad = np.where(result.errors.matched, result.errors.yaw_rad, 0.0)
    if len(yaw_rad) < 2 * _AROUND + 1:
        return []
    around = np.lib.stride_tricks.as_strided(
        np.pad(yaw_rad, _AROUND, mode="edge"), (len(yaw_rad), 2 * _AROUND + 1), yaw_rad.strides * 2
    )
    usual = np.median(around, axis=1)
    lone = (yaw_rad >= np.maximum(SPIKE * usual, SPIKE_RAD)) & (yaw_rad >= around.max(axis=1))
    rows = np.nonzero(lone)[0]
    rows = rows[np.argsort(-yaw_rad[rows], kind="stable")][:most]
    return [YawSpike(int(row), float(yaw_rad[row]), _why_off(result, int(row))) for row in rows]


def _why_off(result: ReplayResult, row: int) -> str:
    """In a few words: what may explain the error at a scan."""
    rate_deg_s = _turning_rate_deg_s(result)[row]
    if rate_deg_s > _FAST_DEG_S:
        return f"turning {rate_deg_s:.0f}°/s: a stamp 10 ms off is {rate_deg_s / 100.0:.1f}°"
    if result.states[row] != LocalizationState.LOCALIZED:
        return f"{result.states[row]}: {result.reasons[row]}"
    if np.isfinite(result.used_share[row]) and result.used_share[row] < _FEW_EXPLAINED:
        return f"the map explains {percent(float(result.used_share[row]))} of the beams"
    if not result.updated[row]:
        return "between two updates, by odometry"
    return "one scan alone"


def _turning_rate_deg_s(result: ReplayResult) -> np.ndarray:
    """(S,) by odometry, the faster of the step before and the one after."""
    steps_rad = np.abs(angles.wrap(np.diff(result.odom_from_base[:, 2])))
    rates = np.degrees(steps_rad) / np.maximum(np.diff(result.stamps_ns) * 1e-9, 1e-3)
    return np.maximum(np.append(rates, 0.0), np.insert(rates, 0, 0.0))


def scan_period_s(result: ReplayResult) -> Optional[float]:
    """The median time from scan to scan; None for a single one."""
    steps = np.diff(result.stamps_ns)
    steps = steps[steps > 0]
    return float(np.median(steps)) * 1e-9 if len(steps) else None


def explained_share(result: ReplayResult) -> Optional[float]:
    """Share of the returned beams that the map explains, mean over scans. None: no beam returned."""
    known = result.used_share[np.isfinite(result.used_share)]
    return float(known.mean()) if len(known) else None


def metres(value: float) -> str:
    """0.0123 -> 1.2 cm; 1.234 -> 1.23 m."""
    if not np.isfinite(value):
        return "infinite"
    return f"{100 * value:.1f} cm" if value < 0.995 else f"{value:.2f} m"


def duration(seconds: float) -> str:
    """4.24 -> 4.2 s; 75 -> 1 min 15 s; 3700 -> 1 h 2 min."""
    if seconds < 59.95:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(int(round(seconds)), 60)
    if minutes < 60:
        return f"{minutes} min {rest} s"
    return f"{minutes // 60} h {minutes % 60} min"


def percent(share: float) -> str:
    """0.9994 -> 99.9 %, never 100 % or 0 % of what is not all or nothing."""
    if share in (0.0, 1.0):
        return f"{100 * share:.0f} %"
    return f"{min(max(100 * share, 0.1), 99.9):.1f} %"


def _scope(result: ReplayResult, errors: PoseErrors, found: Optional[int]) -> np.ndarray:
    """(S,) bool: scans that are evaluated; those during a global search are not."""
    since = np.zeros(len(result), bool) if found is None else np.arange(len(result)) >= found
    since &= errors.matched
    return since if since.any() else errors.matched


def _wrong_share(result: ReplayResult, errors: PoseErrors) -> float:
    """Share of the LOCALIZED scans with a wrong pose."""
    said = (np.array(result.states) == LocalizationState.LOCALIZED) & errors.matched
    return float(np.mean(~right(errors)[said])) if said.any() else 0.0


def _verdict(result: ReplayResult, errors: PoseErrors, found: Optional[int]) -> Tuple[str, str]:
    if found is None:
        return BAD, "The robot never reported LOCALIZED"
    states = np.array(result.states[found:])
    said = float(np.mean(states == LocalizationState.LOCALIZED))
    if not errors.matched.any():
        if states[-1] == LocalizationState.LOCALIZED and said >= _MANY:
            return GOOD, "The robot reported LOCALIZED throughout, and its scans did not contradict it"
        grade = BAD if states[-1] == LocalizationState.LOST or said < 0.5 else FAIR
        return grade, f"The robot reported LOCALIZED for {percent(said)} of the run"
    wrong = _wrong_share(result, errors)
    if wrong > _FEW:
        return BAD, f"The pose was wrong in {percent(wrong)} of the scans reported as LOCALIZED"
    if said < 0.5 or states[-1] == LocalizationState.LOST:
        return BAD, "The robot did not know where it was for most of the run"
    off = float(np.mean(errors.position_m[_scope(result, errors, found)] > LOST_M))
    if said >= _MANY and off == 0.0 and wrong == 0.0:
        return GOOD, "The robot knew where it was, and it was right"
    return FAIR, "The robot knew where it was most of the time"


def _drive(result: ReplayResult) -> str:
    return (
        f"It drove {driven_m(result)[-1]:.0f} m in {duration(float(seconds_of(result)[-1]))} and used "
        f"{len(result)} scans" + (f" ({sum(result.refusals.values())} more were rejected)." if result.refusals else ".")
    )


def _beginning(result: ReplayResult, errors: PoseErrors, found: Optional[int]) -> List[str]:
    if LocalizationState.GLOBAL_SEARCH not in result.states[:1]:
        return []
    most = int(result.places.max())
    if found is None:
        return [
            f"It started without an initial pose; up to {most} places were possible, and {result.places[-1]} at the end."
        ]
    text = (
        f"It started without an initial pose: up to {most} places were possible, one was left after "
        f"{duration(float(seconds_of(result)[found]))} and {driven_m(result)[found]:.1f} m"
    )
    if errors.matched[found]:
        which = "the right one" if right(errors)[found] else "a WRONG one"
        text += f", {which}, {metres(errors.position_m[found])} off"
    return [text + "."]


def _accuracy(result: ReplayResult, errors: PoseErrors, found: Optional[int]) -> List[str]:
    if not errors.matched.any():
        return [
            "There is no ground truth, so the errors are unknown. Shown are the uncertainties that the filter reports."
        ]
    off = errors.position_m[_scope(result, errors, found)]
    yaw_deg = np.degrees(errors.yaw_rad[_scope(result, errors, found)])
    lost = np.mean(off > LOST_M)
    return [
        f"Half of its poses were within {metres(np.median(off))} and {np.median(yaw_deg):.1f}° of the ground "
        f"truth, 95 % within {metres(_percentile(off, 95))}; "
        + (
            f"the error never exceeded {metres(off.max())}."
            if lost == 0.0
            else f"for {percent(float(lost))} of the scans it was more than {LOST_M} m off, at most "
            f"{metres(off.max())}."
        )
    ]


def _doubts(result: ReplayResult, errors: PoseErrors, found: Optional[int]) -> List[str]:
    if found is None:
        return []
    doubted = [each for each in episodes(result) if each.first > found and each.state != LocalizationState.LOCALIZED]
    if not doubted:
        return ["It never doubted its pose."] if LocalizationState.LOCALIZED in result.states[-1:] else []
    total = sum(each.duration_s for each in doubted)
    text = f"It doubted its pose {len(doubted)} time{'s' if len(doubted) > 1 else ''}, {duration(total)} in all"
    if errors.matched.any():
        rows = np.concatenate([np.arange(each.first, each.last + 1) for each in doubted])
        rows = rows[errors.matched[rows]]
        if len(rows):
            text += f"; {percent(float(np.mean(~right(errors)[rows])))} of these scans were at a wrong place"
    return [text + "."]


def _figures(result: ReplayResult, errors: PoseErrors, found: Optional[int]) -> List[Figure]:
    figures = []
    scope = _scope(result, errors, found)
    if errors.matched.any():
        off, yaw_deg = errors.position_m[scope], np.degrees(errors.yaw_rad[scope])
        since = "since it was first LOCALIZED; " if found else ""
        figures += [
            Figure(
                "Position error", metres(np.median(off)), f"median; {since}95 % below {metres(_percentile(off, 95))}"
            ),
            Figure(
                "Heading error", f"{np.median(yaw_deg):.2f}°", f"median; 95 % below {_percentile(yaw_deg, 95):.2f}°"
            ),
        ]
        relative = relative_errors.summary(result.stamps_ns, result.map_from_base, result.reference)
        over_m, over_s = relative["relative_1m_rmse_m"], relative["relative_1s_rmse_m"]
        if over_s is not None:
            shown = metres(over_s) if over_m is None else metres(over_m)
            note = f"rms over 1 {'s' if over_m is None else 'm'} of driving, as evo's RPE"
            figures.append(
                Figure("Relative error", shown, note + ("" if over_m is None else f"; over 1 s {metres(over_s)}"))
            )
    else:
        claimed = np.hypot(result.deviation[:, 0], result.deviation[:, 1])
        figures += [
            Figure(
                "Position error",
                "unknown",
                f"no ground truth; the filter reports {metres(float(np.median(claimed)))}, median",
            )
        ]
    share = float(np.mean(np.array(result.states) == LocalizationState.LOCALIZED))
    figures.append(
        Figure(
            "Reported LOCALIZED",
            percent(share),
            "of all scans"
            + (f"; at a wrong place: {percent(_wrong_share(result, errors))} of them" if errors.matched.any() else ""),
        )
    )
    explained = explained_share(result)
    if explained is not None:
        counted = result.cases[result.cases != NO_BEAM]
        glass = float(np.mean(counted >= BeamCase.SPECULAR)) if len(counted) else 0.0
        figures.append(
            Figure(
                "Beams explained",
                percent(explained),
                f"of those that came back; {percent(glass)} of all were mirrored or went through glass",
            )
        )
    figures.append(_time(result))
    return figures


def _time(result: ReplayResult) -> Figure:
    updates = result.cpu_ms[result.updated] if result.updated.any() else result.cpu_ms
    period = scan_period_s(result)
    note = "CPU, median"
    if period is not None:
        note += f"; a scan came every {1e3 * period:.0f} ms"
    return Figure("Update", f"{np.median(updates):.0f} ms", note)


def _percentile(values: np.ndarray, percents: float) -> float:
    """Percentiles like numpy's, but between two infinite values the result is infinite, not NaN."""
    with np.errstate(invalid="ignore"):
        value = float(np.percentile(values, percents))
    return float("inf") if np.isnan(value) else value
