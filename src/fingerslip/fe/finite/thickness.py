"""The thickness in plane stress: the logarithmic strain across the plane at which the stress across it vanishes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import FingerslipError
from fingerslip.materials.finite import FiniteMaterial

__all__ = ["thinned"]

Array = NDArray[np.float64]

_LIMIT, _RENEWED = 60, 6
# Change of an iteration after which rounding is left, as the next would be thousands of times smaller; and the largest
# change, so that far steps do not overshoot.
_LAST, _LARGEST = 1e-10, 0.5


def thinned(material: FiniteMaterial, log_strain: Array) -> Array:
    """Return the logarithmic strain across the plane, shape (n,).

    Parameters
    ----------
    material : FiniteMaterial
        The law.
    log_strain : (n, 3) array
        Principal logarithmic strains [-]; the last ones are a first guess.

    Raises
    ------
    FingerslipError
        Where the law has no such state.
    """
    trial = log_strain.copy()
    for iteration in range(_LIMIT):
        if iteration % _RENEWED == 0:
            stiffness = material.kirchhoff_tangent(trial)[:, 2, 2].copy()
        change = np.clip(material.kirchhoff_stress(trial)[:, 2] / stiffness, -_LARGEST, _LARGEST)
        trial[:, 2] -= change
        if np.abs(change).max(initial=0.0) <= _LAST:
            return trial[:, 2]
    found = f"{type(material).__name__}: no thickness with zero stress across the plane was found"
    raise FingerslipError(f"{found}; take plane strain, or smaller steps")
