"""The thickness in plane stress: the logarithmic strain across the plane at which the stress across it vanishes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.errors import FingerslipError, InputError
from fingerslip.materials.large_strain import FiniteMaterial
from fingerslip.materials.relaxing import StepLaw

_LIMIT, _RENEWED = 60, 6
# Change of an iteration after which rounding is left, as the next would be thousands of times smaller; and the largest
# change, so that far steps do not overshoot.
_LAST, _LARGEST = 1e-10, 0.5


@dataclass(frozen=True)
class Pulled:
    """What the start of a step takes from the stress across, the deviator of J^(-2/3) F Y F^T."""

    in_plane: Floats  # (n,), Y:C in 2D [Pa]
    across: Floats  # (n,), component of Y across the plane [Pa]

    def stress(self, log_strain: Floats) -> tuple[Floats, Floats]:
        """Return what comes to the stress across and to its derivative [Pa], (n,) each, at strains (n, 3)."""
        scale = np.exp(-2.0 / 3.0 * log_strain.sum(axis=1))
        pull = scale * self.across * np.exp(2.0 * log_strain[:, 2])
        third = (pull + scale * self.in_plane) / 3.0
        return third - pull, -2.0 / 3.0 * (third + pull)


def thickness_strain(material: FiniteMaterial | StepLaw, log_strain: Floats, pulled: Pulled | None = None) -> Floats:
    """Return the logarithmic strain across the plane, shape (n,), searched from strains (n, 3) [-]."""
    trial, nothing = log_strain.copy(), np.zeros(len(log_strain))
    for iteration in range(_LIMIT):
        added, stiffer = (nothing, nothing) if pulled is None else pulled.stress(trial)
        if iteration % _RENEWED == 0:
            stiffness = material.kirchhoff_tangent(trial)[:, 2, 2] + stiffer
        change = np.clip((material.kirchhoff_stress(trial)[:, 2] + added) / stiffness, -_LARGEST, _LARGEST)
        trial[:, 2] -= change
        if np.abs(change).max(initial=0.0) <= _LAST:
            return trial[:, 2]
    fault = f"{_name(material)}: no thickness with zero stress across the plane was found"
    raise FingerslipError(f"{fault}; take plane strain, or smaller steps")


def check_thickness(name: str, material: FiniteMaterial) -> None:
    """Refuse a law that cannot be in plane stress: its thickness does not follow from the stress across."""
    at_rest = np.zeros((1, 3))
    stress = float(material.kirchhoff_stress(at_rest)[0, 2])
    stiffness = float(material.kirchhoff_tangent(at_rest)[0, 2, 2])
    if stiffness > 0.0 and abs(stress) <= _LAST * stiffness:
        return
    zz = "whose stress across the plane is"
    fault = f"got {_name(material)}, {zz} {stress:g} Pa at rest and grows by {stiffness:g} Pa"
    repair = "take plane_strain, or correct kirchhoff_stress and kirchhoff_tangent of the law"
    raise InputError(f"materials.{name}", fault, "plane stress needs 0 Pa at rest, and growth with the strain", repair)


def _name(material: FiniteMaterial | StepLaw) -> str:
    """Return the name of a law for messages."""
    return type(material.material if isinstance(material, StepLaw) else material).__name__
