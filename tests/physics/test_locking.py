"""A pressed thick ring near incompressibility against Lame's closed form.

Source: Lame's solution in plane strain, u_r(r) = (1 + nu) p a^2 / (E (b^2 - a^2)) [(1 - 2 nu) r + b^2 / r]
for pressure p at the inner radius a, b the outer one. Tolerance 2 % on 8 cells through the wall: the error of
interpolation there is below 1 % for all elements at nu = 0.3, so that more than that is locking.
"""

from __future__ import annotations

import numpy as np
import pytest
import skfem
from skfem.helpers import dot

from fingerslip.fe.space import boundary_nodes, vector_dofs
from fingerslip.verification.meshes import box
from problems.blocks import elastic, solve_static, stiffness_of

INNER, OUTER, MODULUS, PRESSURE = 1.0, 2.0, 1.0, 1e-3


def quarter_ring(element, radial=8, around=16):
    """The rectangle's x is the radius and its y the angle, so `left` is the inner side."""

    def shift(points):
        radius, angle = points
        return np.array([radius * np.cos(angle), radius * np.sin(angle)])

    return box(element, np.linspace(INNER, OUTER, radial + 1), np.linspace(0, np.pi / 2, around + 1), shift=shift)


def radial_displacement(element, integration, poisson_ratio):
    """Return the mean radial displacement of the inner side over the exact one."""
    material = elastic(MODULUS, poisson_ratio)
    space, _, stiffness = stiffness_of(quarter_ring(element), material, "plane_strain", integration)
    facets = space.mesh.boundaries["left"]
    side = skfem.FacetBasis(space.mesh, skfem.ElementVector(space.scalar_element), facets=facets)
    load = skfem.LinearForm(lambda v, w: -PRESSURE * dot(w.n, v)).assemble(side)
    fixed = [vector_dofs(boundary_nodes(space, "bottom"), 2)[:, 1], vector_dofs(boundary_nodes(space, "top"), 2)[:, 0]]
    found = solve_static(stiffness, load, np.unique(np.concatenate(fixed))).reshape(-1, 2)
    inner = boundary_nodes(space, "left")
    directions = space.positions[inner] / np.linalg.norm(space.positions[inner], axis=1)[:, None]
    factor = (1 + poisson_ratio) * PRESSURE * INNER**2 / (MODULUS * (OUTER**2 - INNER**2))
    exact = factor * ((1 - 2 * poisson_ratio) * INNER + OUTER**2 / INNER)
    return float(np.mean(np.sum(found[inner] * directions, axis=1)) / exact)


@pytest.mark.parametrize("poisson_ratio", [0.3, 0.48, 0.4999])
@pytest.mark.parametrize(("element", "integration"), [("Q4", "selective"), ("T6", "full"), ("T3", "nodal")])
def test_these_elements_do_not_lock(element, integration, poisson_ratio):
    ratio = radial_displacement(element, integration, poisson_ratio)
    assert ratio == pytest.approx(1.0, abs=0.02), f"{element} {integration}: {ratio:.4f} of the closed form"


@pytest.mark.parametrize(("element", "integration"), [("Q4", "full"), ("T3", "full")])
def test_these_elements_do_lock(element, integration):
    """They are right at nu = 0.3, worse at 0.48 and lose a quarter or more of the displacement at 0.4999."""
    right, worse, locked = (radial_displacement(element, integration, nu) for nu in (0.3, 0.48, 0.4999))
    assert right == pytest.approx(1.0, abs=0.02)
    assert locked < 0.8, f"{element}: {locked:.3f} of the closed form at 0.4999"
    assert locked < worse < right
