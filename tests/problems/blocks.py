"""Meshes and static solutions that tests of elements, contact and dynamics share."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse import linalg

from fingerslip.fe.cell_materials import cell_materials
from fingerslip.fe.forms import stiffness_matrix
from fingerslip.fe.space import build_space
from fingerslip.materials.elastic import Elastic
from fingerslip.verification.meshes import box, jiggle

ELEMENTS = ("Q4", "T3", "T6")


def distorted(element, count=4):
    """Return the unit square or cube with randomly moved inner vertices."""
    grid = np.linspace(0.0, 1.0, count + 1)
    return box(element, *(grid,) * (2 if element in ELEMENTS else 3), shift=jiggle(0.25))


def elastic(youngs_modulus=1e5, poisson_ratio=0.3, density=1000.0):
    return Elastic(youngs_modulus=youngs_modulus, poisson_ratio=poisson_ratio, density=density)


def stiffness_of(mesh, material, formulation="plane_strain", integration="selective", depth=1.0):
    """Return space, materials and stiffness of a mesh of one material in the region `bulk`."""
    space = build_space(mesh)
    materials = cell_materials(space, {"bulk": material}, formulation)
    return space, materials, stiffness_matrix(space, materials, depth, integration)


def solve_static(stiffness, load, fixed, prescribed=None):
    """Solve K u = f with u = `support_values` (zero without it) at the degrees of freedom `fixed`."""
    count = stiffness.shape[0]
    displacement = np.zeros(count)
    if prescribed is not None:
        displacement[fixed] = prescribed[fixed]
    free = np.setdiff1d(np.arange(count), fixed)
    right = (load - stiffness @ displacement)[free]
    displacement[free] = linalg.spsolve(sparse.csc_matrix(stiffness[free][:, free]), right)
    return displacement


def fitted_slope(sizes, errors):
    """Return the slope of log(error) over log(size)."""
    return float(np.polyfit(np.log(sizes), np.log(errors), 1)[0])
