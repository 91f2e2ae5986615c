"""The dragged cylinder again, beside what another project's program computes: CalculiX, by tests/physics/calculix_block.py.

CalculiX's neo-Hookean law keeps shape and volume apart, with another energy of the volume than the laws here, so this
file has a law of its own with CalculiX's energy.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from importlib import resources
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fingerslip.materials.elastic import Elastic
from fingerslip.materials.finite import log_volume_of
from fingerslip.materials.isochoric import deviator, isochoric_tangent, linearised
from fingerslip.uncertainty import ORDERS, Series, refine
from fingerslip.verification.large_contact import dragged_cylinder
from fingerslip.verification.problem import Check, Problem, absolute, relative

__all__ = ["PROBLEMS", "SplitNeoHookean", "calculix_forces", "calculix_runs"]

Array = NDArray[np.float64]

_SHEAR, _RATIO, _PENALTY, _DEPTH = 10e3, 0.45, 1e10, 2.5e-3
_BULK = 2.0 * _SHEAR * (1.0 + _RATIO) / (3.0 * (1.0 - 2.0 * _RATIO))
_CELLS, _STEPS = 32, 40
_FINEST, _COARSE = 0.25, 0.5


@dataclass(frozen=True)
class SplitNeoHookean:
    """The law ``G/2 (J^(-2/3) tr C - 3) + K/2 (J - 1)^2`` of CalculiX's manual, section "Hyperelastic and hyperfoam".

    Parameters
    ----------
    shear_modulus, bulk_modulus : float
        G and K at rest [Pa].
    density : float
        Mass density in the reference state [kg/m^3].
    """

    shear_modulus: float
    bulk_modulus: float
    density: float = 1000.0

    @property
    def stiffness(self) -> float:
        """Young's modulus at rest [Pa]."""
        return self.at_rest().youngs_modulus

    def at_rest(self) -> Elastic:
        """Return the law at small strain."""
        return linearised(self.shear_modulus, self.bulk_modulus, None, self.density)

    def stored_energy(self, log_strain: Array) -> Array:
        """Return the strain energy per reference volume [J/m^3], shape (n,), of logarithmic strains (n, 3)."""
        shape = np.exp(2.0 * deviator(log_strain)).sum(axis=1) - 3.0
        energy: Array = 0.5 * self.shear_modulus * shape + self.volumetric(log_volume_of(log_strain))[0]
        return energy

    def kirchhoff_stress(self, log_strain: Array) -> Array:
        """Return the principal Kirchhoff stresses [Pa], shape (n, 3), of logarithmic strains (n, 3)."""
        shape = deviator(self.shear_modulus * np.exp(2.0 * deviator(log_strain)))
        return shape + self.volumetric(log_volume_of(log_strain))[1][:, None]

    def kirchhoff_tangent(self, log_strain: Array) -> Array:
        """Return the derivative of the stresses [Pa], shape (n, 3, 3), at logarithmic strains (n, 3)."""
        shape = isochoric_tangent(2.0 * self.shear_modulus * np.exp(2.0 * deviator(log_strain)))
        return shape + self.volumetric(log_volume_of(log_strain))[2][:, None, None]

    def volumetric(self, log_volume: Array) -> tuple[Array, Array, Array]:
        """Return K/2 (J - 1)^2 and its two derivatives by ln J [Pa], each (n,), at ln J (n,)."""
        volume, modulus = np.exp(log_volume), self.bulk_modulus
        stress = modulus * volume * (volume - 1.0)
        return 0.5 * modulus * (volume - 1.0) ** 2, stress, modulus * volume * (2.0 * volume - 1.0)


def calculix_runs() -> dict[tuple[float, int, float], dict[str, Any]]:
    """Return what CalculiX computed, by the length of cells [mm], increments and friction coefficient."""
    path = resources.files("fingerslip") / "data" / "independent" / "calculix_block.json"
    runs = json.loads(path.read_text(encoding="utf-8"))["runs"]
    return {(run["spacing_mm"], run["increments"], run["friction_coefficient"]): run for run in runs}


def calculix_forces() -> tuple[Array, Array]:
    """Return CalculiX's forces on the block with friction for infinitely short increments, and their uncertainties.

    Cells of the finest mesh; what the increments make is measured on the coarsest one. The uncertainty is that of mesh
    and increments, as :mod:`fingerslip.uncertainty` finds it.

    Returns
    -------
    tuple of (8, 2) array
        Along the slide and across it [N/m], for quarters of the press and of the slide.
    """
    runs = calculix_runs()
    forces = {key: np.array(run["force_N_per_m"]) for key, run in runs.items() if key[2] > 0.0}
    meshes = [(spacing, forces[spacing, _STEPS, 0.3]) for spacing in (_FINEST, 0.35, _COARSE)]
    steps = [(_STEPS / count, forces[_COARSE, count, 0.3]) for count in (_STEPS, 2 * _STEPS, 4 * _STEPS)]
    found, spread = meshes[0][1].copy(), np.zeros((8, 2))
    for place in np.ndindex(found.shape):
        of_mesh, of_step = (
            refine(Series(name, tuple(size for size, _ in levels), tuple(value[place] for _, value in levels)), order)
            for name, levels, order in (("mesh", meshes, ORDERS["mesh"]), ("step", steps, 1.0))
        )
        if of_step.limit is not None:
            found[place] += of_step.limit - steps[0][1][place]
        spread[place] = np.hypot(of_mesh.uncertainty or 0.0, of_step.uncertainty or 0.0)
    return found, spread
