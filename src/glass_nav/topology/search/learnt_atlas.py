"""Corrects the values and tolerances of an atlas by what robots measured.

The value of the map is a measurement with its own standard deviation s0; n visits with mean m add one with s /
sqrt(n). The best estimate weights both by their inverse variances. s is the spread of the visits, but at least the
stated measurement error of the robots, so that the atlas never claims to be more precise than they are. A spread
beyond the measurement error belongs to the place, and widens its tolerance. Seed document
global_localization_procedure.txt says only that what was driven "can be used to update the Atlas"; the formulation is
ours.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Tuple

import numpy as np

from glass_nav.topology.atlas.atlas import Atlas
from glass_nav.topology.search.matching import Tolerances

MIN_VISITS = 3  # before a value is corrected
MIN_SIGMA_M = 0.01


def of(atlas: Atlas, tolerances: Tolerances) -> Atlas:
    """The atlas with the values that the visits give; the same object where nothing was learnt.

    Args:
        atlas: of the map, with visits.
        tolerances: of the robots' measurements.
    """
    nodes, edges, visits = atlas.nodes, atlas.edges, atlas.visits
    if not ((visits.node_count >= MIN_VISITS).any() or (visits.edge_count >= MIN_VISITS).any()):
        return atlas
    r_m, sigma_r_m = _combined(
        nodes.r_m,
        nodes.sigma_r_m,
        np.full(len(nodes), tolerances.r_sigma_m),
        (visits.node_count, visits.node_r_mean_m, visits.node_r_m2),
    )
    length_m, sigma_m = _combined(
        edges.length_m,
        edges.sigma_m,
        tolerances.sigma_length_m(edges.length_m),
        (visits.edge_count, visits.edge_length_mean_m, visits.edge_length_m2),
    )
    chord_m = np.clip(edges.chord_m + length_m - edges.length_m, 0.0, length_m)
    return replace(
        atlas,
        nodes=replace(nodes, r_m=r_m, sigma_r_m=sigma_r_m),
        edges=replace(edges, length_m=length_m, chord_m=chord_m, sigma_m=sigma_m),
    )


def _combined(
    value: np.ndarray, sigma: np.ndarray, measured_sigma: np.ndarray, visits: Tuple[np.ndarray, np.ndarray, np.ndarray]
) -> Tuple[np.ndarray, np.ndarray]:
    """Values and their standard deviations, of map and visits together; as given with less than MIN_VISITS."""
    count, mean, m2 = visits
    learnt = count >= MIN_VISITS
    n = np.maximum(count, 1)
    spread2 = m2 / np.maximum(n - 1, 1)
    of_map, of_visits = sigma**-2, n / np.maximum(spread2, measured_sigma**2)
    both = (of_map * value + of_visits * mean) / (of_map + of_visits)
    beyond2 = np.maximum(spread2 - measured_sigma**2, 0.0)
    both_sigma = np.maximum(np.sqrt(1.0 / (of_map + of_visits) + beyond2), MIN_SIGMA_M)
    return np.where(learnt, both, value), np.where(learnt, both_sigma, sigma)
