"""Elements in space: exact on linear fields, six rigid modes, right volumes, areas and energies."""

from __future__ import annotations

import numpy as np
import pytest
import skfem

from fingerslip.errors import InputError
from fingerslip.fe.assembly import cell_constants, mass_matrix, stiffness_matrix, traction_load
from fingerslip.fe.recovery import cell_recovery, strain_energy_density, stress, von_mises
from fingerslip.fe.space import boundary_nodes, build_space, nodal_areas, vector_dofs
from fingerslip.materials import Elastic
from problems.blocks import solve_static

VARIANTS = [("H8", "selective"), ("H8", "full"), ("T4", "full"), ("T4", "nodal"), ("T10", "full")]
GRADIENT = np.array([[1e-3, 4e-4, -2e-4], [-3e-4, -5e-4, 6e-4], [2e-4, 1e-4, 7e-4]])
MATERIAL = Elastic(2e5, 0.48, 1200.0)


def cube(element, count=3):
    """Return a unit cube with inner vertices moved at random, region `bulk`, boundaries `side` and `top`."""
    kind = skfem.MeshHex1 if element == "H8" else skfem.MeshTet1
    grid = np.linspace(0.0, 1.0, count + 1)
    mesh = kind.init_tensor(grid, grid, grid)
    inside = np.all((mesh.p > 1e-9) & (mesh.p < 1 - 1e-9), axis=0)
    points = mesh.p.copy()
    points[:, inside] += np.random.default_rng(3).uniform(-0.06, 0.06, size=(3, inside.sum()))
    mesh = kind(points, mesh.t)
    mesh = skfem.MeshTet2.from_mesh(mesh) if element == "T10" else mesh
    boundaries = {"side": mesh.boundary_facets(), "top": mesh.facets_satisfying(lambda x: x[2] > 1 - 1e-9)}
    return mesh.with_subdomains({"bulk": np.arange(mesh.nelements)}).with_boundaries(boundaries)


def assembled(element, integration):
    space = build_space(cube(element))
    constants = cell_constants(space, {"bulk": MATERIAL}, "solid")
    return space, constants, stiffness_matrix(space, constants, 1.0, integration)


@pytest.mark.parametrize(("element", "integration"), VARIANTS)
def test_patch_test_is_exact_to_rounding(element, integration):
    space, constants, stiffness = assembled(element, integration)
    assert space.element == element
    exact = (space.positions @ GRADIENT.T).ravel()
    edge = vector_dofs(boundary_nodes(space, "side"), 3).ravel()
    found = solve_static(stiffness, np.zeros(space.n_dofs), edge, exact)
    np.testing.assert_allclose(found, exact, atol=1e-12 * np.abs(exact).max())
    strain = 0.5 * (GRADIENT + GRADIENT.T)
    ratio, modulus = MATERIAL.poisson_ratio, MATERIAL.youngs_modulus
    tensor = modulus / (1 + ratio) * (strain + ratio / (1 - 2 * ratio) * np.trace(strain) * np.eye(3))
    expected = tensor[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    strains = cell_recovery(space, constants).strains(found)
    stresses = stress(strains, constants)
    np.testing.assert_allclose(stresses, np.tile(expected, (len(stresses), 1)), atol=1e-9 * np.abs(expected).max())
    density = strain_energy_density(strains, constants)
    np.testing.assert_allclose(density, 0.5 * np.sum(tensor * strain), rtol=1e-9)
    assert 0.5 * found @ stiffness @ found == pytest.approx(density[0], rel=1e-9)
    deviator = tensor - np.trace(tensor) / 3 * np.eye(3)
    np.testing.assert_allclose(von_mises(stresses), np.sqrt(1.5 * np.sum(deviator**2)), rtol=1e-9)


@pytest.mark.parametrize(("element", "integration"), VARIANTS)
def test_only_the_six_rigid_body_modes_are_free_of_force(element, integration):
    _, _, stiffness = assembled(element, integration)
    values = np.linalg.eigvalsh(stiffness.toarray())
    assert np.abs(values[:6]).max() < 1e-10 * values[-1]
    assert values[6] > 1e-6 * values[-1]


@pytest.mark.parametrize("element", ["H8", "T4", "T10"])
def test_mass_areas_and_loads_are_those_of_the_cube(element):
    space = build_space(cube(element))
    constants = cell_constants(space, {"bulk": MATERIAL}, "solid")
    mass = mass_matrix(space, constants, 1.0)
    assert mass.sum() == pytest.approx(3 * MATERIAL.density, rel=1e-12)
    areas = nodal_areas(space, "top", 1.0)
    assert areas.sum() == pytest.approx(1.0, rel=1e-12)
    assert areas @ space.positions[:, 0] == pytest.approx(0.5, rel=1e-12)
    load = traction_load(space, {"top": (1.0, 2.0, -3.0)}, 1.0).reshape(-1, 3)
    np.testing.assert_allclose(load.sum(axis=0), [1.0, 2.0, -3.0], rtol=1e-12)


def test_formulation_has_to_fit_the_dimension():
    with pytest.raises(InputError, match="got plane_strain for a mesh in 3 dimensions, needs solid"):
        cell_constants(build_space(cube("T4")), {"bulk": MATERIAL}, "plane_strain")


def test_nodal_integration_is_for_linear_simplices():
    with pytest.raises(InputError, match="got 'nodal' for H8, needs linear triangles or tetrahedra"):
        assembled("H8", "nodal")
