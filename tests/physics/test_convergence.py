"""Manufactured solution: the error must fall at the rate that the element's polynomial degree gives.

Source: a priori estimates of the displacement method (Ciarlet 1978): for smooth solutions and degree k the
error falls with h^(k+1) in L2 and h^k in H1. The fitted slope over the last refinements may differ from the
asymptotic one by 0.1, the usual pre-asymptotic remainder at 1/32.
"""

from __future__ import annotations

import numpy as np
import pytest
import skfem
from skfem.helpers import ddot, dot, grad

from fingerslip.fe.cell_materials import cell_materials
from fingerslip.fe.forms import stiffness_matrix
from fingerslip.fe.space import boundary_nodes, build_space, vector_dofs
from fingerslip.verification.meshes import box
from problems.blocks import elastic, fitted_slope, solve_static

RATIO = -0.5  # second component over the first
FRAME = np.pi


def exact(x):
    wave = np.sin(FRAME * x[0]) * np.sin(FRAME * x[1])
    return np.array([wave, RATIO * wave])


def exact_gradient(x):
    sx, sy, cx, cy = np.sin(FRAME * x[0]), np.sin(FRAME * x[1]), np.cos(FRAME * x[0]), np.cos(FRAME * x[1])
    slope = FRAME * np.array([cx * sy, sx * cy])
    return np.array([slope, RATIO * slope])


def counterface_force(x, lame, shear):
    """-div sigma of the exact displacement: -(G laplace u + (lambda + G) grad div u)."""
    wave = np.sin(FRAME * x[0]) * np.sin(FRAME * x[1])
    mixed = np.cos(FRAME * x[0]) * np.cos(FRAME * x[1])
    dilatation = FRAME**2 * np.array([-wave + RATIO * mixed, mixed - RATIO * wave])
    return 2 * FRAME**2 * shear * np.array([wave, RATIO * wave]) - (lame + shear) * dilatation


def bent(points):
    """Bend the square's inside smoothly, so that no cell is a rectangle."""
    x, y = points
    bump = 0.08 * np.sin(np.pi * x) * np.sin(np.pi * y)
    return np.array([x + bump, y - 0.7 * bump])


def errors(element, count, formulation, poisson_ratio):
    grid = np.linspace(0.0, 1.0, count + 1)
    space = build_space(box(element, grid, grid, shift=bent))
    material = elastic(1.0, poisson_ratio)
    stiffness = stiffness_matrix(space, cell_materials(space, {"bulk": material}, formulation), 1.0, "selective")
    lame, shear = material.dilatational_modulus(formulation), material.shear_modulus
    fine = skfem.Basis(space.mesh, skfem.ElementVector(space.scalar_element), intorder=8)
    load = skfem.LinearForm(lambda v, w: dot(counterface_force(w.x, lame, shear), v)).assemble(fine)
    edge = np.unique(np.concatenate([boundary_nodes(space, side) for side in ("left", "right", "top", "bottom")]))
    found = fine.interpolate(solve_static(stiffness, load, vector_dofs(edge, 2).ravel()))

    def norm(of):
        return np.sqrt(skfem.Functional(of).assemble(fine))

    l2 = norm(lambda w: dot(found - exact(w.x), found - exact(w.x)))
    h1 = norm(lambda w: ddot(grad(found) - exact_gradient(w.x), grad(found) - exact_gradient(w.x)))
    return l2, h1


@pytest.mark.parametrize(
    ("element", "formulation", "poisson_ratio", "l2_rate", "h1_rate"),
    [
        ("Q4", "plane_strain", 0.3, 2, 1),
        ("Q4", "plane_stress", 0.3, 2, 1),
        ("T3", "plane_strain", 0.3, 2, 1),
        ("T3", "plane_stress", 0.48, 2, 1),
        ("T6", "plane_strain", 0.3, 3, 2),
        ("T6", "plane_stress", 0.48, 3, 2),
    ],
)
def test_convergence_at_the_elements_rate(element, formulation, poisson_ratio, l2_rate, h1_rate):
    counts = [8, 16, 32]
    measured = np.array([errors(element, count, formulation, poisson_ratio) for count in counts])
    l2, h1 = (fitted_slope(1.0 / np.array(counts[1:]), column[1:]) for column in measured.T)
    table = f"{element} {formulation} nu={poisson_ratio}: L2 {l2:.3f} (expected {l2_rate}), H1 {h1:.3f} ({h1_rate})"
    assert l2 >= l2_rate - 0.1, table
    assert h1 >= h1_rate - 0.1, table
    assert l2 <= l2_rate + 0.5, table
