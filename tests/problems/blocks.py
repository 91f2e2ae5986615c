"""Meshes, kinds of elements and static solutions that tests of elements, contact and dynamics share."""

import numpy as np
from scipy import sparse
from scipy.sparse import linalg

from fingerslip.fe.cell_materials import cell_materials
from fingerslip.fe.forms import stiffness_matrix
from fingerslip.fe.space import boundary_nodes, build_space
from fingerslip.materials.elastic import Elastic
from fingerslip.verification.meshes import box, dimension, jiggle

ELEMENTS = ("Q4", "T3", "T6")
EVERY_ELEMENT = (*ELEMENTS, "H8", "T4", "T10")
_IN_2D = (("Q4", "selective"), ("Q4", "full"), ("T3", "full"), ("T3", "nodal"), ("T6", "full"))
_IN_3D = (("H8", "selective"), ("H8", "full"), ("T4", "full"), ("T4", "nodal"), ("T10", "full"))
#: Every element with its integrations and formulations.
KINDS = (
    *((*kind, formulation) for formulation in ("plane_strain", "plane_stress") for kind in _IN_2D),
    *((*kind, "solid") for kind in _IN_3D),
)


def distorted(element, count=4):
    """Return the unit square or cube with randomly moved inner vertices."""
    return box(element, *[np.linspace(0.0, 1.0, count + 1)] * dimension(element), shift=jiggle(0.25))


def elastic(youngs_modulus=1e5, poisson_ratio=0.3, density=1000.0):
    return Elastic(youngs_modulus=youngs_modulus, poisson_ratio=poisson_ratio, density=density)


def stiffness_of(mesh, material, formulation="plane_strain", integration="selective", depth=1.0):
    """Return space, materials and stiffness of a mesh of one material in the region `bulk`."""
    space = build_space(mesh)
    materials = cell_materials(space, {"bulk": material}, formulation)
    return space, materials, stiffness_matrix(space, materials, depth, integration)


def side_nodes(space):
    """Return the nodes on all sides."""
    return np.unique(np.concatenate([boundary_nodes(space, side) for side in space.mesh.boundaries]))


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


def difference(got, expected):
    """Return the largest difference of two arrays over the largest expected value."""
    return float(np.abs(got - expected).max() / np.abs(expected).max())
