"""Segments of scans of known rooms, and their covariances against the spread of many draws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from glass_nav.geometry import angles, se2
from glass_nav.sensing import scan_segments
from glass_nav.sensing.scan import Scan
from glass_nav.sensing.scan_segments import ScanSegmentParams

ROOM_M = np.array([4.0, 3.0])  # walls along x and y from (0, 0)


def ranges_in_room(origin, bearing):
    """To the walls of the room from inside."""
    ray = np.column_stack([np.cos(bearing), np.sin(bearing)])
    with np.errstate(divide="ignore", invalid="ignore"):
        there = np.where(ray > 0.0, (ROOM_M - origin) / ray, -origin / ray)
    return np.where(np.abs(ray) > 1e-12, there, np.inf).min(axis=1)


def room_scan(
    base=(1.3, 1.1, 0.4), beams=360, rng=None, sigma_m=0.0, base_from_laser=(0.1, 0.05, 0.2), field_deg=360.0
):
    angles_rad = np.radians(np.linspace(-field_deg / 2, field_deg / 2, beams, endpoint=field_deg < 360.0))
    laser = se2.compose(np.array(base), np.array(base_from_laser))
    ranges_m = ranges_in_room(laser[:2], angles_rad + laser[2])
    if rng is not None:
        ranges_m = ranges_m + rng.normal(0.0, sigma_m, beams)
    return Scan(0, ranges_m, angles_rad, 0.05, 20.0, np.array(base_from_laser))


def in_room(found, base=(1.3, 1.1, 0.4)):
    return se2.transform_points(np.array(base), found.segments_m.reshape(-1, 2)).reshape(-1, 4)


WALLS = np.array([[0, 0, 4, 0], [4, 0, 4, 3], [4, 3, 0, 3], [0, 3, 0, 0]], float)  # the room to their left


@pytest.mark.parametrize("base", [(1.3, 1.1, 0.4), (2.9, 2.0, -2.8), (1.0, 2.2, 1.7)])
def test_a_room_is_four_segments_with_the_robot_to_their_left(base):
    found = scan_segments.extract(room_scan(base))
    assert len(found) == 4 and (found.beam_segment >= 0).mean() > 0.98
    rows = in_room(found, base)
    order = [int(np.argmin(np.abs(rows - wall).sum(axis=1))) for wall in WALLS]
    assert sorted(order) == [0, 1, 2, 3]  # also the wall that the scan begins and ends at is one
    np.testing.assert_allclose(rows[order], WALLS, atol=0.16)  # the last beam before a corner


def test_a_lidar_that_turns_the_other_way_sees_the_same():
    scan = room_scan()
    turned = replace(scan, ranges_m=scan.ranges_m[::-1], angles_rad=scan.angles_rad[::-1])
    there, back = scan_segments.extract(scan), scan_segments.extract(turned)
    np.testing.assert_allclose(np.sort(there.segments_m, axis=0), np.sort(back.segments_m, axis=0), atol=1e-9)
    np.testing.assert_array_equal(there.beam_segment >= 0, back.beam_segment[::-1] >= 0)


def test_a_scan_that_is_not_all_round_is_no_ring():
    """The wall behind, seen at both ends of the scan, is not one segment."""
    found = scan_segments.extract(room_scan((1.3, 1.1, -0.2), field_deg=340.0), ScanSegmentParams(gap_m=5.0))
    assert len(found) == 5


@pytest.mark.long_run
@pytest.mark.parametrize("seed", range(3))
def test_lines_are_as_far_off_as_their_covariance_says(seed):
    """Over 300 draws of the noise: variances and correlation of heading and offset, for each wall."""
    base, params = (1.3, 1.1, 0.4), ScanSegmentParams(range_sigma_m=0.02, bearing_sigma_rad=0.0, tolerance_m=0.15)
    exact = in_room(scan_segments.extract(room_scan(base), params), base)
    wall = exact[seed]
    off, said = [], []
    for draw in range(300):
        rng = np.random.default_rng([seed, draw])
        found = scan_segments.extract(room_scan(base, rng=rng, sigma_m=0.02), params)
        rows = in_room(found, base)
        nearest = int(np.argmin(np.abs(rows - wall).sum(axis=1)))
        heading, offset = line_of(found.segments_m[nearest])
        off.append((heading, offset))
        said.append(found.covariance[nearest])
    off = np.array(off)
    off[:, 0] = angles.wrap(off[:, 0] - off[0, 0])
    spread, expected = np.cov(off.T), np.mean(said, axis=0)
    np.testing.assert_allclose(np.sqrt(np.diag(spread)), np.sqrt(np.diag(expected)), rtol=0.25)
    correlation = expected[0, 1] / np.sqrt(expected[0, 0] * expected[1, 1])
    assert spread[0, 1] / np.sqrt(spread[0, 0] * spread[1, 1]) == pytest.approx(correlation, abs=0.15)


def line_of(segment):
    heading = np.arctan2(segment[3] - segment[1], segment[2] - segment[0])
    return heading, -np.sin(heading) * segment[0] + np.cos(heading) * segment[1]


def test_the_end_of_a_wall_and_what_is_behind_it_are_not_joined():
    """A doorway: the beams through it end at another wall; nothing runs along the line of sight."""
    angles_rad = np.radians(np.linspace(-80.0, 80.0, 321))
    x = np.where(np.abs(np.tan(angles_rad) * 2.0) < 0.5, 6.0, 2.0)  # a gap of 1 m in a wall 2 m ahead
    found = scan_segments.extract(Scan(0, x / np.cos(angles_rad), angles_rad, 0.05, 30.0, np.zeros(3)))
    heading = np.abs(
        np.arctan2(found.segments_m[:, 3] - found.segments_m[:, 1], found.segments_m[:, 2] - found.segments_m[:, 0])
    )
    assert len(found) == 3
    np.testing.assert_allclose(heading, np.pi / 2, atol=1e-6)
    assert found.segments_m[:, 0] == pytest.approx([2.0, 6.0, 2.0], abs=1e-6)


def test_beams_that_are_left_out_draw_nothing():
    scan = room_scan()
    used = np.arange(360) < 180
    found = scan_segments.extract(scan, used=used)
    assert (found.beam_segment[180:] == -1).all() and len(found) >= 2
    spoilt = replace(scan, ranges_m=np.where(used, scan.ranges_m, np.nan))
    np.testing.assert_array_equal(scan_segments.extract(spoilt).segments_m, found.segments_m)


@pytest.mark.parametrize("ranges_m", [[np.nan, np.inf, -np.inf], [1.0, np.nan, np.nan], [1.0, 1.0, 1.0]])
def test_a_scan_without_walls_has_no_segments(ranges_m):
    found = scan_segments.extract(Scan(0, np.array(ranges_m), np.array([-0.01, 0.0, 0.01]), 0.05, 20.0, np.zeros(3)))
    assert len(found) == 0 and found.covariance.shape == (0, 2, 2) and found.beam_segment.tolist() == [-1] * 3


@pytest.mark.parametrize(
    "fields, line",
    [
        ({"gap_m": 0.0}, "gap_m must be finite and > 0 m, got 0.0"),
        ({"bearing_sigma_rad": -1.0}, "bearing_sigma_rad must be finite and >= 0, got -1.0"),
        ({"least_points": 2}, "least_points must be >= 3, got 2"),
    ],
)
def test_parameters_that_mean_nothing_are_refused(fields, line):
    with pytest.raises(ValueError) as refused:
        ScanSegmentParams(**fields)
    assert str(refused.value) == line
