"""The optics of glass in near infrared: how much a pane reflects, transmits and returns.

Fresnel's equations for a sheet with two surfaces, light unpolarised and not coherent (Hecht, Optics, 5th ed., sec. 4.6;
Born, Wolf, Principles of Optics, sec. 1.6.4 for the sheet). Incidence is the angle to the normal; any shape.
"""

from __future__ import annotations

from typing import Tuple

import numpy as np

INDEX = 1.51  # refractive index of float glass
ABSORPTION_PER_M = 4.0  # clear float glass near 0.9 um: 3 percent in 8 mm
LARGEST_REFLECTANCE = 0.85  # of a coated pane at any incidence


def reflectance(cos_incidence: np.ndarray, coating: np.ndarray, sheets: np.ndarray) -> np.ndarray:
    """R of a glazing of one or two sheets; a coating multiplies R of the sheet, up to LARGEST_REFLECTANCE."""
    one = np.minimum(coating * _clear(cos_incidence), np.maximum(LARGEST_REFLECTANCE, _clear(cos_incidence)))
    return np.where(sheets > 1, one + (1.0 - one) ** 2 * one / (1.0 - one**2 + 1e-12), one)


def sheet(cos_incidence: np.ndarray, coating: np.ndarray, thickness_m: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """R and T = 1 - R - A of one sheet; A is absorbed along the path through it."""
    reflected = reflectance(cos_incidence, coating, np.ones(()))
    sin_inside = np.sqrt(np.maximum(1.0 - cos_incidence**2, 0.0)) / INDEX
    absorbed = 1.0 - np.exp(-ABSORPTION_PER_M * thickness_m / np.sqrt(1.0 - sin_inside**2))
    return reflected, np.maximum((1.0 - reflected) * (1.0 - absorbed), 0.0)


def visibility(incidence_rad: np.ndarray, half_rad: float, width_rad: float) -> np.ndarray:
    """Share of beams that a clean pane returns: logistic, 1 near the normal, half at half_rad."""
    return 1.0 / (1.0 + np.exp(np.clip((incidence_rad - half_rad) / width_rad, -50.0, 50.0)))


def _clear(cos_incidence: np.ndarray) -> np.ndarray:
    """Reflectance of a clear sheet: 2 r / (1 + r), with r of one surface averaged over both polarisations."""
    cos_outside = np.clip(cos_incidence, 0.0, 1.0)
    cos_inside = np.sqrt(1.0 - (1.0 - cos_outside**2) / INDEX**2)
    across = ((cos_outside - INDEX * cos_inside) / (cos_outside + INDEX * cos_inside)) ** 2
    along = ((INDEX * cos_outside - cos_inside) / (INDEX * cos_outside + cos_inside)) ** 2
    return across / (1.0 + across) + along / (1.0 + along)
