"""ExpectedRanges made by hand: what the map offers, without a map."""

from __future__ import annotations

import numpy as np

from glass_nav.localization.beam_classification.expected_ranges import ExpectedRanges

NEVER = np.inf
OBLIQUE = np.radians(45.0)  # neither head on, where panes answer, nor grazing, where they mirror


def expect(
    first=NEVER,
    mirrored=NEVER,
    second=NEVER,
    third=NEVER,
    cos=1.0,
    thickness_m=0.05,
    incidence=OBLIQUE,
    cell=0,
    line_m=None,
    axis_rad=0.0,
    seen_side=True,
) -> ExpectedRanges:
    """Ranges (4, N, B); each a number, a row of beams (B,), or samples and beams (N, B).

    cos, thickness_m, incidence, cell and axis_rad: a number for all, or a row of beams. line_m: of the first surface;
    lines are where the cells are for the other ones, and for it if none is given.
    """
    ranges = np.stack(
        np.broadcast_arrays(*[np.atleast_2d(np.asarray(value, float)) for value in (first, mirrored, second, third)])
    )
    beams = ranges.shape[2]

    def everywhere(value, shape=ranges.shape):
        return np.array(np.broadcast_to(value, shape))

    lines = ranges[:, 0].copy()
    if line_m is not None:
        lines[0] = line_m
    return ExpectedRanges(
        range_m=ranges,
        cos_incidence=everywhere(cos),
        thickness_m=everywhere(thickness_m),
        cell=everywhere(cell).astype(np.int32),
        pane_incidence=everywhere(incidence, ranges.shape[1:]),
        line_m=lines,
        axis_rad=everywhere(axis_rad, (4, beams)),
        face_m=0.0,
        seen_side=everywhere(np.reshape(seen_side, (-1, 1)), (4, beams)),
    )
