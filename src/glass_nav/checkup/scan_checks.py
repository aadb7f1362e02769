"""Checks what the driver of a lidar sends: angles, limits, ranges, and how no return is encoded. B beams, S scans."""

from __future__ import annotations

from collections import Counter
from typing import Iterator, List, Optional, Sequence

import numpy as np

from glass_nav.checkup.finding import Finding
from glass_nav.recording.observed import HeardScan
from glass_nav.sensing import deskew, range_limits

MAX_SCANS = 400  # whose ranges are looked at, spread over the log
_MIN_SCANS = 20
_FEW = 0.05  # share of beams or scans that may be odd
_OTHER_UNIT_M = 1e6  # a larger range_max is no limit in any unit
_PILED = 30.0  # a range this many times as frequent as its neighbours is a code
_NARROW = 0.03  # share of the beams: some at the edge of the view do no harm
_ROBOT_M, _STILL_M, _ALIVE_M = 0.6, 0.03, 0.2  # beams that end on the robot: how near, how still, while others change


def check(topic: str, scans: Sequence[HeardScan]) -> Iterator[Finding]:
    """Findings on the scans of one topic, in the order in which they were heard."""
    if not scans:
        yield Finding(
            "no-scans",
            f"{topic} has no scan",
            "start the lidar's driver before recording, and check its cable, power and port",
        )
        return
    yield from _angles(topic, scans)
    limits = [*_limits(topic, scans)]
    yield from limits
    yield from _repeats(topic, scans)
    usable = [scan for scan in scans if len(scan.ranges_m)]
    some = usable[:: max(1, -(-len(usable) // MAX_SCANS))]
    if not some:
        yield Finding("scan-empty", f"{topic}: not one scan has a range", "the driver sends empty scans: restart it")
        return
    if not any(finding.name == "scan-limits" for finding in limits):
        yield from _ranges(topic, some)
    yield from _robot_in_view(topic, some)
    fault = next(
        (
            fault
            for fault in (deskew.fault(len(scan.ranges_m), scan.time_increment_s, scan.scan_time_s) for scan in some)
            if fault
        ),
        None,
    )
    if fault is not None:
        yield Finding(
            "scan-time-increment",
            f"{topic}: {fault}",
            "set time_increment to the seconds between two beams (scan_time / beams), or to 0 if unknown: "
            "scans are not deskewed as it is",
        )


def describe(topic: str, scans: Sequence[HeardScan]) -> str:
    """One line on a topic: rate, number of beams, and how no return is encoded."""
    if not scans:
        return f"{topic}: no scans"
    stamps_s = np.array([scan.stamp_ns for scan in scans]) * 1e-9
    rate = (len(scans) - 1) / (stamps_s.max() - stamps_s.min()) if np.ptp(stamps_s) > 0.0 else 0.0
    beams = Counter(len(scan.ranges_m) for scan in scans).most_common(1)[0][0]
    last = scans[-1]
    return (
        f"{topic}: {len(scans)} scans, {rate:.3g} Hz, {beams} beams over "
        f"{np.degrees(abs(last.angle_max_rad - last.angle_min_rad)):.0f} deg, {last.range_min_m:g} to "
        f"{last.range_max_m:g} m, frame {last.frame!r}; nothing met is written as {_codes(scans)}"
    )


def _codes(scans: Sequence[HeardScan]) -> str:
    """Share of beams without a return, by the value that the driver writes for them."""
    some = [scan for scan in scans[:: max(1, -(-len(scans) // MAX_SCANS))] if len(scan.ranges_m)]
    if not some:
        return "nothing"
    ranges = np.concatenate([scan.ranges_m for scan in some]).astype(float)
    low = np.concatenate([np.full(len(scan.ranges_m), scan.range_min_m) for scan in some])
    high = np.concatenate([np.full(len(scan.ranges_m), scan.range_max_m) for scan in some])
    with np.errstate(invalid="ignore"):
        kinds = {
            "inf": np.isposinf(ranges),
            "NaN": np.isnan(ranges),
            "0": ranges == 0.0,
            "a range below range_min": (ranges < low) & (ranges != 0.0),
            "range_max or more": np.isfinite(ranges) & (ranges >= high),
        }
    shares = [f"{name} ({100 * kind.mean():.1f} %)" for name, kind in kinds.items() if kind.mean() > 0.0005]
    code = _piled(some)
    if code is not None:
        shares.append(f"{code:g} m")
    return ", ".join(shares) or "nothing: all beams answer"


def _angles(topic: str, scans: Sequence[HeardScan]) -> Iterator[Finding]:
    odd: List[HeardScan] = []
    for scan in scans:
        step, beams = scan.angle_increment_rad, len(scan.ranges_m)
        fits = (
            np.isfinite([step, scan.angle_min_rad, scan.angle_max_rad]).all()
            and step != 0.0
            and abs((scan.angle_max_rad - scan.angle_min_rad) / step + 1 - beams) <= 1.5
        )
        if beams > 1 and not fits:
            odd.append(scan)
    widest = max(abs(scan.angle_max_rad - scan.angle_min_rad) for scan in scans)
    if widest > 2.0 * np.pi + 0.2 or any(abs(scan.angle_increment_rad) > 0.5 for scan in scans):
        yield Finding(
            "scan-angles-no-radians",
            f"{topic}: angles from {scans[-1].angle_min_rad:g} to {scans[-1].angle_max_rad:g}, "
            f"{scans[-1].angle_increment_rad:g} apart: more than a circle",
            "write angle_min, angle_max and angle_increment in radians; these look like degrees",
        )
    elif odd:
        scan = odd[0]
        yield Finding(
            "scan-angles",
            f"{topic}: {len(odd)} of {len(scans)} scans with angles that do not fit their number of beams: "
            f"{scan.angle_min_rad:.4f} to {scan.angle_max_rad:.4f} rad in steps of "
            f"{scan.angle_increment_rad:.5f}, {len(scan.ranges_m)} ranges",
            "angle_max must be angle_min + (ranges - 1) * angle_increment: correct the driver; beams are "
            "taken to lie angle_increment apart from angle_min on",
        )
    counts = Counter(len(scan.ranges_m) for scan in scans)
    rare = len(scans) - counts.most_common(1)[0][1]
    if rare > _FEW * len(scans) and len(counts) > 1:
        yield Finding(
            "scan-beams-change",
            f"{topic}: scans have {min(counts)} to {max(counts)} beams",
            "if two lidars share the topic, give each its own frame_id; else set the driver to a fixed number of beams",
        )


def _limits(topic: str, scans: Sequence[HeardScan]) -> Iterator[Finding]:
    bad = [scan for scan in scans if not (np.isfinite(scan.range_min_m) and 0.0 <= scan.range_min_m < scan.range_max_m)]
    highest_m = max(scan.range_max_m for scan in scans)
    if bad:
        yield Finding(
            "scan-limits",
            f"{topic}: {len(bad)} of {len(scans)} scans have range_min {bad[0].range_min_m:g} and range_max "
            f"{bad[0].range_max_m:g} m",
            "set both from the lidar's data sheet, 0 <= range_min < range_max; such scans are rejected",
        )
    elif highest_m > _OTHER_UNIT_M:
        yield Finding(
            "scan-range-max",
            f"{topic}: range_max is {highest_m:g} m, which is no limit",
            "set range_max in the driver (a parameter of pointcloud_to_laserscan), or laser_max_range of the "
            "localization, to how far the lidar sees; until then the longest range seen is used",
        )
    elif range_limits.is_open(highest_m):
        yield Finding(
            "scan-units",
            f"{topic}: range_max is {scans[-1].range_max_m:g} m",
            "ranges and limits must be in metres; these look like millimetres or centimetres",
        )


def _repeats(topic: str, scans: Sequence[HeardScan]) -> Iterator[Finding]:
    """Report ranges that repeat exactly: noise never does that."""
    same = [
        bool(np.isfinite(now.ranges_m).any()) and before.ranges_m.tobytes() == now.ranges_m.tobytes()
        for before, now in zip(scans[:-1], scans[1:])
    ]
    if sum(same) >= 5 and sum(same) > _FEW * len(same):
        yield Finding(
            "scan-repeats",
            f"{topic}: {sum(same)} of {len(same)} scans repeat the ranges of the one before",
            "the driver sends old data again, or two nodes publish the topic: see rostopic info",
        )


def _ranges(topic: str, scans: Sequence[HeardScan]) -> Iterator[Finding]:
    beyond = np.concatenate(
        [scan.ranges_m[np.isfinite(scan.ranges_m) & (scan.ranges_m > 1.05 * scan.range_max_m)] for scan in scans]
    )
    beams = sum(len(scan.ranges_m) for scan in scans)
    if len(np.unique(beyond)) >= 20 and len(beyond) > _FEW * beams:
        median_m = float(np.median(beyond))
        unit = "; millimetres?" if median_m > 100.0 else ""
        yield Finding(
            "scan-units",
            f"{topic}: {100 * len(beyond) / beams:.0f} % of the ranges lie beyond range_max "
            f"{scans[-1].range_max_m:g} m, by their median at {median_m:.4g} m{unit}",
            "write ranges in metres, and range_max from the data sheet: what lies beyond counts as nothing met",
        )
    answered = [
        np.mean(np.isfinite(scan.ranges_m) & (scan.ranges_m > scan.range_min_m) & (scan.ranges_m < scan.range_max_m))
        for scan in scans
    ]
    if np.median(answered) < _FEW:
        yield Finding(
            "scan-blind",
            f"{topic}: only {100 * np.median(answered):.1f} % of the beams of a scan answer with a range "
            "between its limits",
            "look at range_min, range_max and the unit of the ranges, and for a cover on the lidar",
        )
    code = _piled(scans)
    if code is not None:
        yield Finding(
            "no-return-as-range",
            f"{topic}: many beams end at exactly {code:g} m, below range_max {scans[-1].range_max_m:g} m: "
            "this is how the driver writes that nothing was met",
            f"set range_max to {code:g} m in the driver, or laser_max_range: {0.999 * code:.4g} in the "
            "parameters of the localization; else it sees walls where there are none",
        )


def _piled(scans: Sequence[HeardScan]) -> Optional[float]:
    """The finite range that stands for "no return", although it is within the limits; None if there is none."""
    inside = np.concatenate(
        [
            scan.ranges_m[
                np.isfinite(scan.ranges_m) & (scan.ranges_m > scan.range_min_m) & (scan.ranges_m < scan.range_max_m)
            ]
            for scan in scans
        ]
    )
    beams = sum(len(scan.ranges_m) for scan in scans)
    if len(inside) < 100:
        return None
    values, counts = np.unique(inside, return_counts=True)
    code, count = float(values[-1]), int(counts[-1])
    near = values[:-1] > 0.8 * code
    usual = counts[:-1][near].mean() if near.any() else 1.0
    return code if count > 0.01 * beams and count > _PILED * usual else None


def _robot_in_view(topic: str, scans: Sequence[HeardScan]) -> Iterator[Finding]:
    """Report beams that end on the robot itself: they stay constant while all others change."""
    width = Counter(len(scan.ranges_m) for scan in scans).most_common(1)[0][0]
    rows = np.array([scan.ranges_m for scan in scans if len(scan.ranges_m) == width], float)
    if len(rows) < _MIN_SCANS:
        return
    inside = np.isfinite(rows) & (rows > scans[-1].range_min_m) & (rows < scans[-1].range_max_m)
    low, middle, high = _quantiles(np.where(inside, rows, np.nan), inside)
    still = (inside.mean(axis=0) > 0.9) & (middle < _ROBOT_M) & (high - low < _STILL_M)
    alive = inside.mean(axis=0) > 0.5
    if still.sum() < max(3, _NARROW * width) or not np.median((high - low)[alive & ~still]) > _ALIVE_M:
        return
    angles = np.degrees(scans[-1].angle_min_rad + scans[-1].angle_increment_rad * np.nonzero(still)[0])
    yield Finding(
        "scan-sees-robot",
        f"{topic}: {still.sum()} beams between {angles.min():.0f} and {angles.max():.0f} deg always end "
        f"{np.nanmedian(middle[still]):.2f} m away: the lidar sees a part of the robot",
        f"set laser_min_range to {np.nanmax(high[still]) + 0.05:.2f} in the parameters, or cut these angles "
        "with laser_filters",
    )


def _quantiles(rows: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """(3, B) 10 %, 50 % and 90 % of each beam's ranges; NaN for a beam that never answered."""
    found = np.full((3, rows.shape[1]), np.nan)
    some = inside.any(axis=0)
    found[:, some] = np.nanpercentile(rows[:, some], [10, 50, 90], axis=0)
    return found
