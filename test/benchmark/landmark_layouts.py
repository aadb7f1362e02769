#!/usr/bin/env python3
"""Figure 7 of the bearings document: layouts of tags and viewers within its drawing, and the errors that they allow.

    python test/benchmark/landmark_layouts.py
    python test/benchmark/landmark_layouts.py --tag-spacing 0.5 --within 0.18

Figure 6 draws four tags and four viewers on axes marked -3 m, 3 m (X) and 4 m, 7 m, 8 m (Y), without coordinates. Here
tags stand on a grid over X -3 to 3 m, Y 4 to 8 m, viewers on one over X -3 to 3 m, Y 0 to 3 m. For every four tags and
every viewer: the worst position error of the worst of the four triples, if both angles of a triple may be wrong by a
step (limits_of_error(), as in Tables 1 and 2). A layout is four tags and the four viewers that see them best. Printed are
how many layouts keep the limit of Figure 7, and those with the smallest worst error.
"""

from __future__ import annotations

import argparse
import itertools
import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np

from glass_nav.localization.bearings import bearing_errors, inscribed_circles

VIEWERS = 4


def grid(low: "tuple[float, float]", high: "tuple[float, float]", spacing: float) -> np.ndarray:
    """(N, 2) points [m]."""
    axes = [np.arange(a, b + 1e-9, spacing) for a, b in zip(low, high)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)


def worst_errors(tags_m: np.ndarray, triples: np.ndarray, viewer_m: np.ndarray, step_rad: float) -> np.ndarray:
    """(T,) [m] largest of limits_of_error() for triples (T, 3) of tags (N, 2), by the order in which a viewer sees them."""
    bearing = np.arctan2(*(tags_m - viewer_m)[:, ::-1].T)
    triples = np.take_along_axis(triples, np.argsort(-bearing[triples], axis=1), axis=1)
    steps = np.array(bearing_errors.STEPS) * step_rad
    first, second = (each.ravel() for each in np.meshgrid(steps, steps, indexing="ij"))
    wrong = np.stack([-first, np.zeros_like(first), second], axis=-1)  # (25, 3)
    direction = bearing[triples][:, None] + wrong
    landmarks = np.broadcast_to(tags_m[triples][:, None], (*direction.shape, 2))
    poses, _ = inscribed_circles.intersect(landmarks.reshape(-1, 3, 2), direction.reshape(-1, 3))
    error_m = np.hypot(*(poses[:, :2] - viewer_m).T).reshape(len(triples), -1).max(axis=1)
    return np.where(np.isfinite(error_m), error_m, np.inf)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--step-deg", type=float, default=1.0)
    parser.add_argument("--within", type=float, default=0.18, metavar="M", help="of Figure 7")
    parser.add_argument("--tag-spacing", type=float, default=1.0, metavar="M")
    parser.add_argument("--viewer-spacing", type=float, default=1.0, metavar="M")
    parser.add_argument("--show", type=int, default=3, help="layouts to print")
    args = parser.parse_args()
    tags_m = grid((-3.0, 4.0), (3.0, 8.0), args.tag_spacing)
    viewers_m = grid((-3.0, 0.0), (3.0, 3.0), args.viewer_spacing)
    triples = np.array(list(itertools.combinations(range(len(tags_m)), 3)))
    number = np.full((len(tags_m),) * 3, -1, np.int32)
    number[tuple(triples.T)] = np.arange(len(triples))
    step_rad = np.radians(args.step_deg)
    errors_m = np.stack([worst_errors(tags_m, triples, each, step_rad) for each in viewers_m], axis=1)  # (T, V)
    fours = np.array(list(itertools.combinations(range(len(tags_m)), 4)))
    worst_m = np.zeros((len(fours), len(viewers_m)), np.float32)
    for left_out in range(4):
        worst_m = np.maximum(worst_m, errors_m[number[tuple(np.delete(fours, left_out, axis=1).T)]])
    layouts_m = np.sort(worst_m, axis=1)[:, VIEWERS - 1]  # the fourth best viewer decides
    within = layouts_m <= args.within
    print(f"{len(fours)} sets of four tags, {len(viewers_m)} places of viewers, steps of {args.step_deg:g} degrees")
    print(
        f"{int(within.sum())} layouts keep all four triples of four viewers within {100 * args.within:g} cm in the worst "
        f"case; the best {100 * layouts_m.min():.1f} cm, the median {100 * np.median(layouts_m):.0f} cm"
    )
    for layout in np.argsort(layouts_m)[: args.show]:
        seen_by = np.argsort(worst_m[layout])[:VIEWERS]
        print(f"tags {tags_m[fours[layout]].tolist()} m")
        for viewer in seen_by:
            by_triple = [errors_m[number[tuple(np.delete(fours[layout], out))], viewer] for out in range(4)]
            print(
                f"  viewer {viewers_m[viewer].tolist()} m: "
                + ", ".join(f"{100 * each:.1f}" for each in sorted(by_triple))
                + " cm by triple"
            )


if __name__ == "__main__":
    main()
