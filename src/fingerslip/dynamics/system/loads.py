"""Loads on the deformable body: tractions and gravity, with their factors over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.fe.cell_materials import CellMaterials
from fingerslip.fe.forms import mass_matrix, traction_load
from fingerslip.fe.space import Space
from fingerslip.materials.material import Material
from fingerslip.model.model import Model, Traction
from fingerslip.model.programme import CONSTANT, Ramp

__all__ = ["Load", "model_loads"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Load:
    """Nodal forces with a factor over time."""

    forces: Array  # (n,), nodal forces at factor one [N]
    ramp: Ramp  # factor over time


def model_loads(model: Model, space: Space, materials: CellMaterials[Material]) -> tuple[Load, ...]:
    """Return the tractions and the gravity of a model on all degrees of freedom of its mesh."""
    loads = []
    for name, traction in model.tractions.items():
        value, ramp = (traction.value, traction.ramp) if isinstance(traction, Traction) else (traction, CONSTANT)
        loads.append(Load(traction_load(space, {name: value}, model.depth), ramp))
    if model.gravity is not None:
        if len(model.gravity) != space.dim:
            raise InputError("gravity", f"got {len(model.gravity)} components", f"needs {space.dim}")
        acceleration = np.tile(model.gravity, len(space.positions))
        loads.append(Load(mass_matrix(space, materials, model.depth) @ acceleration, CONSTANT))
    return tuple(loads)
